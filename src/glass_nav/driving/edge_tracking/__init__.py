"""Follows the edges of the Voronoi graph around the robot and reports them. Needs no map."""
