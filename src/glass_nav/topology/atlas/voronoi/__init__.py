"""The stages of voronoi_graph.py, in this order: bounds, ridges, pruning, meetpoints, graph."""
