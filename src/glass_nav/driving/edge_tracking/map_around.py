"""The grid from which the local graph is made: coarser in halls too wide for the window.

A window that ends before the walls of a hall shows edges between its own border and a wall, which move with the
robot, so it would follow them for ever. A coarser map has as many cells, takes over what the fine one contains, and
is dropped as soon as the fine one is large enough again.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from glass_nav.driving.edge_tracking.local_map import LocalMap, LocalMapParams
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

_COARSER = 2
_COARSEST = 4  # times the cells of the fine map: halls of 40 m


class MapAround:
    """add() every scan; poses are local_from_base, see local_pose.py."""

    def __init__(self, p: LocalMapParams) -> None:
        self._fine = LocalMap(p)
        self._wide: Optional[LocalMap] = None  # while the robot is in a hall that needs it

    def clear(self) -> None:
        """Forget everything."""
        self._fine.clear()
        self._wide = None

    def add(self, scan: Scan, local_from_base: np.ndarray) -> None:
        """Take in a scan."""
        self._fine.add(scan, local_from_base)
        if self._wide is not None:
            self._wide.add(scan, local_from_base)

    def walls(self) -> GridMap:
        """The walls at the finest resolution known; everything else is free."""
        walls = self._fine.walls()
        return walls if self._wide is None or walls.occupied.any() else self._wide.walls()

    @property
    def coarse_m(self) -> float:
        """How much larger the cells of the last grid are than those of the fine map."""
        fine_m = self._fine.params.resolution_m
        return 0.0 if self._wide is None else self._wide.params.resolution_m - fine_m

    def fit(self, point_m: np.ndarray) -> None:
        """Map as much from now on as the room around a point (2,) needs: early, so that scans have filled it."""
        if self._fine.shows_room(point_m):
            self._wide = None
            return
        coarsest_m = _COARSEST * self._fine.params.resolution_m - 1e-9
        if self._wide is None:
            self._wide = self._fine.coarser(_COARSER)
        elif not self._wide.shows_room(point_m) and self._wide.params.resolution_m < coarsest_m:
            self._wide = self._wide.coarser(_COARSER)

    def grid_around(self, point_m: np.ndarray) -> GridMap:
        """A square around a point (2,) that shows the ways out of the room it is in."""
        self.fit(point_m)
        return (self._wide or self._fine).grid_around(point_m)
