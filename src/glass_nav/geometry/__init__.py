"""Plane geometry on numpy arrays: angles, rigid motions, polylines, segments, trajectories.

Knows neither maps nor sensors. Poses are arrays (..., 3) of x [m], y [m], yaw [rad]; se2.py composes them.
"""
