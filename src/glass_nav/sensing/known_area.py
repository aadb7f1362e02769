"""The area that the map knows. Beams that end elsewhere are no evidence about a pose.

A mapper draws what it saw. Behind a pane, through an open door of a room that it did not enter and beyond the edge of
the grid there may be anything: a beam that ends there agrees with every pose. Near a mapped wall it does not: a beam
that ends somewhat behind a wall contradicts it. H rows, W columns, P poses, B beams.
"""

from __future__ import annotations

from typing import Any, Dict

import numpy as np
from scipy import ndimage

from glass_nav import _distance_field
from glass_nav.geometry import se2
from glass_nav.world.grid_map import UNKNOWN, GridMap

_BESIDE_CELLS = 3  # next to an unknown cell: what is there may be drawn, or end, one or two cells off
_KNOWN, _UNMAPPED, _FREE, _BESIDE = np.uint8(1), np.uint8(2), np.uint8(4), np.uint8(8)  # flags of a cell, as compiled
_NEAR_WALL_M = 0.5  # what is this close to a mapped wall is compared with it, also behind it


class KnownArea:
    """The part of one map that beams can be compared with."""

    def __init__(self, grid_map: GridMap) -> None:
        self.resolution_m = grid_map.resolution_m
        near = int(round(_NEAR_WALL_M / grid_map.resolution_m))
        border = near + 1  # cells around the grid
        unknown = np.pad(grid_map.occupancy == UNKNOWN, border, constant_values=True)
        beside = _grown(unknown, _BESIDE_CELLS)
        known = ~beside | _grown(np.pad(grid_map.occupied, border), near)
        flags = _KNOWN * known + _UNMAPPED * unknown + _FREE * np.pad(grid_map.free, border) + _BESIDE * beside
        self.compiled = _distance_field.KnownArea(flags, border, grid_map.resolution_m, grid_map.map_from_grid)

    def contains(self, points_m: np.ndarray) -> np.ndarray:
        """Whether the map knows something of places.

        Args:
            points_m: (..., 2) x, y [m] in map.

        Returns:
            (...) bool; False in unknown cells, outside of the grid, and within 3 cells of either, unless a wall is
            within half a metre.
        """
        return self._has(_KNOWN, points_m)

    def is_unmapped(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: the mapper did not see points (..., 2) [m]: unknown cells, and all outside of the grid."""
        return self._has(_UNMAPPED, points_m)

    def is_beside_unmapped(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: points (..., 2) [m] are within 3 cells of what the mapper did not see."""
        return self._has(_BESIDE, points_m)

    def is_free(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: by the map a robot may stand at points (..., 2) [m]."""
        return self._has(_FREE, points_m)

    def ends(self, points_m: np.ndarray, map_from_base: np.ndarray) -> np.ndarray:
        """Which beams of a scan end where the map knows something, seen from each pose.

        Args:
            points_m: (B, 2) ends of beams [m] in the robot's frame, finite.
            map_from_base: (P, 3) poses of the robot.

        Returns:
            (P, B) bool.
        """
        return self.contains(se2.transform_points(np.asarray(map_from_base, float)[:, None], points_m))

    def __deepcopy__(self, _memo: Dict[int, Any]) -> KnownArea:
        """Itself: it never changes."""
        return self

    def _has(self, flag: np.uint8, points_m: np.ndarray) -> np.ndarray:
        return self.compiled.has(flag, points_m)


def _grown(cells: np.ndarray, reach: int) -> np.ndarray:
    """(H, W) bool: within `reach` rows and columns of a set cell."""
    return ndimage.maximum_filter(cells.view(np.uint8), 2 * reach + 1).view(bool)
