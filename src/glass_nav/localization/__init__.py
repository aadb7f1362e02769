"""Localization in a known map: classify the beams of each scan, weight particles, estimate and check the pose."""
