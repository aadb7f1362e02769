"""Along the edges of the Voronoi graph around the robot, and what it reports of them: needs no map."""
