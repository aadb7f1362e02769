"""The decisions of driver_node: from observations and requests to commands and reports.

Without ROS and without a clock: each method is an event, and returns the decisions that follow from it, in the order
in which they are to be carried out. There is one task at a time. The goal of an action ends the current task. A
turn_choice does not wait; it is followed only if the robot stands at the meetpoint that it answers. Without a task,
the robot drives to a meetpoint by itself if a search needs one.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace
from typing import List, Optional

import numpy as np

from glass_nav.driving.decisions import (
    Action,
    Command,
    Decision,
    DriveStatus,
    Feedback,
    GoalEnd,
    MeetpointReport,
    TraversalReport,
    VisitReport,
)
from glass_nav.driving.driver_params import DriveParams
from glass_nav.driving.edge_names import rank_from_words
from glass_nav.driving.edge_tracking.edge_driver import Arrival, EdgeDriver
from glass_nav.driving.input_watch import InputNames, InputWatch, Odometry
from glass_nav.driving.meetpoint_stay import MeetpointStay
from glass_nav.driving.node_visits import VisitWatch
from glass_nav.driving.place_goals import PlaceGoal, PlaceTasks, TaskTo
from glass_nav.driving.seek_policy import SeekPolicy
from glass_nav.driving.tasks import EdgeTask, Ending, GoTask, Moment, Task
from glass_nav.health import Health, Level
from glass_nav.log_line import LogLine
from glass_nav.sensing.scan import Scan
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import NOT_FOLLOWED
from glass_nav.vocabulary import SEARCH_IS_OVER, DriverPhase, LocalizationState, Outcome, SearchState
from glass_nav.world.grid_map import GridMap

QUIET_S = 0.5  # zeros are sent for so long after a task, then nothing: others may steer
MAX_STEP_S = 0.2  # a control step that came later counts as one of so long
STATUS_PERIOD_S = 0.5
_LEVELS = {
    DriverPhase.FAILED: Level.ERROR,
    DriverPhase.HALTED: Level.ERROR,
    DriverPhase.RECOVERING: Level.WARN,
}
IN_SEARCH = (SearchState.SEARCHING, SearchState.TENTATIVE)


@dataclass
class _Job:
    """The current task and the client that waits for its result."""

    task: Task
    name: str  # in words
    action: Optional[Action] = None  # None: no client waits for a result
    travelled_m: float = 0.0
    halted_since_s: float = math.nan


class Driver:
    """Call at() first at each moment, then the events of it, and control() when that is due."""

    def __init__(
        self,
        p: DriveParams,
        names: InputNames = InputNames(),
        atlas: Optional[Atlas] = None,
        backend: Optional[TaskTo] = None,
        now_s: float = 0.0,
    ) -> None:
        """
        Args:
            p: of the driver.
            names: of the inputs, for people.
            atlas: for goals in its map; None: there is none.
            backend: drives to poses of the map; None: the driver itself does, along the edges of the atlas.
            now_s: the time.
        """
        self._p, self._rules = p, p.rules
        self._edge = EdgeDriver(p.edge)
        self._places = PlaceTasks(p, self._edge, names.map_frame, atlas, backend)
        self._inputs = InputWatch(p.rules, names)
        self._visits = None if atlas is None or not p.rules.report_visits else VisitWatch(atlas)
        self._stay = MeetpointStay()
        self._seeking = SeekPolicy(p.rules.seek_attempts)
        self._search: Optional[SearchState] = None
        self._job: Optional[_Job] = None
        self._said = DriverPhase.IDLE, "nothing is asked for", ""  # phase, reason, task
        self._velocity = np.zeros(3)
        self._quiet_from_s = self._status_s = -math.inf
        self._now_s = self._controlled_s = now_s
        self._decisions: List[Decision] = []

    # -- what others may know

    @property
    def status(self) -> DriveStatus:
        """The present status."""
        phase, reason, task = self._said
        if self._job is None:
            return DriveStatus(phase, reason, task, stamp_ns=self._inputs.scan_ns)
        return DriveStatus(phase, reason, task, self._job.travelled_m, self._job.task.remaining_m, self._inputs.scan_ns)

    @property
    def health(self) -> Health:
        """The entries for /diagnostics."""
        phase, reason, task = self._said
        values = {"task": task, "localization": self._inputs.localization or ""}
        return Health(_LEVELS.get(phase, Level.OK), f"{phase}: {reason}", values)

    @property
    def edge_driver(self) -> EdgeDriver:
        """The edge driver, with the graph around the robot."""
        return self._edge

    @property
    def odom_from_base(self) -> Optional[np.ndarray]:
        """(3,) at the last control step; None: not known yet."""
        return self._inputs.odom_from_base

    @property
    def route_m(self) -> Optional[np.ndarray]:
        """(M, 2) of the map, along which the robot drives to a goal; None: along none."""
        task = None if self._job is None else self._job.task
        return task.route.polyline_m if isinstance(task, GoTask) and task.route is not None else None

    @property
    def prefers_surfaces(self) -> bool:
        """Whether scan_surfaces is to be used in place of scan now."""
        return self._inputs.prefers_surfaces(self._now_s)

    @property
    def is_control_due(self) -> bool:
        """Whether the next control step is."""
        return self._now_s - self._controlled_s >= 1.0 / self._rules.control_rate_hz - 1e-6

    # -- events

    def at(self, now_s: float) -> None:
        """Set the time; if it jumped back, call reset() next."""
        self._now_s = now_s

    def reset(self, why: str) -> List[Decision]:
        """Start over: time jumped back, and so do odometry and stamps."""
        self._log(f"{why}: the driver restarts", logging.WARNING)
        if self._job is not None:
            self._finish(self._job, Ending(Outcome.RESET, why))
        self._edge.reset()
        self._stay.reset()
        self._inputs.reset()
        self._seeking.reset()
        self._controlled_s, self._quiet_from_s = self._now_s, self._now_s + QUIET_S
        return self._decided()

    def surfaces_came(self) -> None:
        """A scan of the surfaces came, used or not."""
        self._inputs.take_surfaces(self._now_s)

    def see(self, scan: Scan, odom_from_base: np.ndarray) -> bool:
        """A scan came, with odometry's pose (3,) at its stamp. Returns whether it is used: an older one is not."""
        if not self._inputs.take_scan(scan.stamp_ns):
            return False
        self._edge.see(scan, odom_from_base)
        if self._visits is not None and self._job is not None and isinstance(self._job.task, GoTask):
            map_from_base = self._inputs.map_from_base_at(odom_from_base)
            if map_from_base is not None and self._inputs.localization == LocalizationState.LOCALIZED:
                self._visits.see(scan, odom_from_base, map_from_base)
        return True

    def search_reports(self, state: SearchState) -> List[Decision]:
        """The search in the atlas reports its state; the robot does not drive for a search without an atlas."""
        if state == SearchState.WAITING and self._search != SearchState.WAITING:
            self._seeking.succeeds()  # a new request
        began, self._search = state != self._search, state
        if began and self._search_is(SearchState.NO_ATLAS):
            why = "the search has no atlas of the map that is served"
            self._log(f"{why}: the robot does not drive for it", logging.ERROR)
            if self._job is None:
                self._say(DriverPhase.FAILED, why)
            elif self._job.action is None:
                self._finish(self._job, Ending(Outcome.REFUSED, why))
        elif began and self._search_is(*SEARCH_IS_OVER) and self._job is not None and self._job.action is None:
            self._finish(self._job, Ending(Outcome.PREEMPTED, f"the search is over: {state}"))
        return self._decided()

    def localization_reports(self, state: LocalizationState, reason: str) -> None:
        """The localization reports its state."""
        self._inputs.take_localization(state, reason, self._now_s)

    def map_served(self, grid_map: GridMap, name: str) -> List[Decision]:
        """A map is served; name is for people, as "that of topic /map".

        Raises:
            AtlasError: the atlas is of another map; goals in it are refused from now on.
        """
        warning = self._places.map_served(grid_map, name)
        if warning:
            self._log(f"the atlas {warning}", logging.WARNING)
        return self._decided()

    def turn_choice(self, rank: int, name: str, stamp_ns: int) -> List[Decision]:
        """The search says by which edge to leave the meetpoint of a stamp; 0: where the robot stands.

        Args:
            rank: of the edge.
            name: of the turn; may be empty.
            stamp_ns: of the meetpoint that it answers.
        """
        if not self._rules.follow_turn_choice:
            return []
        words = f"turn_choice {name or rank}"
        fault = self._turn_fault(stamp_ns)
        if fault is not None:
            self._log(f"{words} not used: {fault}", logging.WARNING, often=True)
            return self._decided()
        try:
            task = self._edge_task(rank, may_choose=True)
        except ValueError as err:
            self._log(f"{words} refused: {err}", logging.WARNING, often=True)
        else:
            self._begin(_Job(task, words))
        return self._decided()

    def traverse_edge(self, edge: str) -> List[Decision]:
        """A goal of the action: an edge in words, or any meetpoint if empty. Its server ended the goal before it."""
        action, name = Action.TRAVERSE_EDGE, f"traverse_edge {edge}".strip()
        self._make_way(action)
        try:
            rank: Optional[int] = None
            if edge.strip():
                arrival = self._arrival
                if arrival is None:
                    why = "the robot is not at a meetpoint: a goal without edge drives to one"
                    return self._refused(action, name, Ending(Outcome.NOT_AT_MEETPOINT, why))
                rank = rank_from_words(edge, arrival.meetpoint.degree)
            task = self._edge_task(rank)
        except ValueError as err:
            return self._refused(action, name, Ending(Outcome.REFUSED, str(err)))
        self._begin(_Job(task, name, action))
        return self._decided()

    def goto_node(self, goal: PlaceGoal) -> List[Decision]:
        """A goal of the action: a place in the map. Its server ended the goal before it."""
        action, name = Action.GOTO_NODE, f"goto_node {goal.name}"
        self._make_way(action)
        no_pose = self._inputs.no_pose(self._now_s)
        if no_pose and not self._inputs.localization_is_silent(self._now_s):  # one that fell silent is waited for
            why = f"the goal needs a pose in the map: {no_pose}"
            return self._refused(action, name, Ending(Outcome.NOT_LOCALIZED, why))
        try:
            task = self._places.task(goal, self._inputs.map_from_base)
        except ValueError as err:
            return self._refused(action, name, Ending(Outcome.REFUSED, str(err)))
        self._edge.stop()
        self._stay.end()
        self._begin(_Job(task, name, action))
        return self._decided()

    def preempt(self, action: Action) -> List[Decision]:
        """Ends the goal of this action, because its client has cancelled it."""
        if self._job is not None and self._job.action == action:
            self._finish(self._job, Ending(Outcome.PREEMPTED, "cancelled: the robot stands"))
        return self._decided()

    def control(
        self, odometry: Optional[Odometry], map_from_odom: Optional[np.ndarray], no_scan: str
    ) -> List[Decision]:
        """The next control step.

        Args:
            odometry: the newest; None: it cannot be read now.
            map_from_odom: (3,) the newest; None: not known now.
            no_scan: why no scan could be used, in case none was yet.
        """
        dt_s = min(max(self._now_s - self._controlled_s, 1e-3), MAX_STEP_S)
        self._controlled_s = self._now_s
        moved_m = self._inputs.take_poses(odometry, map_from_odom)
        trouble = self._inputs.no_input(self._now_s, no_scan)
        if self._job is not None:
            self._job.travelled_m += moved_m
        elif trouble is None:
            self._decide_alone()
        elif self._rules.seek_at_start and not self._seeking.sought:
            self._say(DriverPhase.HALTED, trouble)
        if self._job is not None:
            self._step(self._job, trouble, dt_s)
        elif self._now_s < self._quiet_from_s:
            self._command(np.zeros(3))
        if self._job is not None and not 0.0 <= self._now_s - self._status_s < STATUS_PERIOD_S:
            self._status_s = self._now_s
            self._send_status()
        return self._decided()

    # -- which turn is obeyed, and who makes way

    @property
    def _arrival(self) -> Optional[Arrival]:
        """The meetpoint at which the robot stands; None if it stands elsewhere."""
        return self._stay.arrival if self._edge.progress.phase == DriverPhase.ARRIVED else None

    def _turn_fault(self, stamp_ns: int) -> Optional[str]:
        if self._job is not None:
            return f"{self._job.name} is on"
        arrival = self._arrival
        if arrival is None:
            return "the robot is not at a meetpoint"
        if stamp_ns in (0, arrival.stamp_ns):
            return None
        return (
            f"it answers the meetpoint of {stamp_ns * 1e-9:.3f} s, the robot stands at that of "
            f"{arrival.stamp_ns * 1e-9:.3f} s"
        )

    def _edge_task(self, rank: Optional[int], may_choose: bool = False) -> EdgeTask:
        return EdgeTask(self._edge, self._p.recovery, self._p.edge.limits, rank, may_choose)

    def _make_way(self, action: Action) -> None:
        """Ends the current task for a new goal."""
        if self._job is not None:
            if self._job.action not in (None, action):
                self._finish(self._job, Ending(Outcome.PREEMPTED, "another goal took over"))
            else:
                self._job.task.cancel()
                self._job = None
        self._stand()

    def _refused(self, action: Action, name: str, ending: Ending) -> List[Decision]:
        self._log(f"{name} refused: {ending.reason}", logging.WARNING)
        self._end_goal(action, ending)
        return self._decided()

    # -- how a task begins, goes on and ends

    def _begin(self, job: _Job) -> None:
        self._job = job
        self._log(f"{job.name} begins")
        self._say(job.task.phase, job.task.reason, job.name)

    def _step(self, job: _Job, trouble: Optional[str], dt_s: float) -> None:
        """The task's next command, or zero velocity while there is trouble."""
        outcome = Outcome.NO_INPUT
        if trouble is None and job.task.needs_pose:
            trouble, outcome = self._inputs.no_pose(self._now_s), Outcome.NOT_LOCALIZED
        if trouble is not None:
            self._halt(job, Ending(outcome, trouble))
            return
        job.halted_since_s = math.nan
        assert self._inputs.odom_from_base is not None
        map_from_base = self._inputs.map_from_base if job.task.needs_pose else None
        command = job.task.step(Moment(self._inputs.odom_from_base, map_from_base, self._velocity, dt_s))
        if job.task.ending is not None:
            self._finish(job, job.task.ending)
            return
        if job.task.steers:
            self._command(command)
        self._say(job.task.phase, job.task.reason, job.name)

    def _halt(self, job: _Job, ending: Ending) -> None:
        """Stand until the trouble is over; if that takes too long, the client gets a result."""
        job.task.hold()
        if job.task.steers:
            self._command(np.zeros(3))
        if math.isnan(job.halted_since_s):
            job.halted_since_s = self._now_s
            self._log(f"{job.name} halts: {ending.reason}", logging.WARNING, often=True)
        self._say(DriverPhase.HALTED, ending.reason, job.name)
        halted_s = self._now_s - job.halted_since_s
        if job.action is not None and halted_s > self._rules.patience_s:
            self._finish(job, Ending(ending.outcome, f"{ending.reason}, for {halted_s:.0f} s"))

    def _finish(self, job: _Job, ending: Ending) -> None:
        """End the task: stop the robot and send the client its result."""
        self._job = None
        arrival = job.task.arrival if isinstance(job.task, EdgeTask) else None
        if ending.outcome != Outcome.SUCCEEDED:
            job.task.cancel()
        self._stand()
        if arrival is not None:
            self._arrive(arrival)
        self._log(f"{job.name}: {ending.outcome}, {ending.reason}")
        if ending.outcome == Outcome.SUCCEEDED:
            self._say(DriverPhase.IDLE if arrival is None else DriverPhase.ARRIVED, ending.reason)
        elif ending.outcome == Outcome.PREEMPTED:
            self._say(DriverPhase.IDLE, f"{job.name}: {ending.reason}")
        else:
            if job.action is None:
                self._seeking.fails()
            else:
                self._seeking.leave_to_others()
            self._say(DriverPhase.FAILED, f"{job.name}: {ending.reason}")
        if job.action is not None:
            self._end_goal(job.action, ending, job.travelled_m, arrival)
        visits = [] if self._visits is None else self._visits.take()
        if visits:
            self._decisions.append(VisitReport(tuple(visits), self._inputs.scan_ns))

    def _end_goal(
        self, action: Action, ending: Ending, travelled_m: float = 0.0, arrival: Optional[Arrival] = None
    ) -> None:
        odometry = self._inputs.odometry
        stamp_ns = 0 if odometry is None else odometry.stamp_ns
        self._decisions.append(GoalEnd(action, ending, travelled_m, arrival, self._inputs.map_from_base, stamp_ns))

    # -- meetpoints, and what the robot does alone

    def _arrive(self, arrival: Arrival) -> None:
        """Report a meetpoint, and the edge to it."""
        self._stay.begin(arrival, self._inputs.odom_from_base)
        self._seeking.succeeds()
        if arrival.traversal is not None:
            self._decisions.append(TraversalReport(arrival))
        elif self._search_is(*IN_SEARCH):
            self._log("the robot did not come along one edge: the search continues by dead reckoning", logging.WARNING)
            self._decisions.append(TraversalReport(replace(arrival, traversal=NOT_FOLLOWED)))
        self._report(arrival)

    def _report(self, arrival: Arrival) -> None:
        self._decisions.append(MeetpointReport(arrival))
        self._stay.reported(self._now_s)

    def _search_is(self, *states: SearchState) -> bool:
        """Whether the robot drives for a search that is in one of these states."""
        return self._rules.follow_turn_choice and self._search in states

    def _decide_alone(self) -> None:
        """Choose a task without a client: seek a meetpoint if a search waits for one, or if the last edge failed."""
        waits = self._search_is(SearchState.WAITING)
        if self._stay.was_left(self._inputs.odom_from_base):
            self._edge.stop()
            self._stay.end()
            self._say(DriverPhase.IDLE, "the robot was moved away from its meetpoint")
        arrival = self._arrival
        if arrival is not None:
            if waits and self._stay.is_report_due(self._now_s):
                self._report(arrival)
        elif self._search_is(SearchState.NO_ATLAS):
            return
        elif self._rules.seek_at_start and self._seeking.is_due(waits, self._search_is(*IN_SEARCH)):
            self._seeking.seeks()
            self._begin(_Job(self._edge_task(None), "~seek_at_start"))

    # -- what goes out

    def _decided(self) -> List[Decision]:
        decided, self._decisions = self._decisions, []
        return decided

    def _log(self, text: str, level: int = logging.INFO, often: bool = False) -> None:
        self._decisions.append(LogLine(text, level, often))

    def _stand(self) -> None:
        """Commands zero velocity."""
        self._command(np.zeros(3))
        self._quiet_from_s = self._now_s + QUIET_S

    def _command(self, velocity: np.ndarray) -> None:
        self._velocity = velocity
        self._decisions.append(Command(velocity))

    def _say(self, phase: DriverPhase, reason: str, task: str = "") -> None:
        """Set phase, reason and task, and send the status if they changed; during a task, not for a new reason alone."""
        before_phase, before_reason, before_task = self._said
        self._said = phase, reason, task
        if before_phase != phase or before_task != task or (self._job is None and before_reason != reason):
            self._send_status()

    def _send_status(self) -> None:
        self._decisions.append(self.status)
        if self._job is not None and self._job.action is not None:
            self._decisions.append(Feedback(self._job.action, self.status))
