"""Scan and segment map -> corrected pose, with its quality measures."""
