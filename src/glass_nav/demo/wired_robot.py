"""A simulated robot whose driver, search and localization are connected as through the topics of the nodes.

Decisions reach the other parts before the next control step, in order. The scan of a
meetpoint is looked up by its stamp, as topology_node does; while the localization is LOCALIZED the driver is given the
scan with glass in it, as by scan_surfaces.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable, Dict, List, Optional

import numpy as np

from glass_nav.driving import decisions
from glass_nav.driving.decisions import Action
from glass_nav.driving.driver import Driver
from glass_nav.driving.driver_params import DriveParams
from glass_nav.driving.edge_tracking.edge_driver import Arrival
from glass_nav.driving.input_watch import Odometry
from glass_nav.driving.place_goals import PlaceGoal
from glass_nav.geometry import se2
from glass_nav.localization.localizer import Estimate, Localizer
from glass_nav.log_line import LogLine
from glass_nav.sensing.scan import Scan
from glass_nav.simulation.simulation import Frame, Simulation
from glass_nav.topology import search_decisions
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search_decisions import SearchStatus
from glass_nav.topology.search_session import SearchSession
from glass_nav.vocabulary import DriverPhase
from glass_nav.world.grid_map import GridMap

CONTROL_S = 0.05
INITIAL_COVARIANCE = np.diag([0.25**2, 0.25**2, 0.17**2])  # as topology_node hands it over
KEPT_SCANS = 50  # for looking up those of meetpoints


class WiredRobot:
    """Call step() until the wanted state is reached; status and figures are read from outside."""

    def __init__(
        self, simulation: Simulation, driver_params: DriveParams, atlas: Atlas, session: SearchSession
    ) -> None:
        """
        Args:
            simulation: of the robot.
            driver_params: of its driver.
            atlas: for goals.
            session: of the search, not started yet.
        """
        self.simulation, self.session = simulation, session
        self.driver = Driver(driver_params, atlas=atlas, now_s=simulation.stamp_ns * 1e-9)
        self.estimate: Optional[Estimate] = None  # of the localization, at the last scan
        self.initial_pose: Optional[np.ndarray] = None  # (3,) that the search found
        self.arrival: Optional[Arrival] = None  # reported last
        self.ends: List[decisions.GoalEnd] = []
        self.failures: List[str] = []  # tasks without a client
        self.collisions = 0  # control steps in which the base stood at an obstacle
        self.on_status: Callable[[SearchStatus], None] = lambda status: None
        self._localizer: Optional[Localizer] = None  # None: not localized yet
        self._map_from_odom: Optional[np.ndarray] = None
        self._scans: Dict[int, Scan] = {}  # by stamp
        self._command = np.zeros(3)
        self._hears: Dict[type, Callable[[Any], None]] = {
            decisions.Command: self._hear_command,
            decisions.TraversalReport: self._hear_traversal,
            decisions.MeetpointReport: self._hear_meetpoint,
            decisions.DriveStatus: self._hear_driver,
            decisions.GoalEnd: self.ends.append,
            search_decisions.SearchStatus: self._hear_search,
            search_decisions.Turn: self._hear_turn,
            search_decisions.InitialPose: self._hear_pose,
            decisions.VisitReport: self._hear_visits,
            decisions.Feedback: lambda _: None,
            LogLine: lambda _: None,
        }

    def wake_up(self, grid_map: GridMap) -> None:
        """Start all nodes; the map is served."""
        self._tell(self.session.start())
        self._tell(self.session.map_served(grid_map, "that of the simulation"))
        self.driver.map_served(grid_map, "that of the simulation")

    def localize(self, localizer: Localizer) -> None:
        """Continue tracking from the pose that the search found."""
        assert self.map_from_base is not None
        localizer.set_pose(self.map_from_base, INITIAL_COVARIANCE)
        self._localizer = localizer

    def restart_search(self) -> None:
        """The next meetpoint begins another search."""
        self._tell(self.session.restart())

    def goto(self, node: int) -> None:
        """Ask the driver for a node of the atlas."""
        self._tell(self.driver.goto_node(PlaceGoal(node)))

    def give_up(self) -> None:
        """Cancel the goal."""
        self._tell(self.driver.preempt(Action.GOTO_NODE))

    @property
    def has_given_up(self) -> bool:
        """Whether the driver waits for help after failed attempts."""
        status = self.driver.status
        return status.phase == DriverPhase.FAILED and not status.task

    def step(self) -> Frame:
        """A scan, and the control steps until the next."""
        frame = self.simulation.look()
        self.driver.at(self._now_s)
        self._scans[frame.scan.stamp_ns] = frame.scan
        if len(self._scans) > KEPT_SCANS:
            del self._scans[min(self._scans)]
        self._tell(self.session.scan(frame.scan, frame.odom_from_base))
        self.driver.see(self._localize(frame), frame.odom_from_base)
        for _ in range(round(self.simulation.scan_period_s / CONTROL_S)):
            self.driver.at(self._now_s)
            odometry = Odometry(self.simulation.stamp_ns, self.simulation.reading.odom_from_base)
            self._command = np.zeros(3)
            self._tell(self.driver.control(odometry, self._map_from_odom, "no scan used yet"))
            self.simulation.move(CONTROL_S, self._command)
            self.collisions += self.simulation.blocked
        return frame

    @property
    def map_from_base(self) -> Optional[np.ndarray]:
        """(3,) pose by the localization; None: unknown."""
        if self._map_from_odom is None:
            return None
        return se2.compose(self._map_from_odom, self.simulation.reading.odom_from_base)

    @property
    def _now_s(self) -> float:
        return self.simulation.stamp_ns * 1e-9

    def _localize(self, frame: Frame) -> Scan:
        """Pass a scan to the localization; returns it as the driver sees it."""
        if self._localizer is None:
            return frame.scan
        self.estimate = estimate = self._localizer.update(frame.scan, frame.odom_from_base)
        self._map_from_odom = se2.compose(estimate.map_from_base, se2.inverse(frame.odom_from_base))
        self.driver.localization_reports(estimate.state, estimate.reason)
        self.driver.surfaces_came()
        if not self.driver.prefers_surfaces:
            return frame.scan
        return replace(frame.scan, ranges_m=estimate.surface_scan.ranges_m)

    # -- what one tells the others

    def _tell(self, decided: "List[Any]") -> None:
        for decision in decided:
            self._hears[type(decision)](decision)

    def _hear_command(self, command: decisions.Command) -> None:
        self._command = command.velocity

    def _hear_traversal(self, report: decisions.TraversalReport) -> None:
        traversal = report.arrival.traversal
        assert traversal is not None
        self._tell(self.session.edge_traversal(traversal, report.arrival.stamp_ns))

    def _hear_meetpoint(self, report: decisions.MeetpointReport) -> None:
        self.arrival = arrival = report.arrival
        scan = self._scans.get(arrival.stamp_ns) if self.session.uses_scans else None
        meetpoint = replace(arrival.meetpoint, odom_from_base=arrival.odom_from_base, scan=scan)
        self._tell(self.session.meetpoint(meetpoint))

    def _hear_visits(self, report: decisions.VisitReport) -> None:
        node, r_m = ([getattr(visit, name) for visit in report.visits] for name in ("node", "r_m"))
        self._tell(self.session.node_visits(np.array(node), np.array(r_m)))

    def _hear_driver(self, status: decisions.DriveStatus) -> None:
        if status.phase == DriverPhase.FAILED:
            self.failures.append(status.reason)

    def _hear_search(self, status: SearchStatus) -> None:
        self.driver.search_reports(status.state)
        self.on_status(status)

    def _hear_turn(self, turn: search_decisions.Turn) -> None:
        self._tell(self.driver.turn_choice(turn.choice.rank, turn.choice.name, turn.stamp_ns))

    def _hear_pose(self, pose: search_decisions.InitialPose) -> None:
        self.initial_pose = pose.map_from_base
        odom_from_base = self.simulation.reading.odom_from_base  # as at the meetpoint, where the robot still stands
        self._map_from_odom = se2.compose(pose.map_from_base, se2.inverse(odom_from_base))
