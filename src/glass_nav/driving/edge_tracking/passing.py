"""Detects the meetpoints that a robot drives past, whatever steers it.

It observes the graph of the same local map as the edge driver, without driving. The driver stops at a node and looks
until some graphs agree; a robot that only drives past has the graphs that were made on its way. So a node is followed
from graph to graph while the robot is near, and reported once the robot has left it, with the values on which the
graphs around the nearest point of the path agree.

Poses are local_from_base, see local_pose.py.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Dict, List, Optional

import numpy as np

from glass_nav.driving.edge_tracking import edge_report, local_graph
from glass_nav.driving.edge_tracking.local_graph import LocalGraph
from glass_nav.driving.edge_tracking.local_map import LocalMapParams
from glass_nav.driving.edge_tracking.local_pose import LocalPose
from glass_nav.driving.edge_tracking.map_around import MapAround
from glass_nav.geometry import se2
from glass_nav.sensing.scan import Scan
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams

_SAME_NODE_M = 0.3  # a node moves by no more from one graph to the next
_STILL_M, _STILL_RAD = 0.02, 0.05  # a robot that moved less since the last graph sees nothing new
_AGREE = 5  # graphs next to the nearest point of the path whose word counts: some before, some after
_FOOT_M = 1.0  # the robot follows an edge if it is no further away than this


@dataclass(frozen=True)
class PassingParams:
    """When a node counts as passed, and when as seen."""

    near_m: float = 0.5  # the robot passes a node if it comes so near to it, in sight,
    near_share_of_r: float = 0.5  # or nearer than this share of its distance from the obstacles
    linger_m: float = 1.0  # it is watched for so much further than that, coming and going
    graph_period_s: float = 0.3  # of the log, between two graphs,
    graph_step_m: float = 0.15  # unless the robot moved so far
    least_looks: int = 3  # graphs that must have a node
    least_share: float = 0.5  # of those made next to the nearest point of the path
    most_doubt_m: float = 0.15  # its obstacles are no further from any wall: the driver would look around first
    graph: VoronoiParams = field(default_factory=VoronoiParams)  # as the atlas was built with
    local_map: LocalMapParams = field(default_factory=LocalMapParams)

    def __post_init__(self) -> None:
        for name in ("near_m", "graph_period_s", "graph_step_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be > 0 and finite, got {getattr(self, name)}")
        for name in ("near_share_of_r", "linger_m", "most_doubt_m"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be >= 0 and finite, got {getattr(self, name)}")
        if self.least_looks < 1:
            raise ValueError(f"least_looks must be >= 1, got {self.least_looks}")
        if not 0.0 <= self.least_share <= 1.0:
            raise ValueError(f"least_share must be in [0, 1], got {self.least_share}")

    def near(self, r_m: np.ndarray) -> np.ndarray:
        """(...) how near is near, for nodes of equidistances (...)."""
        return np.maximum(self.near_m, self.near_share_of_r * r_m)


@dataclass(frozen=True)
class PassedNode:
    """A node of the local graphs that the robot was near to."""

    stamp_ns: int  # of the graph that had it and was made nearest to it
    first_ns: int  # of the first graph that had it while the robot was about,
    last_ns: int  # and of the last one
    local_m: np.ndarray  # (2,) in the frame local
    in_base_m: np.ndarray  # (2,) in the robot's frame at stamp_ns
    away_m: float  # of the robot then
    degree: int
    r_m: float
    doubt_m: float
    looks: int  # graphs that had it
    share: float  # of those next to the nearest point of the path, from first_ns on


@dataclass(frozen=True)
class WayPoint:
    """A position of the robot on the graph."""

    stamp_ns: int
    local_m: np.ndarray  # (2,) the point of the graph nearest to the robot; the robot itself if none is near


@dataclass(frozen=True)
class _Look:
    stamp_ns: int
    number: int  # of the graph
    position_m: np.ndarray  # (2,)
    local_from_base: np.ndarray  # (3,)
    away_m: float
    degree: int
    r_m: float
    doubt_m: float


class _Track:
    """A node of the local graph, tracked while the robot is near it."""

    def __init__(self, look: _Look) -> None:
        self.looks = [look]
        self.away_m: Dict[int, float] = {}  # of the robot at each graph since then, whether that has the node or not

    @property
    def last(self) -> _Look:
        return self.looks[-1]

    def share(self) -> float:
        """Share of the graphs near the closest point of the path that have the node."""
        nearest = min(self.away_m, key=lambda number: self.away_m[number])
        beside = [number for number in self.away_m if abs(number - nearest) <= _AGREE // 2]
        return sum(look.number in beside for look in self.looks) / len(beside)


class PassingObserver:
    """see() every scan of a drive in its order, then finish()."""

    def __init__(self, p: PassingParams = PassingParams()) -> None:
        self._p = p
        self._map, self._at = MapAround(p.local_map), LocalPose()
        self._graph_params = local_graph.params_beside(p.graph)
        self._open: List[_Track] = []  # nodes that the robot is about
        self._graphs = 0
        self._last_ns = 0
        self._last_pose: Optional[np.ndarray] = None  # at the last graph
        self.passed: List[PassedNode] = []  # all that were near, in the order in which the robot left them
        self.way: List[WayPoint] = []  # one of each graph

    @property
    def params(self) -> PassingParams:
        return self._p

    def counts(self, node: PassedNode) -> bool:
        """Whether a robot would take it for a meetpoint: graphs agree on it, and its obstacles are known."""
        return self.is_steady(node) and node.doubt_m <= self._p.most_doubt_m

    def is_steady(self, node: PassedNode) -> bool:
        """Whether the graphs agree on it."""
        return node.looks >= self._p.least_looks and node.share >= self._p.least_share

    def see(self, scan: Scan, odom_from_base: np.ndarray) -> None:
        """Take in a scan, with odometry's pose (3,) at its stamp."""
        pose = self._at.correct(scan, odom_from_base)
        self._map.add(scan, pose)
        if self._is_due(scan.stamp_ns, pose):
            self._look(scan.stamp_ns, pose)

    def finish(self) -> List[PassedNode]:
        """The drive is over: all nodes, those that the robot is still near to as well."""
        for track in self._open:
            self._close(track)
        self._open = []
        self.passed.sort(key=lambda node: node.stamp_ns)
        return self.passed

    def _is_due(self, stamp_ns: int, pose: np.ndarray) -> bool:
        if self._last_pose is None:
            return True
        moved = se2.compose(se2.inverse(self._last_pose), pose)
        moved_m = float(np.hypot(*moved[:2]))
        if moved_m < _STILL_M and abs(float(moved[2])) < _STILL_RAD:
            return False
        return moved_m >= self._p.graph_step_m or stamp_ns - self._last_ns >= self._p.graph_period_s * 1e9

    def _look(self, stamp_ns: int, pose: np.ndarray) -> None:
        graph = LocalGraph(self._map.grid_around(pose[:2]), self._graph_params)
        self._at.know(self._map.walls())
        self._last_ns, self._last_pose = stamp_ns, pose
        self._graphs += 1
        for look in self._looks(graph, stamp_ns, pose):
            self._follow(look)
        about = []
        for track in self._open:
            away_m = float(np.hypot(*(track.last.position_m - pose[:2])))
            if away_m > float(self._p.near(np.array(track.last.r_m))) + self._p.linger_m:
                self._close(track)
            else:
                track.away_m[self._graphs] = away_m
                about.append(track)
        self._open = about
        foot = graph.foot(pose[:2], _FOOT_M)
        self.way.append(WayPoint(stamp_ns, pose[:2].copy() if foot is None else graph.point(foot)))

    def _looks(self, graph: LocalGraph, stamp_ns: int, pose: np.ndarray) -> List[_Look]:
        """Nodes of the graph that are near and in sight, the nearest first."""
        found = graph.graph
        away = np.hypot(*(found.position_m - pose[:2]).T)
        about = np.flatnonzero((graph.degree != 2) & (away <= self._p.near(found.r_m) + self._p.linger_m))
        return [
            _Look(
                stamp_ns,
                self._graphs,
                found.position_m[node],
                pose,
                float(away[node]),
                int(graph.degree[node]),
                float(found.r_m[node]),
                float(found.doubt_m[node]),
            )
            for node in about[np.argsort(away[about], kind="stable")].tolist()
            if graph.sees(pose[:2], found.position_m[node])
        ]

    def _follow(self, look: _Look) -> None:
        """Add the look to the nearest track without a look of this graph; begin a new track if none is close."""
        free = [track for track in self._open if track.last.number < look.number]
        off = [float(np.hypot(*(track.last.position_m - look.position_m))) for track in free]
        if off and min(off) <= _SAME_NODE_M:
            free[int(np.argmin(off))].looks.append(look)
        else:
            self._open.append(_Track(look))

    def _close(self, track: _Track) -> None:
        looks = track.looks
        nearest = min(looks, key=lambda look: look.away_m)
        agree = sorted(looks, key=lambda look: abs(look.number - nearest.number))[:_AGREE]
        degree = Counter(look.degree for look in agree).most_common(1)[0][0]
        local_m = np.median([look.position_m for look in agree], axis=0)
        self.passed.append(
            PassedNode(
                nearest.stamp_ns,
                looks[0].stamp_ns,
                looks[-1].stamp_ns,
                local_m,
                se2.transform_points(se2.inverse(nearest.local_from_base), local_m),
                nearest.away_m,
                degree,
                float(np.median([look.r_m for look in agree])),
                float(np.median([look.doubt_m for look in agree])),
                len(looks),
                track.share(),
            )
        )

    def line_between(self, first: PassedNode, second: PassedNode) -> np.ndarray:
        """(n, 2) in the frame local: the edge that the robot followed from one node to the next."""
        trace = edge_report.Trace(first.local_m)
        for point in self.way:
            if first.stamp_ns < point.stamp_ns < second.stamp_ns:
                trace.add(point.local_m)
        return trace.line_m(second.local_m)
