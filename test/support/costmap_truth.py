"""A costmap beside the building that it shows: is the glass in it, and what is in it that is not there?

C cells, N points.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from glass_nav.geometry import se2
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.simulation import building_map, people
from glass_nav.simulation.building import Building

NEAR_M, FAR_M = 1.5, 2.4  # from the robot; costmap_2d marks up to obstacle_range, 2.5 m
MARKED_M = 0.1  # a point of a pane is marked if an occupied cell is so near
PHANTOM_M = 0.2  # an occupied cell so far from every surface shows nothing that is there
SEEN_SLACK_M = 0.15
STEP_M = 0.05
WALKED_S = np.linspace(0.0, 10.0, 51)  # what people left behind the robot was not seen since


class Score(NamedTuple):
    """One costmap: points of panes that were in view, those of them that are marked, and cells where nothing is."""

    near: int
    near_marked: int
    far: int
    far_marked: int
    phantoms: np.ndarray  # (P, 2) centres in the map of cells where nothing is
    outdated: np.ndarray  # (P,) bool: but the map shows something there, which is gone
    drifted: np.ndarray  # (P,) bool: it was right when it was marked; odometry has drifted since


class CostmapTruth:
    """Remembers which glass the lidar had in view."""

    def __init__(self, building: Building, half_view_rad: float) -> None:
        """
        Args:
            building: as it is now.
            half_view_rad: of the lidar, to either side.
        """
        things = tuple(replace(thing, mapped=True) for thing in building.things if thing.present)
        doors = tuple(replace(door, mapped=door.now) for door in building.doors)
        now = building_map.draw(replace(building, things=things, doors=doors))
        self._people = building.people
        self._map, self._rays, self._distance = now, RayCaster(now), DistanceField(now)
        self._drawn = DistanceField(building_map.draw(building))
        self._rooms, _ = ndimage.label(now.occupancy == 0)
        self._glass_m = np.concatenate(
            [
                np.linspace(*pane.line_m, max(2, round(np.hypot(*np.diff(pane.line_m, axis=0)[0]) / STEP_M)))
                for pane in building.panes
            ]
            or [np.zeros((0, 2))]
        )
        self._in_view = np.zeros(len(self._glass_m), bool)
        self._half_view_rad = half_view_rad

    def look(self, map_from_laser: np.ndarray) -> None:
        """The lidar at this pose (3,) has taken a scan."""
        away = self._glass_m - map_from_laser[:2]
        range_m = np.hypot(*away.T)
        bearing = np.arctan2(away[:, 1], away[:, 0]) - map_from_laser[2]
        bearing = (bearing + np.pi) % (2.0 * np.pi) - np.pi
        asked = np.flatnonzero((range_m < FAR_M) & (np.abs(bearing) < self._half_view_rad) & ~self._in_view)
        if len(asked):
            free_m = self._rays.cast_first(map_from_laser[None], bearing[asked], FAR_M + 1.0).range_m[0]
            self._in_view[asked] = free_m > range_m[asked] - SEEN_SLACK_M

    def score(
        self,
        occupied_m: np.ndarray,
        map_from_robot: np.ndarray,
        time_s: float,
        then_from_now: np.ndarray = np.zeros((0, 3)),
    ) -> Score:
        """
        Args:
            occupied_m: (C, 2) centres of the costmap's lethal cells, in the map, by the true pose.
            map_from_robot: (3,) the true pose.
            time_s: since the start of the simulation; people are where they are at that time.
            then_from_now: (D, 3) for a costmap that moves with the odometry: where its cells were in the map some time ago,
                from where they are.
        """
        range_m = np.hypot(*(self._glass_m - map_from_robot[:2]).T)
        near = self._in_view & (range_m < NEAR_M)
        far = self._in_view & (range_m >= NEAR_M) & (range_m < FAR_M - SEEN_SLACK_M)
        phantoms = self._phantoms(self._without_people(occupied_m, time_s), map_from_robot)
        return Score(
            int(near.sum()),
            int(self._marked(self._glass_m[near], occupied_m).sum()),
            int(far.sum()),
            int(self._marked(self._glass_m[far], occupied_m).sum()),
            phantoms,
            self._drawn.distance(*phantoms.T) <= PHANTOM_M,
            self._drifted(phantoms, then_from_now),
        )

    def _drifted(self, phantoms_m: np.ndarray, then_from_now: np.ndarray) -> np.ndarray:
        """(P,) bool."""
        found = np.zeros(len(phantoms_m), bool)
        for earlier in then_from_now:
            found |= self._distance.distance(*se2.transform_points(earlier, phantoms_m).T) <= PHANTOM_M
        return found

    def _phantoms(self, occupied_m: np.ndarray, map_from_robot: np.ndarray) -> np.ndarray:
        """Those on the floor that the robot can reach."""
        rows, columns = self._map.cells(occupied_m)
        inside = (rows >= 0) & (columns >= 0) & (rows < self._rooms.shape[0]) & (columns < self._rooms.shape[1])
        room = np.zeros(len(occupied_m), int)
        room[inside] = self._rooms[rows[inside], columns[inside]]
        here = self._rooms[self._map.cells(map_from_robot[None, :2])][0]
        return occupied_m[(room == here) & (room > 0) & (self._distance.distance(*occupied_m.T) > PHANTOM_M)]

    def _without_people(self, occupied_m: np.ndarray, time_s: float) -> np.ndarray:
        """(C, 2) those that no person explains."""
        for person in self._people:
            walked_m = np.array([people.position(person, time_s - ago_s) for ago_s in WALKED_S])
            apart = occupied_m[:, None] - walked_m
            occupied_m = occupied_m[(np.hypot(*np.moveaxis(apart, -1, 0)) > person.radius_m + PHANTOM_M).all(axis=1)]
        return occupied_m

    @staticmethod
    def _marked(points_m: np.ndarray, occupied_m: np.ndarray) -> np.ndarray:
        """(N,) bool."""
        if not len(points_m) or not len(occupied_m):
            return np.zeros(len(points_m), bool)
        apart = points_m[:, None] - occupied_m
        return np.hypot(apart[..., 0], apart[..., 1]).min(axis=1) < MARKED_M


def occupied_cells(cells: np.ndarray, resolution_m: float, map_from_grid: np.ndarray, lethal: int = 100) -> np.ndarray:
    """(C, 2) centres in the map of the lethal cells (H, W) of an occupancy grid."""
    rows, columns = np.nonzero(cells >= lethal)
    return se2.transform_points(map_from_grid, (np.stack([columns, rows], axis=1) + 0.5) * resolution_m)
