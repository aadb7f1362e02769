"""Decides whether the pose is right: kidnap detector, covariance, protection levels, and the reported state."""
