"""Drives along the edges of the Voronoi graph by scans and odometry, and reports meetpoints and traversals.

No pose in a map is needed: the graph is that of a small local map (local_map.py), made by the same code as the atlas,
so that both have the same meetpoints. What lies ahead may change (a pane that was not seen yet, a hidden corner), so
a meetpoint counts only once the robot stands there and has looked again. Input poses are odom_from_base (3,); map,
graph and lines are in the frame local, odom without its drift, see local_pose.py.

Choset, Burdick, Sensor-based exploration: the hierarchical generalized Voronoi graph (IJRR 2000): tracing and homing;
here both follow a line of the local graph instead of a gradient of the distances.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Optional

import numpy as np

from glass_nav.driving import braking, pursuit, velocity
from glass_nav.driving.base_limits import BaseLimits
from glass_nav.driving.edge_tracking import edge_report, following, homing
from glass_nav.driving.edge_tracking.edge_report import Node
from glass_nav.driving.edge_tracking.leg import Leg, line
from glass_nav.driving.edge_tracking.local_graph import LocalGraph
from glass_nav.driving.edge_tracking.local_map import LocalMapParams
from glass_nav.driving.edge_tracking.surroundings import Surroundings
from glass_nav.geometry import angles, se2
from glass_nav.geometry.polyline import Polyline
from glass_nav.sensing.scan import Scan
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams
from glass_nav.topology.observations import Meetpoint, Traversal, refuse_rank
from glass_nav.vocabulary import DriverPhase, Outcome
from glass_nav.world.grid_map import GridMap

_DRIVING = (DriverPhase.SEEKING, DriverPhase.FOLLOWING, DriverPhase.HOMING, DriverPhase.RETURNING)

_TURN_FIRST_RAD = 0.7  # a point further to the side is turned to on the spot
_AT_END_M = 0.02
_MIN_SCANS = 3  # before the first graph
_AT_NODE_M = 0.08  # the robot stands at a node
_ALMOST_M = 0.45  # ... or as near as it gets, if something is in the way
_BLOCKED_S = 4.0


@dataclass(frozen=True)
class EdgeDriverParams:
    """How edges are followed and meetpoints found."""

    limits: BaseLimits = field(default_factory=BaseLimits)
    graph: VoronoiParams = field(default_factory=VoronoiParams)  # as the atlas was built with
    local_map: LocalMapParams = field(default_factory=LocalMapParams)


@dataclass(frozen=True)
class Arrival:
    """The report at a meetpoint."""

    stamp_ns: int  # of the scan that showed it
    odom_from_base: np.ndarray  # (3,) then
    meetpoint: Meetpoint
    traversal: Optional[Traversal]  # None: it was sought, not reached along an edge that began at a meetpoint


@dataclass(frozen=True)
class Progress:
    """The progress of the driver."""

    phase: DriverPhase
    reason: str  # one sentence
    travelled_m: float  # since the last meetpoint
    failure: Optional[Outcome] = None  # NO_GRAPH or BLOCKED if FAILED


class EdgeDriver:
    """see() every scan, ask for a command() at every control step; seek(), leave(), go_back() and stop() say what."""

    def __init__(self, p: EdgeDriverParams = EdgeDriverParams()) -> None:
        self._p = p
        self._near = Surroundings(p.local_map, p.graph)
        self.reset()

    def reset(self) -> None:
        """Start over: odometry was restarted, or the robot was carried."""
        self._near.clear()
        self._velocity = np.zeros(3)
        self._arrival: Optional[Arrival] = None
        self._halted: Optional[Leg] = None  # what resume() goes on with
        self._leg = Leg(DriverPhase.IDLE, "nothing to do", None, 0.0)

    # -- what to do

    def seek(self) -> None:
        """Drive to a meetpoint, having looked around."""
        self._leg = self._new_leg(DriverPhase.SEEKING, "looking around", None)
        self._leg.look_around()

    def leave(self, rank: int) -> None:
        """Follow the edge of that rank from the meetpoint where the robot stands.

        Raises:
            ValueError: it stands at none.
            ObservationError: that has no such edge; nothing is changed.
        """
        node = self._leg.start
        if node is None or self._leg.phase != DriverPhase.ARRIVED:
            raise ValueError(f"the robot is not at a meetpoint that it could leave: the driver is {self._leg.phase}")
        refuse_rank(rank, node.degree)
        self._leg = self._new_leg(DriverPhase.FOLLOWING, f"along edge {rank} of {node.degree}", node)
        self._leg.follow(node, rank)

    def go_back(self) -> None:
        """Return to the meetpoint that the robot left last.

        Raises:
            ValueError: it left none.
        """
        leg, here = self._leg, self._near.pose[:2]
        if leg.start is None or leg.trace is None:
            raise ValueError("the robot has left no meetpoint to which it could return")
        leg.trace.cut_back(here)
        way = np.concatenate([here[None], leg.trace.way_m[::-1]])
        self._leg = self._new_leg(DriverPhase.RETURNING, "back to the meetpoint that it left", leg.start)
        self._leg.way = line(way)

    def stop(self) -> None:
        """Stand, whatever was asked for. resume() goes on with it, seek() begins anew, go_back() returns."""
        self._halt(DriverPhase.IDLE, "stopped")

    def resume(self) -> None:
        """Go on with the edge, or the search for a meetpoint, that stop() or a failure ended.

        Raises:
            ValueError: there is none.
        """
        halted = self._halted
        if self._leg.phase not in (DriverPhase.IDLE, DriverPhase.FAILED) or halted is None:
            raise ValueError(f"nothing was stopped that could be continued: the driver is {self._leg.phase}")
        phase = DriverPhase.SEEKING if halted.trace is None else DriverPhase.FOLLOWING
        self._leg = self._new_leg(phase, "going on", self._leg.start)
        self._leg.trace, self._leg.rank, self._leg.way = halted.trace, halted.rank, halted.way

    # -- what it sees

    def see(self, scan: Scan, odom_from_base: np.ndarray) -> None:
        """Take in a scan, with odometry's pose (3,) at its stamp; in any phase."""
        near = self._near
        near.see(scan, odom_from_base)
        if self._leg.looking and self._stands:
            self._leg.scans.append(scan)
        if self._leg.phase in _DRIVING and self._leg.sweep_rad <= 0.0 and (near.is_due or near.graph is None):
            self._think(near.renew_graph())
        elif near.is_due:
            near.renew_walls()

    def take_arrival(self) -> Optional[Arrival]:
        """The report of a meetpoint, once."""
        arrival, self._arrival = self._arrival, None
        return arrival

    @property
    def progress(self) -> Progress:
        leg = self._leg
        return Progress(leg.phase, leg.reason, 0.0 if leg.trace is None else leg.trace.length_m, leg.failure)

    @property
    def local_grid(self) -> Optional[GridMap]:
        """The last map around the robot, in the frame local; None before the first."""
        return self._near.grid

    @property
    def local_graph(self) -> Optional[LocalGraph]:
        """The last graph, in the frame local; None before the first."""
        return self._near.graph

    @property
    def node(self) -> Optional[Node]:
        """The meetpoint where the robot stands, or which it left last, in the frame local."""
        return self._leg.start

    @property
    def way_m(self) -> np.ndarray:
        """(n, 2) that it drives along, in the frame local; n = 0: none."""
        return np.zeros((0, 2)) if self._leg.way is None else self._leg.way.points

    def local_from_base(self, odom_from_base: np.ndarray) -> np.ndarray:
        """(3,) pose of the robot in the frame of map, graph and line, which is odom without its drift."""
        return self._near.local_from_base(odom_from_base)

    def obstacles_m(self, odom_from_base: np.ndarray) -> np.ndarray:
        """(K, 2) what stands near the robot at that pose (3,), in its frame: the last scan, the walls of the map."""
        return self._near.obstacles_m(self._near.local_from_base(odom_from_base))

    # -- commands

    def command(self, odom_from_base: np.ndarray, dt_s: float) -> np.ndarray:
        """(3,) velocity forward, left [m/s], turn [rad/s] for the next control step.

        Args:
            odom_from_base: (3,) the newest.
            dt_s: since the last command.
        """
        leg, pose = self._leg, self._near.local_from_base(odom_from_base)
        turned = abs(float(angles.wrap(pose[2] - leg.yaw_rad)))
        leg.yaw_rad = float(pose[2])
        wanted = np.zeros(3)
        if leg.phase in _DRIVING:
            if leg.sweep_rad > 0.0:
                leg.sweep_rad -= turned
                if self._near.scans >= _MIN_SCANS:
                    wanted[2] = self._p.limits.max_turn_rad_s
            elif leg.way is not None and not leg.looking:
                wanted = self._along_way(leg.way, pose)
                leg = self._leg  # it may have arrived
                goes_back = leg.phase == DriverPhase.RETURNING or (leg.phase == DriverPhase.FOLLOWING and leg.rank == 0)
                safe = braking.allowed(wanted, self._near.obstacles_m(pose), self._p.limits, creep=goes_back)
                self._note_blocked(wanted, safe, dt_s)
                wanted = safe
        command = velocity.limited(wanted, self._velocity, self._p.limits, dt_s)
        if wanted[0] < command[0]:  # brakes twice as hard as it speeds up
            most = 2.0 * self._p.limits.max_acceleration_m_s2 * dt_s
            command[0] = max(float(wanted[0]), float(self._velocity[0]) - most)
        self._velocity = command
        return command.copy()

    def _along_way(self, way: Polyline, pose: np.ndarray) -> np.ndarray:
        leg, passed_m = self._leg, way.nearest(pose[:2])
        is_homing = leg.phase == DriverPhase.HOMING
        at_node = is_homing and float(np.hypot(*(pose[:2] - leg.target_m))) < _AT_NODE_M
        if at_node or way.length - passed_m < _AT_END_M:
            if is_homing:
                homing.begin_looking(leg)
            elif leg.phase == DriverPhase.RETURNING:
                self._leg = self._new_leg(DriverPhase.ARRIVED, "back at the meetpoint that it left", leg.start)
            return np.zeros(3)
        ahead = se2.transform_points(se2.inverse(pose), way.at(passed_m + following.LOOKAHEAD_M))
        bearing = math.atan2(ahead[1], ahead[0])
        if abs(bearing) > _TURN_FIRST_RAD:
            return pursuit.on_the_spot(bearing, self._p.limits)
        return pursuit.along_arc(ahead, self._p.limits, way.length - passed_m)

    def _note_blocked(self, wanted: np.ndarray, safe: np.ndarray, dt_s: float) -> None:
        leg, here = self._leg, self._near.pose[:2]
        stuck = wanted[0] > 0.02 and safe[0] < 0.03
        leg.blocked_s = leg.blocked_s + dt_s if stuck else 0.0
        if (
            leg.phase == DriverPhase.HOMING
            and leg.blocked_s > 1.0
            and float(np.hypot(*(here - leg.target_m))) < _ALMOST_M
        ):
            homing.begin_looking(leg)
        elif leg.blocked_s > _BLOCKED_S:
            assert leg.way is not None
            remaining_m = leg.way.length - leg.way.nearest(here)
            if leg.phase == DriverPhase.FOLLOWING and remaining_m < _ALMOST_M:
                homing.begin(leg, self._near, leg.way.points[-1], leg.way.points)
                homing.begin_looking(leg)
            else:
                self._fail(
                    Outcome.BLOCKED,
                    f"something is in the way, {remaining_m:.1f} m before the end of what is seen of the edge",
                )

    # -- phases

    @property
    def _stands(self) -> bool:
        return float(np.abs(self._velocity).max()) < 0.02

    def _think(self, graph: LocalGraph) -> None:
        """Decides once for each new graph."""
        leg = self._leg
        if leg.looking:
            if self._stands:
                node = homing.look_again(leg, self._near, graph)
                if node is not None:
                    self._arrive(node)
        elif leg.phase == DriverPhase.HOMING:
            homing.correct_target(leg, self._near, graph)
        elif leg.phase in (DriverPhase.SEEKING, DriverPhase.FOLLOWING):
            failure = following.follow(leg, self._near, graph)
            if failure is not None:
                self._fail(Outcome.NO_GRAPH, failure)

    def _arrive(self, node: Node) -> None:
        near, leg = self._near, self._leg
        assert near.grid is not None
        driven = None
        if leg.trace is not None:
            driven = edge_report.traversal(leg.trace.line_m(node.position_m), leg.rank, near.grid)
        seen = replace(edge_report.meetpoint(node, near.pose, near.stamp_ns), scan=near.scan)
        self._arrival = Arrival(near.stamp_ns, near.pose, seen, driven)
        reason = f"at a meetpoint of degree {node.degree}, {node.r_m:.2f} m from its obstacles"
        self._leg = self._new_leg(DriverPhase.ARRIVED, reason, node)

    def _new_leg(self, phase: DriverPhase, reason: str, start: Optional[Node]) -> Leg:
        return Leg(phase, reason, start, float(self._near.pose[2]))

    def _fail(self, failure: Outcome, reason: str) -> None:
        self._halt(DriverPhase.FAILED, reason)
        self._leg.failure = failure

    def _halt(self, phase: DriverPhase, reason: str) -> None:
        """Stop with this phase and reason; the leg that was being driven is kept so that it can be resumed."""
        leg = self._leg
        if leg.phase in _DRIVING and leg.phase != DriverPhase.RETURNING:
            self._halted = leg
        self._leg = self._new_leg(phase, reason, leg.start)
        self._leg.trace = leg.trace
