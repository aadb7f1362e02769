"""How good was it?  Trajectories to errors, tables and pictures."""
