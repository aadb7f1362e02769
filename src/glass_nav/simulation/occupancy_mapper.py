"""Draws the map that an occupancy grid mapper makes of scans at known poses.

Every beam counts a pass in the cells that it crosses and a hit in the one where it ends; a cell is occupied if enough of
its beams ended there (the counting model of Haehnel, as in GMapping). Panes let most beams pass: they vanish, but for
specks where the robot faced them. Unlike a real mapper, this one knows its poses. B beams.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glass_nav.geometry import polyline
from glass_nav.simulation import building_map, lidar
from glass_nav.simulation.building import Building
from glass_nav.simulation.lidar import LidarModel
from glass_nav.world.grid_map import UNKNOWN, GridMap

OCCUPIED_SHARE = 0.25  # of the beams of a cell that end there, GMapping's occ_thresh
STEP_M = 0.5  # between scans, slam_toolbox's minimum_travel_distance
_SAMPLES_PER_CELL = 2  # along a beam


class OccupancyMapper:
    """Counts hits and passes in the cells of a grid."""

    def __init__(self, grid: GridMap) -> None:
        """Begins with nothing seen; only the place of the grid is used."""
        self._grid = grid
        self._hits = np.zeros(grid.occupancy.size, np.int64)
        self._beams = np.zeros(grid.occupancy.size, np.int64)

    def add(self, map_from_laser: np.ndarray, angles_rad: np.ndarray, ranges_m: np.ndarray) -> None:
        """Count the beams of one scan.

        Args:
            map_from_laser: (3,) true pose.
            angles_rad: (B,) directions in the frame of the laser.
            ranges_m: (B,) REP 117; beams without a range count nowhere.
        """
        answered = np.isfinite(ranges_m)
        range_m, beam_rad = ranges_m[answered], map_from_laser[2] + angles_rad[answered]
        if not len(range_m):
            return
        ray = np.stack([np.cos(beam_rad), np.sin(beam_rad)], axis=-1)
        end = self._cells(map_from_laser[:2] + range_m[:, None] * ray)
        step_m = self._grid.resolution_m / _SAMPLES_PER_CELL
        along_m = step_m * np.arange(int(range_m.max() / step_m) + 1)
        passed = self._cells(map_from_laser[:2] + along_m[:, None] * ray[:, None])  # (B, samples)
        once = np.diff(passed, axis=1, prepend=-2) != 0
        counted = once & (along_m < range_m[:, None]) & (passed >= 0) & (passed != end[:, None])
        end = end[end >= 0]
        self._hits += np.bincount(end, minlength=len(self._hits))
        self._beams += np.bincount(np.append(passed[counted], end), minlength=len(self._beams))

    def grid_map(self) -> GridMap:
        """The map so far: occupied, free, and unknown where no beam came."""
        seen = self._beams > 0
        occupied = seen & (self._hits >= OCCUPIED_SHARE * self._beams)
        occupancy = np.where(occupied, 100, np.where(seen, 0, UNKNOWN)).astype(np.int8)
        return replace(self._grid, occupancy=occupancy.reshape(self._grid.occupancy.shape))

    def _cells(self, points_m: np.ndarray) -> np.ndarray:
        """(...) flat cells of points (..., 2), -1 outside the grid."""
        row, column = self._grid.cells(points_m)
        return np.where(self._grid.contains(row, column), row * self._grid.occupancy.shape[1] + column, -1)


def draw(
    building: Building, model: LidarModel, path_m: np.ndarray, resolution_m: float, rng: np.random.Generator
) -> GridMap:
    """The map of a mapping drive along a path, there and back, before anything changed and without people.

    Args:
        building: with what has changed since.
        model: the lidar of the mapping robot.
        path_m: (W, 2) waypoints.
        resolution_m: edge length of a cell; the grid is that of building_map.draw().
        rng: of the lidar's noise.
    """
    as_mapped = building.as_mapped()
    mapper = OccupancyMapper(building_map.draw(building, resolution_m))
    for one_way_m in (path_m, path_m[::-1]):
        for pose in _poses(polyline.distinct(one_way_m)):
            mapper.add(pose, model.angles_rad, lidar.scan(model, as_mapped, pose, 0.0, rng).ranges_m)
    return mapper.grid_map()


def _poses(path_m: np.ndarray) -> np.ndarray:
    """(N, 3) poses along waypoints (W, 2), on each leg from its start to its end."""
    poses = []
    for start, way in zip(path_m[:-1], np.diff(path_m, axis=0)):
        shares = np.linspace(0.0, 1.0, int(np.ceil(np.hypot(*way) / STEP_M)) + 1)
        yaw = np.full(len(shares), np.arctan2(way[1], way[0]))
        poses.append(np.column_stack([start + shares[:, None] * way, yaw]))
    return np.concatenate(poses)
