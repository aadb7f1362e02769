"""The tasks of the driver: along an edge, or to a goal in the map. A command at each step, then an outcome.

Recovery is part of a task: if something is in the way, the robot waits, backs off, turns in place and drives around
it, and each step can be cancelled. Velocities (3,) forward, left [m/s], turn [rad/s].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Protocol, Set

import numpy as np

from glass_nav.driving import braking, recovery, velocity
from glass_nav.driving.base_limits import BaseLimits
from glass_nav.driving.edge_tracking.edge_driver import Arrival, EdgeDriver
from glass_nav.driving.recovery import Recovery, RecoveryParams, Stall
from glass_nav.driving.route import Route, RouteError, RoutePlanner
from glass_nav.driving.route_follower import RouteFollower, RouteFollowerParams
from glass_nav.topology.observations import turn_name
from glass_nav.vocabulary import DriverPhase, Outcome

HELD = "the robot makes no progress; an obstacle that the lidar does not see may block it"
BLOCKED_S = 3.0  # braked to a standstill for so long
OFF_ROUTE_M = 0.6  # then there is another route
STANDSTILL_M_S = 0.03


@dataclass(frozen=True)
class Moment:
    """The inputs of a control step."""

    odom_from_base: np.ndarray  # (3,)
    map_from_base: Optional[np.ndarray]  # (3,); None: not localized
    last_command: np.ndarray  # (3,)
    dt_s: float  # since then


@dataclass(frozen=True)
class Ending:
    """How a task ended, and why."""

    outcome: Outcome
    reason: str  # one sentence


class Task(Protocol):
    """A task of the driver; it moves the robot only in step()."""

    needs_pose: bool  # in the map
    steers: bool  # its commands go to the base; False: another driver's do
    ending: Optional[Ending]  # None: it goes on

    def step(self, now: Moment) -> np.ndarray:
        """(3,) the command of this control step; zero once there is an outcome."""

    def hold(self) -> None:
        """There is no step now; whoever else drives is to stop until the next one."""

    def cancel(self) -> None:
        """Ends the task."""

    @property
    def phase(self) -> DriverPhase:
        """GOING, RECOVERING, or a phase of EdgeDriver."""

    @property
    def reason(self) -> str:
        """The reason in one sentence."""

    @property
    def remaining_m(self) -> float:
        """Remaining distance to the goal; NaN: unknown."""


class EdgeTask:
    """Along an edge from the meetpoint where the robot stands, or to any meetpoint."""

    needs_pose, steers = False, True

    def __init__(
        self,
        driver: EdgeDriver,
        p: RecoveryParams,
        limits: BaseLimits,
        rank: Optional[int] = None,
        may_choose: bool = False,
    ) -> None:
        """
        Args:
            driver: asked at once to seek or to leave.
            p: of the recovery.
            limits: of the base.
            rank: of the edge; None: seek.
            may_choose: if the edge is blocked, another one will do.

        Raises:
            ObservationError: the meetpoint has no such edge.
            ValueError: the robot stands at none.
        """
        self._driver, self._limits = driver, limits
        self._recovery, self._stall = Recovery(p, limits), Stall()
        self._rank, self._may_choose = rank, may_choose
        self._tried: Set[int] = set() if rank is None else {rank}
        self._returning = False
        self._recovery_reason = ""
        self.arrival: Optional[Arrival] = None
        self.ending: Optional[Ending] = None
        driver.take_arrival()  # of before
        if rank is None:
            driver.seek()
        else:
            driver.leave(rank)

    @property
    def phase(self) -> DriverPhase:
        return DriverPhase.RECOVERING if self._recovery.is_on else self._driver.progress.phase

    @property
    def reason(self) -> str:
        return self._recovery_reason if self._recovery.is_on else self._driver.progress.reason

    @property
    def remaining_m(self) -> float:
        return math.nan

    def hold(self) -> None:
        """The driver's own commands stop the robot."""

    def cancel(self) -> None:
        self._recovery.cancel()
        self._driver.stop()

    def step(self, now: Moment) -> np.ndarray:
        """(3,) the command of this control step."""
        if self.ending is not None:
            return np.zeros(3)
        if self._recovery.is_on:
            return self._recover(now)
        if self._stall.is_on(now.last_command, now.odom_from_base, now.dt_s):
            self._driver.stop()
            self._recovery.begin(HELD, now.odom_from_base)
            return self._recover(now)
        command = self._driver.command(now.odom_from_base, now.dt_s)
        progress = self._driver.progress
        if progress.phase == DriverPhase.FAILED:
            self._recovery.begin(progress.reason, now.odom_from_base)
            return self._recover(now)
        if progress.phase == DriverPhase.ARRIVED:
            self._arrive(progress.reason)
        return command

    def _arrive(self, reason: str) -> None:
        if not self._returning:
            self.arrival = self._driver.take_arrival()
            self.ending = Ending(Outcome.SUCCEEDED, reason)
            return
        self._returning = False
        node = self._driver.node
        degree = 0 if node is None else node.degree
        left = [rank for rank in [*range(1, degree), 0] if rank not in self._tried]
        if self._may_choose and left:
            self._rank = left[0]
            self._tried.add(left[0])
            self._driver.leave(left[0])
        else:
            name = turn_name(self._rank or 0, max(degree, 1))
            self.ending = Ending(Outcome.BLOCKED, f"edge {name} is blocked; it went back to the meetpoint")

    def _recover(self, now: Moment) -> np.ndarray:
        self._stall.clear()
        step = self._recovery.step(now.odom_from_base, now.dt_s)
        self._recovery_reason = step.reason
        if step.name in recovery.MOVES:
            safe = braking.allowed(step.command, self._driver.obstacles_m(now.odom_from_base), self._limits)
            return velocity.limited(safe, now.last_command, self._limits, now.dt_s)
        if step.name == recovery.ABORT:
            failure = self._driver.progress.failure
            self.ending = Ending(Outcome.NO_GRAPH if failure == Outcome.NO_GRAPH else Outcome.BLOCKED, step.reason)
        elif self._rank is None:
            self._driver.seek()
        elif step.name == recovery.RETRY:
            self._driver.resume()
        else:
            self._returning = True
            self._driver.go_back()
        return np.zeros(3)


