"""Finds free-standing objects of a map that are too thick to be glass: furniture, pillars.

A mapper sees the outside of such a thing only: its inside stays unknown. Panes are thin, and stand between walls. H rows,
W columns.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from glass_nav.world.grid_map import GridMap

_MAX_EDGE_M = 4.0  # of the box along the axes of the grid that holds the thing; what is larger is a room or a wall
_TOUCHING = np.ones((3, 3), int)  # cells that touch at a corner belong together


def walls(grid_map: GridMap, max_glass_thickness_m: float) -> np.ndarray:
    """(H, W) bool: the occupied cells of free-standing things that hold a square wider than a pane is thick."""
    width = int(max_glass_thickness_m / grid_map.resolution_m) + 1
    taken = ~grid_map.free
    wide = ndimage.minimum_filter(taken, width, mode="constant", cval=False)
    thing, _ = ndimage.label(taken, _TOUCHING)
    chosen = np.zeros(thing.max() + 1, bool)
    chosen[thing[wide]] = True
    last_row, last_column = taken.shape[0] - 1, taken.shape[1] - 1
    for number, (rows, columns) in enumerate(ndimage.find_objects(thing), start=1):
        at_border = rows.start == 0 or columns.start == 0 or rows.stop > last_row or columns.stop > last_column
        edge = max(rows.stop - rows.start, columns.stop - columns.start)
        if at_border or edge * grid_map.resolution_m > _MAX_EDGE_M:
            chosen[number] = False
    return chosen[thing] & grid_map.occupied
