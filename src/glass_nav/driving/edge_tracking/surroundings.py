"""The map and the Voronoi graph around the robot, its pose in them, and the obstacles nearby.

Everything is in the frame local: odom without its drift, see local_pose.py.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Optional

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from glass_nav.driving.edge_tracking import local_graph
from glass_nav.driving.edge_tracking.local_graph import LocalGraph
from glass_nav.driving.edge_tracking.local_map import LocalMapParams
from glass_nav.driving.edge_tracking.local_pose import LocalPose
from glass_nav.driving.edge_tracking.map_around import MapAround
from glass_nav.geometry import se2
from glass_nav.sensing.scan import Scan
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams
from glass_nav.world.grid_map import GridMap

_GRAPH_PERIOD_NS = 300_000_000  # between two graphs
_SEEN_M = 0.12  # a wall of the map beside a point of the scan is the same
_NEAR_M = 2.0  # obstacles further away are not braked for


class Surroundings:
    """Take in every scan by see(); renew the graph, or only the walls, whenever is_due."""

    def __init__(self, map_params: LocalMapParams, graph_params: VoronoiParams) -> None:
        self._map, self._at = MapAround(map_params), LocalPose()
        self._graph_params = local_graph.params_beside(graph_params)
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._map.clear()
        self._at.clear()
        self.grid: Optional[GridMap] = None  # the last map; None before the first
        self.graph: Optional[LocalGraph] = None  # of that map
        self.scans = 0  # so many were seen
        self.scan: Optional[Scan] = None  # the last one
        self.pose = np.zeros(3)  # at that scan
        self.stamp_ns = 0
        self._renewed_ns = 0
        self._points_m = np.zeros((0, 2))  # of the last scan
        self._walls_m = np.zeros((0, 2))  # of the map near the robot

    def see(self, scan: Scan, odom_from_base: np.ndarray) -> None:
        """Take in a scan, with odometry's pose (3,) at its stamp."""
        self.pose, self.stamp_ns = self._at.correct(scan, odom_from_base), scan.stamp_ns
        self._map.add(scan, self.pose)
        self.scans += 1
        self.scan = scan
        self._points_m = _steady_points(scan, self.pose)

    @property
    def coarse_m(self) -> float:
        """How much larger than usual the cells of the last graph's map were."""
        return self._map.coarse_m

    @property
    def is_due(self) -> bool:
        """Whether the next graph is."""
        return self.stamp_ns - self._renewed_ns >= _GRAPH_PERIOD_NS

    def renew_graph(self) -> LocalGraph:
        """The graph as it is seen now."""
        self.grid = self._map.grid_around(self.pose[:2])
        self.graph = LocalGraph(self.grid, self._graph_params)
        self._renewed_ns = self.stamp_ns
        self._at.know(self._map.walls())
        self._note_walls(self.grid)
        return self.graph

    def renew_walls(self) -> None:
        """Updates only the walls, when no graph is needed."""
        self._renewed_ns = self.stamp_ns
        self._map.fit(self.pose[:2])
        walls = self._map.walls()
        self._at.know(walls)
        self._note_walls(walls)

    def _note_walls(self, grid: GridMap) -> None:
        reach = int(_NEAR_M / grid.resolution_m)
        row, column = (int(index) for index in grid.cells(self.pose[:2]))
        top, left = max(row - reach, 0), max(column - reach, 0)
        rows, columns = np.nonzero(grid.occupied[top : row + reach, left : column + reach])
        self._walls_m = grid.centres(rows + top, columns + left)

    def local_from_base(self, odom_from_base: np.ndarray) -> np.ndarray:
        """(3,) pose of the robot where odometry has it at that pose (3,)."""
        return self._at.now(odom_from_base)

    def obstacles_m(self, pose: np.ndarray) -> np.ndarray:
        """(K, 2) what stands near the robot at a pose (3,), in its frame: the last scan, the walls of the map."""
        points = _near(self._points_m, pose)
        return se2.transform_points(se2.inverse(pose), np.concatenate([points, self.unseen_walls_m(pose)]))

    def unseen_walls_m(self, pose: np.ndarray) -> np.ndarray:
        """(K, 2) walls of the map near a pose (3,) that the last scan does not show: it shows better where the others are."""
        walls = _near(self._walls_m, pose)
        if not len(self._points_m) or not len(walls):
            return walls
        return walls[cKDTree(self._points_m).query(walls, distance_upper_bound=_SEEN_M)[0] > _SEEN_M]


def _near(points_m: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """(K, 2) the points (N, 2) that are near a pose (3,), by the larger of their distances along the axes."""
    off_m = np.abs(points_m - pose[:2])
    return points_m[np.maximum(off_m[:, 0], off_m[:, 1]) < _NEAR_M]


def _steady_points(scan: Scan, local_from_base: np.ndarray) -> np.ndarray:
    """(K, 2) end points of the beams, without isolated ones."""
    ranges_m = np.where(scan.answered, scan.ranges_m, np.inf)
    points = replace(scan, ranges_m=ndimage.median_filter(ranges_m, 3, mode="nearest")).points_in_base()
    return se2.transform_points(local_from_base, points[np.isfinite(points).all(axis=1)])
