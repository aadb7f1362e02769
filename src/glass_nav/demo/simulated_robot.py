"""A simulated robot for the wake-up demo: driver, search and localization in one process, in lock step.

Each listen() is one scan and the control steps until the next, so the same seed gives the same drive and the same
figures, however fast the machine is.
"""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np

from glass_nav.demo.reports import Candidates, Reports, SearchNews
from glass_nav.demo.wake_up_demo import Arrival
from glass_nav.demo.wired_robot import WiredRobot
from glass_nav.driving.driver_params import DriveParams
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.simulation.simulation import Simulation
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.search_decisions import SearchStatus
from glass_nav.topology.search_session import SearchSession
from glass_nav.topology.session_params import SessionParams
from glass_nav.world.grid_map import GridMap


class SimulatedRobot:
    """The DemoRobot of a simulation; its reports are kept in `reports`."""

    def __init__(
        self,
        simulation: Simulation,
        grid_map: GridMap,
        atlas: Atlas,
        seed: int,
        say: Callable[[str], None],
        search: SearchParams = SearchParams(),
    ) -> None:
        """
        Args:
            simulation: of the robot, where it wakes up.
            grid_map: that it is given.
            atlas: that it is given.
            seed: of the particle filter.
            say: prints a line for the user.
            search: how it is done.
        """
        self.reports = Reports()
        self.reports.grid_map = grid_map
        self._simulation, self._atlas = simulation, atlas
        self._localizer = Localizer(LocalizerParams(), grid_map, np.random.default_rng([seed, 1]))
        session = SearchSession(lambda: (atlas.name, atlas), SessionParams(), search)
        self._robot = WiredRobot(simulation, DriveParams(), atlas, session)
        self._robot.on_status = self._hear_search
        self._say = say
        self._ended = 0  # goals, when the last one began
        self._robot.wake_up(grid_map)

    def listen(self) -> None:
        """Simulates until the next scan, and processes it."""
        robot, reports = self._robot, self.reports
        frame = robot.step()
        stamp_ns = frame.scan.stamp_ns
        reports.truth[stamp_ns] = frame.map_from_base
        if robot.initial_pose is not None and reports.initial_pose is None:
            reports.initial_pose = robot.session.status.stamp_ns, robot.initial_pose
            robot.localize(self._localizer)
        if robot.estimate is not None:
            reports.poses[stamp_ns] = robot.estimate.map_from_base
            reports.localization = robot.estimate.state

    def is_ending(self) -> bool:
        """Never: it has all the time it needs."""
        return False

    def wall_s(self) -> float:
        """The simulated time: nothing here waits for a wall clock."""
        return self._simulation.stamp_ns * 1e-9

    def say(self, line: str) -> None:
        """Prints a line for the user."""
        self._say(line)

    def restart_search(self) -> str:
        """Begin another search."""
        self._robot.restart_search()
        return ""

    def takes_goals(self) -> bool:
        """The driver is there."""
        return True

    def go_to(self, node: int) -> None:
        """Send it there."""
        self._ended = len(self._robot.ends)
        self._robot.goto(node)

    def arrival(self) -> Optional[Arrival]:
        """How the last goal ended; None while it drives."""
        if len(self._robot.ends) == self._ended:
            return None
        end = self._robot.ends[-1]
        return Arrival(end.ending.outcome, end.ending.reason, end.travelled_m)

    def stop(self) -> None:
        """Cancel the last goal."""
        self._robot.give_up()

    def _hear_search(self, status: SearchStatus) -> None:
        reports, estimate, arrival = self.reports, status.estimate, self._robot.arrival
        if estimate is not None and arrival is not None and arrival.stamp_ns == status.stamp_ns:
            reports.meetpoints[status.stamp_ns] = arrival.meetpoint
            if arrival.traversal is not None:
                reports.traversals[status.stamp_ns] = arrival.traversal
        if estimate is not None:
            dart = estimate.dart[: len(status.poses)]
            reports.candidates[status.stamp_ns] = Candidates(
                len(estimate.dart), self._atlas.darts.node[dart].tolist(), (dart >> 1).tolist(), status.poses
            )
        depth, count = (0, 0) if estimate is None else (estimate.depth, len(estimate.dart))
        turn = estimate.choice.name if estimate is not None and estimate.choice else ""
        reports.take_search(SearchNews(status.stamp_ns, status.state, status.reason, depth, count, turn))
