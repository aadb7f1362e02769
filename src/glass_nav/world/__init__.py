"""The map: grid, landmarks, panes, wall segments, and their files."""
