"""Finds the returns that the map does not explain.

A beam that ended in front of the first mapped surface met something that the map lacks. Specks of occupied cells are no
surfaces here: a mapper that erases what beams pass leaves specks of a pane, where beams met it near its normal.
H rows, W columns of the map, B beams.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from glass_nav.sensing.raycast import RayCaster
from glass_nav.world.grid_map import GridMap

_ALL_AROUND = np.ones((3, 3), bool)
# Flags of a cell: see is_surface() and the others. That of a surface is a percentage of occupancy too, above that of a wall
# whatever else is set, so that the flags are the map on which rays are cast.
_SURFACE, _NEAR, _SPECK = np.int8(96), np.int8(1), np.int8(2)


class MappedSurfaces:
    """The surfaces of a map that are more than specks."""

    def __init__(self, grid_map: GridMap, speck_m: float, near_m: float) -> None:
        """
        Args:
            grid_map: any.
            speck_m: a group of occupied cells with a smaller extent is no surface.
            near_m: what lies nearer to a surface than this belongs to it.
        """
        self._grid_map = grid_map
        solid = _without_specks(grid_map, speck_m)
        reach = max(1, int(np.ceil(near_m / grid_map.resolution_m)))
        self._flags = _SURFACE * solid
        self._flags += _NEAR * ndimage.maximum_filter(solid, size=2 * reach + 1)
        self._flags += _SPECK * ndimage.binary_dilation(grid_map.occupied, _ALL_AROUND)
        self._caster = RayCaster(replace(grid_map, occupancy=self._flags))

    @property
    def resolution_m(self) -> float:
        return self._grid_map.resolution_m

    def first_m(self, map_from_laser: np.ndarray, angles_rad: np.ndarray, max_range_m: float) -> np.ndarray:
        """(B,) ranges to the first surface from a laser (3,); inf: none."""
        return self._caster.cast(map_from_laser[None], angles_rad, max_range_m)[0]

    def is_near(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: points (..., 2) belong to a surface."""
        return self._has(_NEAR, points_m)

    def is_speck(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: points (..., 2) lie in an occupied cell or beside one."""
        return self._has(_SPECK, points_m)

    def is_surface(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: points (..., 2) lie in a cell of a surface."""
        return self._has(_SURFACE, points_m)

    def _has(self, flag: np.int8, points_m: np.ndarray) -> np.ndarray:
        rows, columns = self._grid_map.cells(points_m)
        inside = self._grid_map.contains(rows, columns)
        flags = self._flags[np.where(inside, rows, 0), np.where(inside, columns, 0)]
        return inside & (flags & flag).astype(bool)


def _without_specks(grid_map: GridMap, speck_m: float) -> np.ndarray:
    """(H, W) bool: occupied, in a group whose longer side is at least speck_m."""
    groups, count = ndimage.label(grid_map.occupied, _ALL_AROUND)
    large = np.zeros(count + 1, bool)
    for number, window in enumerate(ndimage.find_objects(groups), start=1):
        large[number] = max(side.stop - side.start for side in window) * grid_map.resolution_m >= speck_m
    solid: np.ndarray = large[groups]
    return solid
