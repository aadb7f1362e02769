"""The cells of the map in which the robot may be at the start. H rows, W columns."""

from __future__ import annotations

import numpy as np

from glass_nav.geometry import polygons
from glass_nav.world.grid_map import GridMap

_REACH = 3.5  # deviations of a vaguely given point


def within(grid_map: GridMap, corners_m: np.ndarray) -> np.ndarray:
    """(H, W) bool: cells with their centres in a polygon (N, 2) in map.

    Raises:
        ValueError: it has fewer than 3 corners, or one that is not finite.
    """
    corners_m = np.asarray(corners_m, float)
    if corners_m.ndim != 2 or corners_m.shape[1] != 2 or len(corners_m) < 3 or not np.all(np.isfinite(corners_m)):
        raise ValueError(f"an area needs at least 3 corners of finite x, y, got {corners_m.tolist()}")
    return polygons.inside(corners_m, _centres(grid_map).reshape(-1, 2)).reshape(grid_map.occupancy.shape)


def around(grid_map: GridMap, point_m: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(H, W) bool: cells in reach of a point (2,) that is known with that covariance (2, 2)."""
    offset_m = _centres(grid_map) - point_m
    floor = np.eye(2) * grid_map.resolution_m**2
    return np.einsum("hwi,ij,hwj->hw", offset_m, np.linalg.inv(covariance + floor), offset_m) <= _REACH**2


def _centres(grid_map: GridMap) -> np.ndarray:
    """(H, W, 2) centres [m] of all cells, in map."""
    height, width = grid_map.occupancy.shape
    return grid_map.centres(*np.mgrid[:height, :width])
