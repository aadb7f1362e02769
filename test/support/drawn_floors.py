"""Floors drawn cell by cell, with walls as rough as a mapper leaves them."""

from __future__ import annotations

from typing import Sequence, Tuple

import numpy as np
from scipy import ndimage

from glass_nav.world.grid_map import UNKNOWN, GridMap

Box = Tuple[float, float, float, float]  # x and y of two corners [m]


def floor(
    width_m: float,
    height_m: float,
    free: Sequence[Box],
    occupied: Sequence[Box] = (),
    unknown: Sequence[Box] = (),
    resolution_m: float = 0.05,
    rough: float = 0.0,
    seed: int = 0,
    map_from_grid: Sequence[float] = (0.0, 0.0, 0.0),
) -> GridMap:
    """Solid walls, the free boxes cut out of them, then what stands there put in, then what nobody saw.

    A cell is in a box if its centre is. `rough`: so many of the wall's cells that border on free ones are missing, and
    so many of the free ones there are occupied.
    """
    rows, columns = round(height_m / resolution_m), round(width_m / resolution_m)
    occupancy = np.full((rows, columns), 100, np.int8)
    for boxes, value in ((free, 0), (occupied, 100)):
        for box in boxes:
            occupancy[_cells(box, resolution_m)] = value
    if rough:
        rng = np.random.default_rng(seed)
        wall = occupancy == 100
        loose = wall & ndimage.binary_dilation(~wall), ~wall & ndimage.binary_dilation(wall)
        for edge, value in zip(loose, (0, 100)):
            occupancy[edge & (rng.random(edge.shape) < rough)] = value
    for box in unknown:
        occupancy[_cells(box, resolution_m)] = UNKNOWN
    return GridMap(occupancy, resolution_m, np.array(map_from_grid, float))


def _cells(box: Box, resolution_m: float) -> Tuple[slice, slice]:
    x0, y0, x1, y1 = (round(value / resolution_m) for value in box)
    return slice(y0, y1), slice(x0, x1)
