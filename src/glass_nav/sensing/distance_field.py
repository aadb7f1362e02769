"""GridMap -> how far is the nearest wall, everywhere: smooth enough to slide a scan along.

The "likelihood field" of Thrun, Burgard, Fox, Probabilistic Robotics (2005), sec. 6.4, as a
distance with its gradient. Wherever a beam ends, near some wall is good: it asks neither which wall
nor what the beam passed, so glass hardly misleads it, and is no information to it.
"""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np
from scipy import ndimage

from glass_nav.world.grid_map import GridMap

_DEEPEST_M = 0.4  # a wall that a mapper blurred is rarely thicker


class DistanceField:
    """Distance to the centre of the nearest wall cell, cut at max_distance_m, bilinear between cells."""

    def __init__(self, grid_map: GridMap, max_distance_m: float = 2.0) -> None:
        """
        Args:
            grid_map: map without an occupied cell is allowed; all distances are max_distance_m then.
            max_distance_m: distances beyond it are this one; the gradient is 0 there.
        """
        occupied = grid_map.occupied
        if occupied.any():
            cells = ndimage.distance_transform_edt(~_surface(grid_map))
            distance = np.minimum(cells * grid_map.resolution_m, max_distance_m)
        else:
            distance = np.full(occupied.shape, max_distance_m)
        # One cell of border, so that every point inside has its four neighbours.
        self._distance = np.pad(distance.astype(np.float32), 1, mode="edge").ravel()
        self._stride = occupied.shape[1] + 2
        self._last = np.array([occupied.shape[1], occupied.shape[0]], float)
        self._resolution_m, self._most_m = grid_map.resolution_m, max_distance_m
        x, y, yaw = grid_map.map_from_grid
        self._origin, self._cos, self._sin = (x, y), np.cos(yaw), np.sin(yaw)

    def at(self, x_m: np.ndarray, y_m: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distance and its gradient at points of the frame map.

        Args:
            x_m, y_m: (...) coordinates; outside the grid the distance to the grid is added.

        Returns:
            distance [m] and its derivatives along x and y of the frame map, each (...).
        """
        at, right_share, up_share, outside_m = self._between(x_m, y_m)
        d00, d01 = self._distance[at], self._distance[at + 1]
        d10, d11 = self._distance[at + self._stride], self._distance[at + self._stride + 1]
        lower, upper = d00 + (d01 - d00) * right_share, d10 + (d11 - d10) * right_share
        along_column = ((d01 - d00) * (1.0 - up_share) + (d11 - d10) * up_share) / self._resolution_m
        along_row = (upper - lower) / self._resolution_m
        distance = lower + (upper - lower) * up_share
        return (
            distance if outside_m is None else np.minimum(distance + outside_m, self._most_m),
            self._cos * along_column - self._sin * along_row,
            self._sin * along_column + self._cos * along_row,
        )

    def distance(self, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """The distance of at() alone (...) [m]."""
        at, right_share, up_share, outside_m = self._between(x_m, y_m)
        lower = self._distance[at]
        lower += (self._distance[at + 1] - lower) * right_share
        at += self._stride
        upper = self._distance[at]
        upper += (self._distance[at + 1] - upper) * right_share
        upper -= lower
        upper *= up_share
        lower += upper
        if outside_m is not None:
            lower = np.minimum(lower + outside_m, self._most_m)
        return lower

    def _between(
        self, x_m: np.ndarray, y_m: np.ndarray
    ) -> Tuple[np.ndarray, np.ndarray, np.ndarray, Optional[np.ndarray]]:
        """Of the four cells around points (...): flat index of the first, and shares of the next column and row; and
        how far outside of the grid the points are, None if none is.
        """
        dx, dy = x_m - self._origin[0], y_m - self._origin[1]
        column = (self._cos * dx + self._sin * dy) / self._resolution_m + 0.5  # of the padded grid
        row = (self._cos * dy - self._sin * dx) / self._resolution_m + 0.5
        inside = np.clip(column, 0.0, self._last[0] + 0.999), np.clip(row, 0.0, self._last[1] + 0.999)
        outside_m = None
        if (inside[0] != column).any() or (inside[1] != row).any():
            outside_m = np.hypot(column - inside[0], row - inside[1]) * self._resolution_m
        column, row = inside
        left, below = column.astype(np.int32), row.astype(np.int32)
        return below * self._stride + left, column - left, row - below, outside_m


def _surface(grid_map: GridMap) -> np.ndarray:
    """(H, W) bool: occupied cells in which a beam may end, those not deep inside what is drawn solid."""
    reach = max(1, int(round(_DEEPEST_M / grid_map.resolution_m)))
    near_free = ndimage.distance_transform_cdt(~grid_map.free, metric="chessboard") <= reach
    surface = grid_map.occupied & near_free
    return surface if surface.any() else grid_map.occupied
