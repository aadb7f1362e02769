"""The thickness with which each wall is drawn in a map.

A mapper draws a wall as thick as its scans disagree: one or two cells, or half a metre. The wall itself
is somewhere inside. Where the map is solid the question has no answer, and the thickness is one cell.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from glass_nav.world.grid_map import OCCUPIED_PERCENT, GridMap

SOLID_M = 0.8
_STRIP_ROWS = 256


def wall_thickness(grid_map: GridMap, solid_m: float = SOLID_M) -> np.ndarray:
    """(H * W,) float32 [m] for occupied cells, one cell's edge where the map is thicker than solid_m.

    Twice the largest distance to the outside near the cell; 0 for cells that are not occupied.
    """
    thickness_m = np.zeros(grid_map.occupancy.size, np.float32)
    height, width = grid_map.occupancy.shape
    for first in range(0, height, _STRIP_ROWS):  # the transform takes 28 bytes a cell
        _draw(thickness_m, grid_map, slice(first, min(first + _STRIP_ROWS, height)), slice(0, width), solid_m)
    return thickness_m


def redraw(thickness_m: np.ndarray, grid_map: GridMap, rows: slice, columns: slice) -> None:
    """Bring the thickness (H * W,) of all walls, with SOLID_M, up to date after cells in a box of the map changed."""
    reach = _reach(grid_map.resolution_m, SOLID_M)
    near = [slice(max(0, box.start - reach), box.stop + reach) for box in (rows, columns)]
    _draw(thickness_m, grid_map, near[0], near[1], SOLID_M)


def _reach(resolution_m: float, solid_m: float) -> int:
    """How far away [cells] a cell may count: the length of a climb plus the distance at its end."""
    return 2 * (int(round(0.5 * solid_m / resolution_m)) + 1)


def _draw(thickness_m: np.ndarray, grid_map: GridMap, rows: slice, columns: slice, solid_m: float) -> None:
    """Write the thickness of the walls in a box into that of the whole map, (H * W,)."""
    reach = _reach(grid_map.resolution_m, solid_m)
    around = tuple(slice(max(0, box.start - reach), box.stop + reach) for box in (rows, columns))
    middle = tuple(slice(a.start - b.start, a.stop - b.start) for a, b in zip((rows, columns), around))
    fresh = _of(grid_map.occupancy[around] >= OCCUPIED_PERCENT, grid_map.resolution_m, solid_m)
    thickness_m.reshape(grid_map.occupancy.shape)[rows, columns] = fresh[middle]


def _of(occupied: np.ndarray, resolution: float, solid_m: float) -> np.ndarray:
    """(H, W) thickness of the occupied cells (H, W)."""
    if not occupied.any():
        return np.zeros(occupied.shape, np.float32)
    inside = ndimage.distance_transform_edt(np.pad(occupied, 1))[1:-1, 1:-1].astype(np.float32)
    reach = max(1, int(round(0.5 * solid_m / resolution)))
    rows, columns = np.nonzero(occupied)
    ridge = ndimage.maximum_filter(inside, size=3) if reach == 1 else _largest_uphill(inside, reach)
    half = ridge[rows, columns]
    thickness = np.zeros(occupied.shape, np.float32)
    thickness[rows, columns] = np.where((2.0 * half - 1.0) * resolution > solid_m, 1.0, 2.0 * half - 1.0)
    return thickness * np.float32(resolution)


def _largest_uphill(inside: np.ndarray, reach: int) -> np.ndarray:
    """Largest value that a climb from cell to higher neighbour reaches within that many steps.

    A climb stays inside its wall, where a plain maximum over a window would take the neighbouring wall's.
    """
    height = inside
    for _ in range(reach):
        height = np.where(inside > 0.0, ndimage.maximum_filter(height, size=3), 0.0)
    return height
