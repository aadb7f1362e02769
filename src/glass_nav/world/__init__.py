"""What the map says: the occupancy grid, landmarks, panes of glass, wall segments, and the files of each.

Begin with grid_map.py. Everything is in the frame `map`. Glass is occupied like any wall; nothing here tells them
apart.
"""
