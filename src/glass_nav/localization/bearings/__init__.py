"""Bearings to landmarks and a landmark map -> pose, with its error."""
