"""Measures what the robot reports of its path: Meetpoint and Traversal.

The same measures as in the atlas builder: lengths along the smoothed line of the edge from node to node, directions
from a node to the point at BEARING_AT_M along the line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import List, Sequence

import numpy as np

from glass_nav.driving.edge_tracking.local_graph import Branch
from glass_nav.geometry import angles, se2, segments
from glass_nav.topology.atlas import atlas_builder
from glass_nav.topology.atlas.edge_views import EdgeViews, ViewParams
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.world.grid_map import GridMap

_WOBBLE_M = 0.04  # of a line between one graph and the next
_R_SIGMA_M = 0.03  # of an equidistance, besides what its obstacles leave open
_MIN_TRACE_M = 0.05
_LATE_POINTS = 40  # of a trace: a robot backs off by no more


@dataclass(frozen=True)
class Node:
    """A meetpoint in the frame odom."""

    position_m: np.ndarray  # (2,)
    r_m: float
    sigma_r_m: float
    branches: List[Branch]  # by rank: the edge it came along first, then clockwise

    @property
    def degree(self) -> int:
        return len(self.branches)


class Trace:
    """The path along one edge so far, from the node where it began."""

    def __init__(self, start_m: np.ndarray) -> None:
        self._points = [np.array(start_m, float)]

    def add(self, point_m: np.ndarray) -> None:
        """Adds the robot's position on the edge; small steps are left out, stretches backed off are removed."""
        if np.hypot(*(point_m - self._points[-1])) < _MIN_TRACE_M:
            return
        late = np.array(self._points[1:][-_LATE_POINTS:]).reshape(-1, 2)
        passed = np.flatnonzero(np.hypot(*(late - point_m).T) < _MIN_TRACE_M)
        if len(passed):
            del self._points[len(self._points) - len(late) + int(passed[0]) + 1 :]
        else:
            self._points.append(np.array(point_m, float))

    def cut_back(self, point_m: np.ndarray) -> None:
        """The edge ended there already, behind the robot: forget what was driven beyond."""
        points = np.array(self._points)
        nearest = int(np.hypot(*(points - point_m).T).argmin())
        self._points = self._points[: max(nearest, 1)]

    def line_m(self, end_m: np.ndarray) -> np.ndarray:
        """(n, 2) without wobbles, up to a point."""
        points = np.array(self._points)
        near_end = np.hypot(*(points[1:] - end_m).T) < _MIN_TRACE_M
        points = np.concatenate([points[:1], points[1:][~near_end], [end_m]])
        return points[segments.corners(points, _WOBBLE_M)]

    @property
    def way_m(self) -> np.ndarray:
        """(n, 2) as it was driven, for the way back."""
        return np.array(self._points)

    @property
    def length_m(self) -> float:
        return float(np.hypot(*np.diff(np.array(self._points), axis=0).T).sum()) if len(self._points) > 1 else 0.0


def ranked(branches: Sequence[Branch], back_rad: float) -> List[Branch]:
    """Clockwise branches, from the one that leaves nearest to a direction on."""
    off = [abs(float(angles.wrap(branch.bearing_rad - back_rad))) for branch in branches]
    first = int(np.argmin(off))
    return [*branches[first:], *branches[:first]]


def sigma_r_m(spread_m: float, doubt_m: float) -> float:
    """Standard deviation of an equidistance, from the graph at a node."""
    return math.sqrt(_R_SIGMA_M**2 + spread_m**2 + doubt_m**2)


def meetpoint(node: Node, odom_from_base: np.ndarray, stamp_ns: int) -> Meetpoint:
    """A node as the robot at that pose reports it."""
    bearings = np.array([branch.bearing_rad for branch in node.branches]) - odom_from_base[2]
    centre = se2.transform_points(se2.inverse(odom_from_base), node.position_m)
    gaps = np.mod(bearings[0] - bearings, 2.0 * np.pi)
    gaps[0] = 0.0
    return Meetpoint(node.degree, node.r_m, node.sigma_r_m, float(angles.wrap(bearings[0])) - gaps, centre, stamp_ns)


def traversal(line_m: np.ndarray, rank: int, grid: GridMap) -> Traversal:
    """An edge that was followed.

    Args:
        line_m: (n, 2) from node to node in odom.
        rank: by which it left.
        grid: what stands around, in odom: as far as it reaches, the walls seen along the edge.
    """
    leaving, back = atlas_builder.bearings(line_m)
    length = float(np.hypot(*np.diff(line_m, axis=0).T).sum())
    step = line_m[-1] - line_m[0]
    chord = float(np.hypot(*step))
    bearing = float(angles.wrap(math.atan2(step[1], step[0]) - leaving)) if chord > 1e-6 else math.nan
    seen, _ = EdgeViews(grid, ViewParams()).of(line_m)
    start_from_odom = se2.inverse(np.array([line_m[0, 0], line_m[0, 1], leaving]))
    rows = se2.transform_points(start_from_odom, seen.reshape(-1, 2)).reshape(-1, 4)
    return Traversal(
        rank,
        length,
        chord,
        chord_bearing_rad=bearing,
        turn_rad=float(angles.wrap(back + math.pi - leaving)),
        segments_m=rows,
    )


def bearing_back(line_m: np.ndarray) -> float:
    """Direction in which the edge of a line (n, 2) leaves its end again."""
    return atlas_builder.bearings(line_m)[1]
