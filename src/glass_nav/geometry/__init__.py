"""Angles, rigid motions in the plane and paths of poses: numpy only."""
