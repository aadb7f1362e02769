"""The distance of every point of the map from the nearest wall, with its gradient.

The "likelihood field" of Thrun, Burgard, Fox, Probabilistic Robotics (2005), sec. 6.4, as a
distance with its gradient. Wherever a beam ends, near some wall is good: it asks neither which wall
nor what the beam passed, so glass hardly misleads it, and is no information to it.
"""

from __future__ import annotations

from typing import Any, Dict, Tuple

import numpy as np
from scipy import ndimage

from glass_nav import _distance_field
from glass_nav.world.grid_map import GridMap

_STRIP_ROWS = 256
_DEEPEST_M = 0.4  # a wall that a mapper blurred is rarely thicker


class DistanceField:
    """Distance to the centre of the nearest wall cell, cut at max_distance_m, bilinear between cells."""

    def __init__(self, grid_map: GridMap, max_distance_m: float = 2.0) -> None:
        """
        Args:
            grid_map: map without an occupied cell is allowed; all distances are max_distance_m then.
            max_distance_m: distances beyond it are this one; the gradient is 0 there.
        """
        self.compiled = _distance_field.DistanceField(
            _distances(grid_map, max_distance_m), grid_map.resolution_m, grid_map.map_from_grid, max_distance_m
        )

    def __deepcopy__(self, _memo: Dict[int, Any]) -> DistanceField:
        """Itself: it never changes."""
        return self

    def at(self, x_m: np.ndarray, y_m: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distance and its gradient at points of the frame map.

        Args:
            x_m, y_m: (...) coordinates; outside the grid the distance to the grid is added.

        Returns:
            distance [m] and its derivatives along x and y of the frame map, each (...).
        """
        return self.compiled.at(*np.broadcast_arrays(x_m, y_m))

    def distance(self, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """The distance of at() alone (...) [m]."""
        return self.compiled.distance(*np.broadcast_arrays(x_m, y_m))

    def log_weights(
        self, points_m: np.ndarray, poses: np.ndarray, sigma_m: float, z_hit: float, z_rand: float
    ) -> np.ndarray:
        """How well poses explain where beams ended, by their distances d from walls.

        Args:
            points_m: (B, 2) ends of beams [m] in the robot's frame, finite.
            poses: (K, 3) of the robot in map.
            sigma_m, z_hit, z_rand: of the density z_hit exp(-d^2 / (2 sigma^2)) + z_rand.

        Returns:
            (K,) sums of the log densities, from a table, in floats: within 2e-5 for each beam.
        """
        return _distance_field.log_weights(self.compiled, points_m, poses, sigma_m, z_hit, z_rand)


def _distances(grid_map: GridMap, max_distance_m: float) -> np.ndarray:
    """(H, W) float32 [m] at the centres of the cells; made in strips, since the transform takes 28 bytes a cell."""
    surface = _surface(grid_map)
    height = len(surface)
    reach = int(np.ceil(max_distance_m / grid_map.resolution_m))  # rows: what lies farther does not count
    distance = np.full(surface.shape, max_distance_m, np.float32)
    for first in range(0, height, _STRIP_ROWS):
        last, above = min(first + _STRIP_ROWS, height), max(0, first - reach)
        around = surface[above : last + reach]
        if around.any():
            cells = ndimage.distance_transform_edt(~around)[first - above : last - above]
            np.minimum(cells * grid_map.resolution_m, max_distance_m, out=distance[first:last], casting="same_kind")
    return distance


def _surface(grid_map: GridMap) -> np.ndarray:
    """(H, W) bool: occupied cells in which a beam may end, those not deep inside what is drawn solid."""
    reach = max(1, int(round(_DEEPEST_M / grid_map.resolution_m)))
    near_free = ndimage.distance_transform_cdt(~grid_map.free, metric="chessboard") <= reach
    surface = grid_map.occupied & near_free
    return surface if surface.any() else grid_map.occupied