class GoTask:
    """Drives to a node of the atlas, or to a pose of its map, along edges."""

    needs_pose, steers = True, True

    def __init__(
        self,
        planner: RoutePlanner,
        driver: EdgeDriver,
        follower: RouteFollowerParams,
        p: RecoveryParams,
        limits: BaseLimits,
        goal: "int | np.ndarray",
        final_yaw_rad: Optional[float] = None,
    ) -> None:
        """
        Args:
            planner: of the atlas.
            driver: that sees the obstacles.
            follower: how routes are followed.
            p: of the recovery.
            limits: of the base.
            goal: a node, or a point (2,) of the map.
            final_yaw_rad: to stand with; None: as it comes.
        """
        self._planner, self._driver, self._follower_params, self._limits = planner, driver, follower, limits
        self._recovery, self._stall = Recovery(p, limits), Stall()
        self._goal, self._final_yaw_rad = goal, final_yaw_rad
        self._avoided: Set[int] = set()
        self._follower: Optional[RouteFollower] = None
        self._stopped_s = 0.0
        self._recovery_reason = ""
        self.route: Optional[Route] = None
        self.ending: Optional[Ending] = None

    @property
    def phase(self) -> DriverPhase:
        return DriverPhase.RECOVERING if self._recovery.is_on else DriverPhase.GOING

    @property
    def reason(self) -> str:
        if self._recovery.is_on:
            return self._recovery_reason
        if self.route is None:
            return "looking for a path"
        return f"along {len(self.route.darts)} edges, {self.remaining_m:.1f} of {self.route.length_m:.1f} m to go"

    @property
    def remaining_m(self) -> float:
        return math.nan if self._follower is None else self._follower.remaining_m

    def hold(self) -> None:
        """The driver's own commands stop the robot."""

    def cancel(self) -> None:
        self._recovery.cancel()

    def step(self, now: Moment) -> np.ndarray:
        """(3,) the command of this control step."""
        if self.ending is not None or now.map_from_base is None:
            return np.zeros(3)
        obstacles_m = self._driver.obstacles_m(now.odom_from_base)
        if self._recovery.is_on:
            return self._recover(now, obstacles_m)
        if self._follower is None or self._follower.off_route_m > OFF_ROUTE_M:
            self._plan(now.map_from_base)
            if self._follower is None:
                return np.zeros(3)
        if self._stall.is_on(now.last_command, now.odom_from_base, now.dt_s):
            self._recovery.begin(HELD, now.odom_from_base)
            return self._recover(now, obstacles_m)
        wanted = self._follower.command(now.map_from_base)
        if self._follower.done:
            self.ending = Ending(Outcome.SUCCEEDED, "it stands at the goal")
            return np.zeros(3)
        safe = braking.allowed(wanted, obstacles_m, self._limits)
        stuck = wanted[0] > STANDSTILL_M_S >= safe[0]
        self._stopped_s = self._stopped_s + now.dt_s if stuck else 0.0
        if self._stopped_s > BLOCKED_S:
            self._stopped_s = 0.0
            self._recovery.begin(
                f"something is in the way, {self.remaining_m:.1f} m before the goal", now.odom_from_base
            )
            return self._recover(now, obstacles_m)
        command = velocity.limited(safe, now.last_command, self._limits, now.dt_s)
        command[0] = min(
            command[0], max(safe[0], now.last_command[0] - 2.0 * self._limits.max_acceleration_m_s2 * now.dt_s)
        )  # what braking asks for comes first
        return command

    def _plan(self, map_from_base: np.ndarray) -> None:
        self._follower, self.route = None, None
        try:
            if isinstance(self._goal, int):
                self.route = self._planner.to_node(map_from_base[:2], self._goal, self._avoided)
            else:
                self.route = self._planner.to_point(map_from_base[:2], self._goal, self._avoided)
        except RouteError as err:
            blocked = f", without the {len(self._avoided)} that are blocked" if self._avoided else ""
            self.ending = Ending(Outcome.BLOCKED if self._avoided else Outcome.NO_WAY, f"{err}{blocked}")
            return
        self._follower = RouteFollower(self.route.polyline_m, self._limits, self._follower_params, self._final_yaw_rad)

    def _recover(self, now: Moment, obstacles_m: np.ndarray) -> np.ndarray:
        self._stall.clear()
        step = self._recovery.step(now.odom_from_base, now.dt_s)
        self._recovery_reason = step.reason
        if step.name in recovery.MOVES:
            safe = braking.allowed(step.command, obstacles_m, self._limits)
            return velocity.limited(safe, now.last_command, self._limits, now.dt_s)
        if step.name == recovery.ABORT:
            self.ending = Ending(Outcome.BLOCKED, step.reason)
            return np.zeros(3)
        if step.name == recovery.NEXT_CHOICE and now.map_from_base is not None and self.route is not None:
            edge = self._planner.nearest_edge(now.map_from_base[:2], self.route.darts)
            if edge is None:
                self._recovery.no_other_choice()
            else:
                self._avoided.add(edge)
        self._follower = None
        return np.zeros(3)
