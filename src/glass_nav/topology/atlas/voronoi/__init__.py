"""The stages of voronoi_graph.py, in order: bounds, ridges, pruning, meetpoints, graph."""
