"""Scans, odometry -> commands along the edges of the Voronoi graph, and what the robot reports of them.

No pose in a map is needed: the graph is that of a small map around the robot, see local_map.py, made by the same code
as the atlas, so that both see the same meetpoints. What lies ahead may turn out otherwise (a pane that was not seen
yet, a corner that hid something), so a meetpoint counts only once the robot stands there and has looked again. What
comes in is odom_from_base (3,); map, graph and ways are in the frame local, odom without its drift, see local_pose.py.

Choset, Burdick, Sensor-based exploration: the hierarchical generalized Voronoi graph (IJRR 2000): tracing and homing;
here both go along a line of the local graph instead of a gradient of the distances.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import List, Optional, Tuple

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from glass_nav.driving import braking, edge_report, local_graph, pursuit, velocity
from glass_nav.driving.base_limits import BaseLimits
from glass_nav.driving.edge_report import Node, Trace
from glass_nav.driving.local_graph import LocalGraph
from glass_nav.driving.local_map import LocalMap, LocalMapParams
from glass_nav.driving.local_pose import LocalPose
from glass_nav.geometry import angles, polyline, se2
from glass_nav.geometry.polyline import Polyline
from glass_nav.sensing.scan import Scan
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams
from glass_nav.topology.observations import Meetpoint, Traversal, refuse_rank
from glass_nav.vocabulary import DriverPhase, Outcome
from glass_nav.world.grid_map import GridMap

_DRIVING = (DriverPhase.SEEKING, DriverPhase.FOLLOWING, DriverPhase.HOMING, DriverPhase.RETURNING)

_LOOKAHEAD_M = 0.35
_TURN_FIRST_RAD = 0.7  # a point further to the side is turned to on the spot
_AT_END_M = 0.02
_GRAPH_PERIOD_NS = 300_000_000  # between two graphs
_MIN_SCANS = 3  # before the first graph
_LOOKS = 4  # graphs that must agree on a meetpoint: over a second, people walk on
_MAX_LOOKS = 9  # then it is none
_AHEAD_M = 0.4  # of the robot, where its edge is told from others
_FOOT_M = 0.4  # the line moves by no more from one graph to the next
_TO_GRAPH_M = 4.0  # the graph may be so far away at the beginning
_AT_NODE_M = 0.08  # the robot stands at a node
_ALMOST_M = 0.45  # ... or as near as it gets, if something stands in the way
_SAME_NODE_M = 0.3  # a node moves by no more from one graph to the next
_SHORT_EDGE_M = 0.7  # along a longer edge no node follows within
_SPLIT_M = 0.6  # so much: it would be a part of the one that the robot left
_BEHIND_M = 1.0  # a node that shows only once the robot is past it
_DOUBT_M = 0.15  # an obstacle that is further from any wall: look around first
_BLOCKED_S = 4.0
_LOST_LINE_S = 3.0  # driven on along the last line, without a graph that has it
_SEEN_M = 0.12  # a wall of the map beside a point of the scan is the same
_NEAR_M = 2.0  # obstacles further away are not braked for


@dataclass(frozen=True)
class EdgeDriverParams:
    """How edges are followed and meetpoints found."""

    limits: BaseLimits = field(default_factory=BaseLimits)
    graph: VoronoiParams = field(default_factory=VoronoiParams)  # as the atlas was built with
    local_map: LocalMapParams = field(default_factory=LocalMapParams)


@dataclass(frozen=True)
class Arrival:
    """What is reported at a meetpoint."""

    stamp_ns: int  # of the scan that showed it
    odom_from_base: np.ndarray  # (3,) then
    meetpoint: Meetpoint
    traversal: Optional[Traversal]  # None: it was sought, not reached along an edge that began at a meetpoint


@dataclass(frozen=True)
class Progress:
    """Where the driver is."""

    phase: DriverPhase
    reason: str  # one sentence
    travelled_m: float  # since the last meetpoint
    failure: Optional[Outcome] = None  # NO_GRAPH or BLOCKED if FAILED


class EdgeDriver:
    """see() every scan, ask for a command() at every control step; seek(), leave(), go_back() and stop() say what."""

    # Of what it does just now; _begin() sets them all.
    _phase: DriverPhase
    _reason: str
    _failure: Optional[Outcome]
    _way: Optional[Polyline]  # that it drives along; None: none known yet
    _trace: Optional[Trace]  # of the edge so far; None: no edge that began at a meetpoint
    _rank: int  # by which the edge left
    _near_start_m: float  # nodes so near to its beginning are that
    _target: np.ndarray  # (2,) the node that it homes to
    _looking: bool  # it stands there, or brakes, and looks
    _looks: int  # graphs since then
    _nodes: List[Node]  # what was there in these
    _dismissed: List[np.ndarray]  # (2,) places that turned out to be no nodes
    _swept: bool  # it has turned round once to see more
    _sweep_rad: float  # what is left of that turn
    _yaw: float  # at the last command
    _blocked_s: float
    _lost_since_ns: int  # no graph has had its line since then; 0: the last one has

    def __init__(self, p: EdgeDriverParams = EdgeDriverParams()) -> None:
        self._p = p
        self._map, self._at = LocalMap(p.local_map), LocalPose()
        self._graph_params = local_graph.params_beside(p.graph)
        self.reset()

    def reset(self) -> None:
        """Forget all: odometry began anew, or the robot was carried."""
        self._map.clear()
        self._at.clear()
        self._grid: Optional[GridMap] = None
        self._graph: Optional[LocalGraph] = None
        self._graph_ns = 0
        self._scans = 0
        self._scan: Optional[Scan] = None  # the last one
        self._points_m = np.zeros((0, 2))  # of the last scan, in odom
        self._walls_m = np.zeros((0, 2))  # of the local map near the robot, in odom
        self._pose = np.zeros(3)
        self._stamp_ns = 0
        self._velocity = np.zeros(3)
        self._node: Optional[Node] = None  # where it stands, or began
        self._arrival: Optional[Arrival] = None
        self._halted: Optional[Tuple[DriverPhase, Optional[Trace], int, Optional[Polyline]]] = None
        self._begin(DriverPhase.IDLE, "nothing to do")

    # -- what to do

    def seek(self) -> None:
        """Drive to a meetpoint, having looked around."""
        self._node = None
        self._begin(DriverPhase.SEEKING, "looking around")
        self._sweep_rad = 2.0 * math.pi

    def leave(self, rank: int) -> None:
        """Follow the edge of that rank from the meetpoint where the robot stands.

        Raises:
            ValueError: it stands at none.
            ObservationError: that has no such edge; nothing is changed.
        """
        if self._node is None or self._phase != DriverPhase.ARRIVED:
            raise ValueError(f"it stands at no meetpoint that it could leave: it is {self._phase}")
        refuse_rank(rank, self._node.degree)
        self._begin(DriverPhase.FOLLOWING, f"along edge {rank} of {self._node.degree}")
        self._rank = rank
        self._way = _line(self._node.branches[rank].way_m)
        self._trace = Trace(self._node.position_m)
        short = self._way is None or self._way.length < _SHORT_EDGE_M
        self._near_start_m = _SAME_NODE_M if short else _SPLIT_M

    def go_back(self) -> None:
        """Return to the meetpoint that the robot left last.

        Raises:
            ValueError: it left none.
        """
        if self._node is None or self._trace is None:
            raise ValueError("it left no meetpoint that it could return to")
        self._trace.cut_back(self._pose[:2])
        way = np.concatenate([self._pose[None, :2], self._trace.way_m[::-1]])
        self._begin(DriverPhase.RETURNING, "back to the meetpoint that it left")
        self._way = _line(way)

    def stop(self) -> None:
        """Stand, whatever was asked for. resume() goes on with it, seek() begins anew, go_back() returns."""
        self._halt(DriverPhase.IDLE, "stopped")

    def resume(self) -> None:
        """Go on with the edge, or the search for a meetpoint, that stop() or a failure ended.

        Raises:
            ValueError: there is none.
        """
        if self._phase not in (DriverPhase.IDLE, DriverPhase.FAILED) or self._halted is None:
            raise ValueError(f"nothing was stopped that it could go on with: it is {self._phase}")
        phase, trace, rank, way = self._halted
        self._begin(phase, "going on")
        self._trace, self._rank, self._way = trace, rank, way

    # -- what it sees

    def see(self, scan: Scan, odom_from_base: np.ndarray) -> None:
        """Take in a scan, with odometry's pose (3,) at its stamp; in any phase."""
        self._pose, self._stamp_ns = self._at.correct(scan, odom_from_base), scan.stamp_ns
        self._map.add(scan, self._pose)
        self._scans += 1
        self._scan = scan
        self._points_m = _steady_points(scan, self._pose)
        due = self._stamp_ns - self._graph_ns >= _GRAPH_PERIOD_NS
        if self._phase in _DRIVING and self._sweep_rad <= 0.0 and (due or self._graph is None):
            self._look()
            self._think()
        elif due:
            self._graph_ns = self._stamp_ns
            walls = self._map.walls()
            self._at.know(walls)
            self._near_walls(walls)

    def take_arrival(self) -> Optional[Arrival]:
        """The report of a meetpoint, once."""
        arrival, self._arrival = self._arrival, None
        return arrival

    @property
    def progress(self) -> Progress:
        travelled = 0.0 if self._trace is None else self._trace.length_m
        return Progress(self._phase, self._reason, travelled, self._failure)

    @property
    def local_grid(self) -> Optional[GridMap]:
        """The last map around the robot, in odom; None before the first."""
        return self._grid

    @property
    def local_graph(self) -> Optional[LocalGraph]:
        """The last graph, in odom; None before the first."""
        return self._graph

    @property
    def node(self) -> Optional[Node]:
        """The meetpoint where the robot stands, or which it left last, in odom."""
        return self._node

    @property
    def way_m(self) -> np.ndarray:
        """(n, 2) that it drives along, in odom; n = 0: none."""
        return np.zeros((0, 2)) if self._way is None else self._way.points

    def local_from_base(self, odom_from_base: np.ndarray) -> np.ndarray:
        """(3,) pose of the robot in the frame of map, graph and way, which is odom without its drift."""
        return self._at.now(odom_from_base)

    def obstacles_m(self, odom_from_base: np.ndarray) -> np.ndarray:
        """(K, 2) what stands near the robot at that pose (3,), in its frame: the last scan, the walls of the local map."""
        return self._obstacles_at(self._at.now(odom_from_base))

    def _obstacles_at(self, pose: np.ndarray) -> np.ndarray:
        points, walls = (
            among[np.abs(among - pose[:2]).max(axis=1) < _NEAR_M] for among in (self._points_m, self._walls_m)
        )
        if len(points) and len(walls):  # what the scan shows now it shows better than the cells do
            walls = walls[cKDTree(points).query(walls, distance_upper_bound=_SEEN_M)[0] > _SEEN_M]
        return se2.transform_points(se2.inverse(pose), np.concatenate([points, walls]))

    # -- commands

    def command(self, odom_from_base: np.ndarray, dt_s: float) -> np.ndarray:
        """(3,) velocity forward, left [m/s], turn [rad/s] for the next control step.

        Args:
            odom_from_base: (3,) the newest.
            dt_s: since the last command.
        """
        pose = self._at.now(odom_from_base)
        turned = abs(float(angles.wrap(pose[2] - self._yaw)))
        self._yaw = float(pose[2])
        wanted = np.zeros(3)
        if self._phase in _DRIVING:
            if self._sweep_rad > 0.0:
                self._sweep_rad -= turned
                if self._scans >= _MIN_SCANS:
                    wanted[2] = self._p.limits.max_turn_rad_s
            elif self._way is not None and not self._looking:
                wanted = self._along_way(self._way, pose)
                goes_back = self._phase == DriverPhase.RETURNING or (
                    self._phase == DriverPhase.FOLLOWING and self._rank == 0
                )
                safe = braking.allowed(wanted, self._obstacles_at(pose), self._p.limits, creep=goes_back)
                self._note_blocked(wanted, safe, dt_s)
                wanted = safe
        command = velocity.limited(wanted, self._velocity, self._p.limits, dt_s)
        if wanted[0] < command[0]:  # brakes twice as hard as it speeds up
            most = 2.0 * self._p.limits.max_acceleration_m_s2 * dt_s
            command[0] = max(float(wanted[0]), float(self._velocity[0]) - most)
        self._velocity = command
        return command.copy()

    def _along_way(self, way: Polyline, pose: np.ndarray) -> np.ndarray:
        passed_m = way.nearest(pose[:2])
        at_node = self._phase == DriverPhase.HOMING and float(np.hypot(*(pose[:2] - self._target))) < _AT_NODE_M
        if at_node or way.length - passed_m < _AT_END_M:
            if self._phase == DriverPhase.HOMING:
                self._begin_looking()
            elif self._phase == DriverPhase.RETURNING:
                self._begin(DriverPhase.ARRIVED, "back at the meetpoint that it left")
            return np.zeros(3)
        ahead = se2.transform_points(se2.inverse(pose), way.at(passed_m + _LOOKAHEAD_M))
        bearing = math.atan2(ahead[1], ahead[0])
        if abs(bearing) > _TURN_FIRST_RAD:
            return pursuit.on_the_spot(bearing, self._p.limits)
        return pursuit.along_arc(ahead, self._p.limits, way.length - passed_m)

    def _note_blocked(self, wanted: np.ndarray, safe: np.ndarray, dt_s: float) -> None:
        stuck = wanted[0] > 0.02 and safe[0] < 0.03
        self._blocked_s = self._blocked_s + dt_s if stuck else 0.0
        if (
            self._phase == DriverPhase.HOMING
            and self._blocked_s > 1.0
            and float(np.hypot(*(self._pose[:2] - self._target))) < _ALMOST_M
        ):
            self._begin_looking()
        elif self._blocked_s > _BLOCKED_S:
            assert self._way is not None
            remaining_m = self._way.length - self._way.nearest(self._pose[:2])
            if self._phase == DriverPhase.FOLLOWING and remaining_m < _ALMOST_M:
                self._home(self._way.points[-1], self._way.points)
                self._begin_looking()
            else:
                self._fail(
                    Outcome.BLOCKED,
                    f"something stands in the way, {remaining_m:.1f} m before the end of what is seen of the edge",
                )

    # -- thinking, once for each graph

    def _look(self) -> None:
        self._grid = self._map.grid_around(self._pose[:2])
        self._graph = LocalGraph(self._grid, self._graph_params)
        self._graph_ns = self._stamp_ns
        self._at.know(self._map.walls())
        self._near_walls(self._grid)

    def _near_walls(self, grid: GridMap) -> None:
        reach = int(_NEAR_M / grid.resolution_m)
        row, column = (int(index) for index in grid.cells(self._pose[:2]))
        top, left = max(row - reach, 0), max(column - reach, 0)
        rows, columns = np.nonzero(grid.occupied[top : row + reach, left : column + reach])
        self._walls_m = grid.centres(rows + top, columns + left)

    def _think(self) -> None:
        if self._looking:
            self._look_again()
        elif self._phase == DriverPhase.HOMING:
            self._correct_target()
        elif self._phase in (DriverPhase.SEEKING, DriverPhase.FOLLOWING):
            self._follow()

    def _follow(self) -> None:
        graph, here = self._graph, self._pose[:2]
        assert graph is not None
        if self._way is None:
            if not self._join_graph(graph, here):
                self._without_line("no edge is near that can be reached straight on")
            return
        found = self._line_now(graph, self._way, here)
        if found is None:
            self._without_line("the edge is no longer seen")
            return
        self._lost_since_ns = 0
        way, node, behind = found
        passed_m, position = way.nearest(here), graph.graph.position_m
        if passed_m < _BEHIND_M and self._counts(graph)[behind] and not self._is_start(graph, behind):
            if self._trace is not None:
                self._trace.cut_back(position[behind])
            self._home(position[behind], way.part(passed_m, 0.0))
            return
        if self._trace is not None and passed_m > 0.0:
            self._trace.add(way.at(passed_m))
        self._way = way
        if way.length - passed_m < 2.0 * _LOOKAHEAD_M and not self._is_start(graph, node):
            self._home(position[node], way.part(passed_m, way.length))

    def _line_now(self, graph: LocalGraph, way: Polyline, here: np.ndarray) -> Optional[Tuple[Polyline, int, int]]:
        """The edge that the robot follows as the graph has it now: its line, the node ahead and the one behind.

        Looked up a little ahead of the robot: beside a node all its edges are near.
        """
        passed_m = way.nearest(here)
        at = passed_m + min(_AHEAD_M, 0.5 * (way.length - passed_m))
        along = way.direction(at)
        foot = graph.foot(way.at(at), _FOOT_M, along)
        if foot is None:
            return None
        ahead = graph.ahead(foot, along)
        counts = self._counts(graph)
        if self._trace is not None and self._node is not None and self._trace.length_m < _BEHIND_M:
            away = np.hypot(*(graph.graph.position_m - self._node.position_m).T)
            counts = counts & (away > self._near_start_m)
        onward, node = graph.walk(ahead, counts)
        line = _line(np.concatenate([ahead.back_m[:0:-1], onward]))
        return None if line is None else (line, node, ahead.back_node)

    def _join_graph(self, graph: LocalGraph, here: np.ndarray) -> bool:
        foot = graph.foot(here, _TO_GRAPH_M)
        if foot is None:
            return False
        heading = np.array([math.cos(self._pose[2]), math.sin(self._pose[2])])
        ways = []
        for along in (heading, -heading):
            way, node = graph.walk(graph.ahead(foot, along), self._counts(graph))
            doubtful = graph.graph.doubt_m[node] > _DOUBT_M
            ways.append((doubtful, len(way), way))  # its points are evenly apart
        self._way = _line(np.concatenate([here[None], min(ways, key=lambda found: found[:2])[2]]))
        self._reason = "to the nearest meetpoint"
        return True

    def _counts(self, graph: LocalGraph) -> np.ndarray:
        """(N,) bool: nodes that may be meetpoints; those that turned out to be none on this edge are not."""
        counts = graph.degree != 2
        for none in self._dismissed:
            counts &= np.hypot(*(graph.graph.position_m - none).T) > _SAME_NODE_M
        return counts

    def _is_start(self, graph: LocalGraph, node: int) -> bool:
        """Whether the node is the one that the edge began at, with little way behind the robot."""
        if self._trace is None or self._node is None:
            return False
        there = graph.graph.position_m[node] - self._node.position_m
        return float(np.hypot(*there)) < self._near_start_m and self._trace.length_m < 2.0 * _BEHIND_M

    def _without_line(self, why: str) -> None:
        if not self._lost_since_ns:
            self._lost_since_ns = self._stamp_ns
        elif self._stamp_ns - self._lost_since_ns > _LOST_LINE_S * 1e9:
            if self._swept:
                self._fail(Outcome.NO_GRAPH, f"{why}, also after looking around")
            else:
                self._swept, self._sweep_rad, self._lost_since_ns = True, 2.0 * math.pi, 0
                if self._phase == DriverPhase.SEEKING:  # any other edge will do
                    self._way = None

    # -- homing

    def _home(self, target_m: np.ndarray, way_m: np.ndarray) -> None:
        self._phase, self._reason = DriverPhase.HOMING, "to the meetpoint"
        self._target = np.array(target_m, float)
        self._way = _line(way_m)
        if self._way is None:
            self._way = _line(np.stack([self._pose[:2], target_m]))
        self._blocked_s = 0.0
        self._looking, self._looks, self._nodes = False, 0, []

    def _begin_looking(self) -> None:
        self._looking, self._looks, self._nodes = True, 0, []
        self._reason = "looking whether this is a meetpoint"

    @property
    def _standing(self) -> bool:
        return self._looking and float(np.abs(self._velocity).max()) < 0.02

    def _correct_target(self) -> None:
        graph = self._graph
        assert graph is not None
        node = graph.node_near(self._target, _SAME_NODE_M)
        if node is None or not self._counts(graph)[node]:
            self._looks += 1
            if self._looks > _LOOKS and not self._home_to_nearer_end(graph):
                self._dismiss()
            return
        self._looks = 0
        self._target = graph.graph.position_m[node]
        here, way = self._pose[:2], self._way
        assert way is not None
        found = self._line_now(graph, way, here)
        if found is not None and found[1] == node:
            way = found[0]
        else:
            way = _line(np.concatenate([way.points[:-1], self._target[None]])) or way
        self._way = way
        if self._trace is not None:
            self._trace.add(way.at(way.nearest(here)))

    def _look_again(self) -> None:
        if not self._standing:
            return
        graph = self._graph
        assert graph is not None
        self._looks += 1
        node = graph.node_near(self._target, _SAME_NODE_M)
        if node is not None:
            self._nodes.append(self._node_of(graph, node))
            latest = [found for found in self._nodes if found.degree == self._nodes[-1].degree]
            if len(latest) >= _LOOKS:
                if graph.graph.doubt_m[node] > _DOUBT_M and not self._swept:
                    self._swept, self._sweep_rad = True, 2.0 * math.pi
                    self._begin_looking()
                    return
                self._arrive(latest[-1])
                return
        if self._looks >= _MAX_LOOKS and not self._home_to_nearer_end(graph):
            self._dismiss()

    def _home_to_nearer_end(self, graph: LocalGraph) -> bool:
        """Back to a dead end, if the robot is past it: a way that narrows ends the sooner the better it is seen."""
        if self._trace is None:
            return False
        position = graph.graph.position_m
        ends = np.flatnonzero(
            (graph.degree == 1) & self._counts(graph) & (np.hypot(*(position - self._target).T) < _BEHIND_M)
        )
        trace = cKDTree(self._trace.way_m)
        for node in ends[np.argsort(np.hypot(*(position[ends] - self._pose[:2]).T))].tolist():
            passed = trace.query(position[node])[0] < _SAME_NODE_M
            if passed and not self._is_start(graph, node) and graph.sees(self._pose[:2], position[node]):
                self._trace.cut_back(position[node])
                self._home(position[node], np.stack([self._pose[:2], position[node]]))
                return True
        return False

    def _dismiss(self) -> None:
        self._dismissed.append(self._target)
        self._phase = DriverPhase.FOLLOWING if self._trace is not None else DriverPhase.SEEKING
        self._looking, self._reason = False, "what looked like a meetpoint is none"

    def _node_of(self, graph: LocalGraph, node: int) -> Node:
        found = graph.graph
        branches = graph.branches(node)
        position = found.position_m[node]
        if self._trace is not None:
            back = self._trace.line_m(position)
            past = edge_report.bearing_back(back)
        else:
            past = float(self._pose[2]) + math.pi
        return Node(
            position,
            float(found.r_m[node]),
            edge_report.sigma_r_m(float(found.spread_m[node]), float(found.doubt_m[node])),
            edge_report.ranked(branches, past),
        )

    def _arrive(self, node: Node) -> None:
        assert self._grid is not None
        driven = None
        if self._trace is not None:
            driven = edge_report.traversal(self._trace.line_m(node.position_m), self._rank, self._grid)
        seen = replace(edge_report.meetpoint(node, self._pose, self._stamp_ns), scan=self._scan)
        self._arrival = Arrival(self._stamp_ns, self._pose, seen, driven)
        self._node = node
        self._begin(DriverPhase.ARRIVED, f"at a meetpoint of degree {node.degree}, {node.r_m:.2f} m from its obstacles")

    # -- phases

    def _begin(self, phase: DriverPhase, reason: str) -> None:
        self._phase, self._reason, self._failure = phase, reason, None
        self._way, self._trace = None, None
        self._rank = 0
        self._near_start_m = _SAME_NODE_M
        self._target = np.zeros(2)
        self._looking, self._looks = False, 0
        self._nodes, self._dismissed = [], []
        self._swept = False
        self._sweep_rad = 0.0
        self._yaw = float(self._pose[2])
        self._blocked_s = 0.0
        self._lost_since_ns = 0

    def _fail(self, failure: Outcome, reason: str) -> None:
        self._halt(DriverPhase.FAILED, reason)
        self._failure = failure

    def _halt(self, phase: DriverPhase, reason: str) -> None:
        """Stand, and remember what it did; what it remembers already stays if it did nothing."""
        if self._phase in _DRIVING and self._phase != DriverPhase.RETURNING:
            seeking = self._trace is None
            self._halted = (
                DriverPhase.SEEKING if seeking else DriverPhase.FOLLOWING,
                self._trace,
                self._rank,
                self._way,
            )
        trace = self._trace
        self._begin(phase, reason)
        self._trace = trace


def _line(points_m: np.ndarray) -> Optional[Polyline]:
    """The line through points (n, 2); None if they are all one."""
    points = polyline.distinct(points_m)
    return Polyline(points) if len(points) > 1 else None


def _steady_points(scan: Scan, local_from_base: np.ndarray) -> np.ndarray:
    """(K, 2) end points of the beams, without single ones that stick out."""
    ranges_m = np.where(scan.answered, scan.ranges_m, np.inf)
    points = replace(scan, ranges_m=ndimage.median_filter(ranges_m, 3, mode="nearest")).points_in_base()
    return se2.transform_points(local_from_base, points[np.isfinite(points).all(axis=1)])
