"""The map in the background of a picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from glass_nav.geometry import se2
from glass_nav.world.grid_map import GridMap

UNKNOWN_GREY, FREE_WHITE, WALL_BLACK = 0.88, 1.0, 0.15


def draw_map(axes: Any, grid: GridMap, low: np.ndarray, high: np.ndarray) -> None:
    """The part of a map between two corners (2,) [m], behind everything else."""
    from matplotlib.transforms import Affine2D

    corners = np.array([[x, y] for x in (low[0], high[0]) for y in (low[1], high[1])])
    cells = se2.transform_points(se2.inverse(grid.map_from_grid), corners) / grid.resolution_m
    rows, columns = grid.occupancy.shape
    left, bottom = np.maximum(np.floor(cells.min(axis=0)), 0).astype(int)
    right, top = np.minimum(np.ceil(cells.max(axis=0)), [columns, rows]).astype(int)
    axes.set_facecolor(str(UNKNOWN_GREY))
    if right <= left or top <= bottom:  # the robot never came near the map
        return
    part = grid.occupancy[bottom:top, left:right].astype(float)
    grey = np.where(part < 0, UNKNOWN_GREY, FREE_WHITE - (FREE_WHITE - WALL_BLACK) * part / 100.0)
    x, y, yaw = grid.map_from_grid
    place = Affine2D().rotate(yaw).translate(x, y) + axes.transData
    extent = np.array([left, right, bottom, top]) * grid.resolution_m
    axes.imshow(
        grey,
        cmap="gray",
        vmin=0.0,
        vmax=1.0,
        origin="lower",
        interpolation="nearest",
        extent=extent.tolist(),
        transform=place,
    )
