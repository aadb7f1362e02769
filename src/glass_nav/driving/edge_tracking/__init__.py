"""Follows the edges of the Voronoi graph around the robot by lidar and odometry alone, and reports them.

edge_driver.py calls the others: scans -> local map -> its Voronoi graph -> line to follow -> meetpoint or dead end.
"""
