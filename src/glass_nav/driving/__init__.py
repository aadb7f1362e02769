"""Driving along the edges of the Voronoi graph, and to places of the map."""
