"""The hierarchical atlas: the Voronoi graph of a map with what a robot measures along it.

atlas.py has its arrays, atlas_builder.py makes one from a map, atlas_file.py reads and writes it.
"""
