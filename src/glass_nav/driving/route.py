"""The shortest path along the edges of the atlas from a pose to a goal.

Robot and goal may be off the graph: the path begins at the nearest point of the nearest edge that can be reached in a
straight line, and ends likewise. Dijkstra's shortest path, by scipy. N nodes, E edges, darts as in atlas.py; M points
of the path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Collection, List, Optional, Tuple

import numpy as np

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.geometry import polyline
from glass_nav.geometry.polyline import Polyline
from glass_nav.topology.atlas.atlas import DEAD_END, Atlas
from glass_nav.world.grid_map import GridMap

STEP_M = 0.02  # of the points that are looked at along a straight line
JOINED_M = 0.02  # points of a path nearer to each other are one


class RouteError(ValueError):
    """There is no path; one line says from where, to where, and why."""


@dataclass(frozen=True)
class Route:
    """A path along edges of the atlas."""

    darts: Tuple[int, ...]  # in the order in which they are driven, the first and the last perhaps in part
    polyline_m: np.ndarray  # (M, 2) in the frame map, from the robot to the goal; M is 1 if it stands there

    @property
    def length_m(self) -> float:
        return float(np.linalg.norm(np.diff(self.polyline_m, axis=0), axis=1).sum())


@dataclass(frozen=True)
class _Joint:
    """The point where a position is connected to the graph."""

    edge: int
    way_m: float  # along the edge, as dart 2e runs
    off_m: float  # from the place


class RoutePlanner:
    """Plans routes in one atlas, with its map if there is one."""

    def __init__(self, atlas: Atlas, limits: BaseLimits, grid_map: Optional[GridMap] = None) -> None:
        self.atlas = atlas
        self._limits = limits
        self._lines = [_edge_line(atlas, edge) for edge in range(len(atlas.edges))]
        self._ends = atlas.darts.node.reshape(-1, 2)  # (E, 2)
        self._grid_map = grid_map
        self._room_m = None if grid_map is None else _room(grid_map)

    def to_node(self, from_m: np.ndarray, node: int, avoided: Collection[int] = ()) -> Route:
        """The path from a point (2,) of the map to a node, without the edges that are to be avoided.

        Raises:
            RouteError: no such node, no edge in reach, or no way.
        """
        if not 0 <= node < len(self.atlas.nodes):
            raise RouteError(f"node {node}: the atlas {self.atlas.name} has nodes 0 to {len(self.atlas.nodes) - 1}")
        start = self._joint(from_m, "the robot", avoided)
        darts, points = self._way(start, None, node, avoided)
        return self._route(from_m, darts, points, None, f"node {node}")

    def to_point(self, from_m: np.ndarray, goal_m: np.ndarray, avoided: Collection[int] = ()) -> Route:
        """The path from a point (2,) of the map to another one; straight, if that is free and no farther than round.

        Raises:
            RouteError: no edge in reach of either, or no way.
        """
        straight = np.array([from_m, goal_m], float)
        if self._room_m is not None and self._is_open(straight[0], straight[1]):
            return Route((), _joined(straight))
        start, end = self._joint(from_m, "the robot", avoided), self._joint(goal_m, "the goal", avoided)
        darts, points = self._way(start, end, -1, avoided)
        return self._route(from_m, darts, points, goal_m, f"x {goal_m[0]:.2f} m, y {goal_m[1]:.2f} m")

    def nearest_edge(self, point_m: np.ndarray, darts: Collection[int]) -> Optional[int]:
        """The edge, among those of the darts, that is nearest to a point (2,); None without darts."""

        def away_m(edge: int) -> float:
            line = self._lines[edge]
            return float(np.hypot(*(line.at(line.nearest(point_m)) - point_m)))

        edges = {dart >> 1 for dart in darts}
        return min(edges, key=away_m) if edges else None

    # -- the graph

    def _route(
        self,
        from_m: np.ndarray,
        darts: "Optional[List[int]]",
        points: "List[np.ndarray]",
        goal_m: Optional[np.ndarray],
        where: str,
    ) -> Route:
        if darts is None:
            raise RouteError(f"no way along edges from x {from_m[0]:.2f} m, y {from_m[1]:.2f} m to {where}")
        ends = [] if goal_m is None else [np.asarray(goal_m, float)[None]]
        whole_m = _joined(np.concatenate([np.asarray(from_m, float)[None], *points, *ends]))
        return Route(tuple(darts), self._without_narrow_end(whole_m))

    def _way(
        self, start: _Joint, end: Optional[_Joint], node: int, avoided: Collection[int]
    ) -> "Tuple[Optional[List[int]], List[np.ndarray]]":
        """Darts and points from a joint to another joint or to a node; None if they are not connected."""
        from scipy.sparse import csgraph, csr_matrix  # slow to import

        count = len(self.atlas.nodes)
        rows: List[Tuple[float, int, int, int, float, float]] = []  # length, from, to, edge, way from, way to
        for edge, line in enumerate(self._lines):
            if self._is_passable(edge, avoided):
                rows.append((line.length, int(self._ends[edge, 0]), int(self._ends[edge, 1]), edge, 0.0, line.length))
        begin, goal = count, node if end is None else count + 1
        rows += self._spokes(start, begin)
        if end is not None:
            rows += self._spokes(end, goal)
            if start.edge == end.edge:
                rows.append((abs(start.way_m - end.way_m), begin, goal, start.edge, start.way_m, end.way_m))
        rows.sort(key=lambda row: -row[0])
        best = {}  # the shortest of parallel ones: scipy would add them up
        for length_m, first, last, edge, way_m, end_m in rows:
            best[first, last] = length_m, edge, way_m, end_m
            best[last, first] = length_m, edge, end_m, way_m
        pairs = np.array(list(best), int)
        weights = np.maximum([length_m for length_m, *_ in best.values()], 1e-9)  # a 0 would be no link
        graph = csr_matrix((weights, (pairs[:, 0], pairs[:, 1])), shape=(count + 2,) * 2)
        away_m, before = csgraph.dijkstra(graph, indices=begin, return_predecessors=True)
        if not math.isfinite(away_m[goal]):
            return None, []
        darts: List[int] = []
        points: List[np.ndarray] = []
        at = goal
        while at != begin:
            _, edge, way_m, end_m = best[int(before[at]), at]
            if way_m != end_m:
                darts.append(2 * edge + (end_m < way_m))
            points.append(self._lines[edge].part(way_m, end_m))
            at = int(before[at])
        return darts[::-1], points[::-1]

    def _spokes(self, joint: _Joint, number: int) -> "List[Tuple[float, int, int, int, float, float]]":
        """Connections from a joint to both ends of its edge."""
        length_m = self._lines[joint.edge].length
        first, last = self._ends[joint.edge].tolist()
        return [
            (joint.way_m, number, first, joint.edge, joint.way_m, 0.0),
            (length_m - joint.way_m, number, last, joint.edge, joint.way_m, length_m),
        ]

    def _is_passable(self, edge: int, avoided: Collection[int]) -> bool:
        """Whether the edge is wide enough; clearance 0 means unknown. An edge into a dead end counts as passable."""
        if edge in avoided:
            return False
        clearance_m = float(self.atlas.edges.clearance_m[edge])
        return (
            clearance_m == 0.0
            or clearance_m >= self._limits.robot_radius_m
            or bool((self.atlas.nodes.kind[self._ends[edge]] == DEAD_END).any())
        )

    # -- beside the graph

    def _joint(self, point_m: np.ndarray, who: str, avoided: Collection[int]) -> _Joint:
        point = np.asarray(point_m, float)
        joints = []
        for edge, line in enumerate(self._lines):
            if self._is_passable(edge, avoided):
                way_m = line.nearest(point)
                joints.append(_Joint(edge, way_m, float(np.hypot(*(line.at(way_m) - point)))))
        for joint in sorted(joints, key=lambda each: each.off_m):
            if self._is_open(point, self._lines[joint.edge].at(joint.way_m)):
                return joint
        raise RouteError(
            f"{who} at x {point[0]:.2f} m, y {point[1]:.2f} m reaches no edge of the atlas "
            f"{self.atlas.name} in a straight line"
        )

    def _without_narrow_end(self, points_m: np.ndarray) -> np.ndarray:
        """(n, 2) the path (M, 2) up to the last point at which the robot fits."""
        if self._room_m is None or len(points_m) < 2:
            return points_m
        line = Polyline(points_m)
        way_m, needed_m = line.length, self._limits.robot_radius_m + self._limits.margin_m
        while way_m > 0.0 and self._room_at(line.at(way_m)[None])[0] < needed_m:
            way_m -= STEP_M
        return _joined(line.part(0.0, way_m)) if way_m > 0.0 else points_m[:1]

    def _room_at(self, points_m: np.ndarray) -> np.ndarray:
        """(n,) [m] from points (n, 2) to what is not free; 0 outside of the map."""
        assert self._grid_map is not None and self._room_m is not None
        rows, columns = self._grid_map.cells(points_m)
        inside = self._grid_map.contains(rows, columns)
        return np.where(inside, self._room_m[np.where(inside, rows, 0), np.where(inside, columns, 0)], 0.0)

    def _is_open(self, from_m: np.ndarray, to_m: np.ndarray) -> bool:
        """Whether the robot fits along the straight line; not checked near its start, where the robot already stands."""
        if self._grid_map is None or self._room_m is None:
            return True
        steps = max(int(math.ceil(float(np.hypot(*(to_m - from_m))) / STEP_M)), 1)
        points = from_m + np.linspace(0.0, 1.0, steps + 1)[:, None] * (to_m - from_m)
        room_m = self._room_at(points)
        least_m = np.minimum(self._limits.robot_radius_m, np.maximum.accumulate(room_m))
        return bool((room_m > 0.0).all() and (room_m >= least_m - self._grid_map.resolution_m).all())


def _edge_line(atlas: Atlas, edge: int) -> Polyline:
    """The line of the edge in the atlas, from node to node."""
    ends = atlas.nodes.position_m[atlas.darts.node[2 * edge : 2 * edge + 2]]
    points = _joined(np.concatenate([ends[:1], atlas.edges.polyline_m[edge], ends[1:]]))
    if len(points) < 2:  # a loop of which the atlas has no line
        points = np.array([ends[0], ends[0] + [JOINED_M, 0.0]])
    return Polyline(points)


def _room(grid_map: GridMap) -> np.ndarray:
    """(H, W) [m] from each cell to the nearest one that is not free."""
    from scipy import ndimage

    padded = np.pad(grid_map.free, 1)
    room: np.ndarray = ndimage.distance_transform_edt(padded)[1:-1, 1:-1] * grid_map.resolution_m
    return room


def _joined(points_m: np.ndarray) -> np.ndarray:
    """(n, 2) points (M, 2) without repeated neighbours; the last point is kept."""
    kept = polyline.distinct(points_m, JOINED_M)
    kept[-1] = points_m[-1]
    return kept
