"""Finds glass that the map lacks, from scans at trusted poses.

pane_finder.py calls the others in this order: kept scans -> returns that the map does not explain -> lines -> panes
with their probabilities. `glass_nav map panes` runs it over a log, the localization while the robot drives.
"""
