"""GridMap, poses -> what beams would meet: the face of the compiled module _mrpt_grid."""
# INTERFACE SKETCH: owned by the ray caster's author, see /tmp/glass/INTERFACE.md
