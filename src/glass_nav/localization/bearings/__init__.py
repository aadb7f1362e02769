"""Computes the pose from bearings to landmarks, with its covariance, and where more landmarks would help."""
