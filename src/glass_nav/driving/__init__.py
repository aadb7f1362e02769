"""Drives along the edges of the Voronoi graph, and to poses of the map."""
