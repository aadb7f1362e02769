"""A robot that wakes up: its search row by row, whether the place is right, a tour, and how well it was tracked.

The robot finds its place without the demo, which only asks for another search where one ends LOST, and for the nodes of
the tour. This file is the script of the demo; who runs it gives it the robot, as DemoRobot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, List, Optional, Protocol

import numpy as np

from glass_nav.demo import tour
from glass_nav.demo.reports import Reports, SearchNews
from glass_nav.evaluation.metrics import pose_errors
from glass_nav.evaluation.plots import wake_up_picture
from glass_nav.evaluation.plots.wake_up_picture import Depth, WakeUpStory
from glass_nav.geometry import angles, polyline
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import turn_name
from glass_nav.vocabulary import SEARCH_IS_OVER, LocalizationState, Outcome, SearchState

SEARCH_ENDED = (*SEARCH_IS_OVER, SearchState.NO_ATLAS)  # nothing more will come
RIGHT_M, RIGHT_RAD = 0.5, 0.35  # a pose that is handed over so near is right
REQUESTS = 3  # for a node, while the driver has no status of the localization yet
LISTED = 8  # candidates in a row
ROW_LIMIT_S = 2.0  # of the wall clock, for the reports that belong to a row
RESTART_LIMIT_S = 10.0  # of the wall clock
POSE_LIMIT_S = 5.0  # of the wall clock, for the initial pose
LOCALIZATION_LIMIT_S = 60.0  # simulated


@dataclass(frozen=True)
class WakeUpDemoParams:
    """Private parameters of the node wakeup_demo."""

    atlas: str = ""  # of the building
    picture: str = ""  # file of the picture; empty: none
    searches: int = 3  # at most; a robot that is LOST begins another one where it stands
    tour: int = 4  # nodes to be driven to
    seed: int = 0  # of which
    search_limit_s: float = 900.0  # simulated, for one search
    tour_limit_s: float = 300.0  # simulated, for each node
    start_limit_s: float = 60.0  # of the wall clock, until the first messages

    def __post_init__(self) -> None:
        if not self.atlas:
            raise ValueError("~atlas must be a file, a folder or the name of a shipped atlas, got ''")
        if self.tour < 0 or self.seed < 0:
            raise ValueError(f"~tour and ~seed must be >= 0, got {self.tour} and {self.seed}")
        if self.searches < 1:
            raise ValueError(f"~searches must be >= 1, got {self.searches}")
        for name in ("search_limit_s", "tour_limit_s", "start_limit_s"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be > 0 and finite, got {getattr(self, name)}")


@dataclass(frozen=True)
class Arrival:
    """How a request for a node ended."""

    outcome: Outcome
    reason: str
    travelled_m: float


class DemoRobot(Protocol):
    """The robot and the user."""

    def listen(self) -> None:
        """Wait a moment, then store new messages in Reports."""

    def is_ending(self) -> bool:
        """Whether the demo is to stop at once."""

    def wall_s(self) -> float:
        """The wall clock."""

    def say(self, line: str) -> None:
        """Print a line for the user."""

    def restart_search(self) -> str:
        """Why it was not restarted; "" if it was."""

    def takes_goals(self) -> bool:
        """Whether it can be sent to nodes."""

    def go_to(self, node: int) -> None:
        """Send it there."""

    def arrival(self) -> Optional[Arrival]:
        """How the last go_to() ended; None while it drives."""

    def stop(self) -> None:
        """Cancel the last go_to()."""


class WakeUpDemo:
    """run() once."""

    def __init__(self, atlas: Atlas, p: WakeUpDemoParams, reports: Reports, robot: DemoRobot) -> None:
        self._atlas, self._p = atlas, p
        self._reports, self._robot = reports, robot
        self._depths: List[Depth] = []
        self._degree_before = 0
        self._confirmed_ns = 0

    def run(self) -> bool:
        """Whether the place was right and the whole tour was driven."""
        reports = self._reports
        if not self._wait(lambda: bool(reports.truth) and reports.grid_map is not None, wall_s=self._p.start_limit_s):
            self._robot.say("no messages received: is launch/wakeup.launch running?")
            return False
        x, y, yaw = reports.truth[min(reports.truth)]
        self._robot.say(
            f"wakes up at x {x:.2f} m, y {y:.2f} m, yaw {math.degrees(yaw):.0f} degrees, which the robot does not know"
        )
        found = self._search()
        if found is None:
            self._draw("still searching")
            return False
        toured = self._drive_tour(found) if self._is_right(found) else False
        self._draw(found.state)
        return toured

    # -- the search

    def _search(self) -> Optional[SearchNews]:
        """How the last search ended; None if it did not."""
        for searches_left in reversed(range(self._p.searches)):
            if not self._wait(lambda: self._state in SEARCH_ENDED, simulated_s=self._p.search_limit_s):
                if not self._robot.is_ending():
                    self._robot.say(f"the search did not end within {self._p.search_limit_s:g} s")
                return None
            if self._state != SearchState.LOST or not searches_left or not self._search_again():
                break
        return self._reports.search

    @property
    def _state(self) -> Optional[SearchState]:
        return None if self._reports.search is None else self._reports.search.state

    def _search_again(self) -> bool:
        """Begin another search at the present meetpoint; whether one began."""
        why_not = self._robot.restart_search()
        if why_not:
            self._robot.say(f"no new search: {why_not}")
            return False
        if not self._wait(lambda: self._state != SearchState.LOST, wall_s=RESTART_LIMIT_S):
            return False
        self._robot.say("LOST: a new search starts where the robot stands")
        return True

    def _is_right(self, found: SearchNews) -> bool:
        """Whether the search ended with a place, and it is the true one."""
        if found.state != SearchState.CONFIRMED:
            self._robot.say(f"{found.state}: {found.reason}")
            candidates = self._reports.candidates.get(found.stamp_ns)
            for x, y, yaw in [] if candidates is None else candidates.poses[:10]:
                self._robot.say(f"  may be at x {x:.2f} m, y {y:.2f} m, yaw {math.degrees(yaw):.0f} degrees")
            return False
        self._wait(lambda: self._reports.initial_pose is not None, wall_s=POSE_LIMIT_S)
        if self._reports.initial_pose is None:
            self._robot.say("CONFIRMED, but no initialpose came")
            return False
        stamp_ns, pose = self._reports.initial_pose
        true = self._true_at(stamp_ns)
        off_m = float(np.hypot(*(pose - true)[:2]))
        off_rad = abs(float(angles.wrap(pose[2] - true[2])))
        right = off_m < RIGHT_M and off_rad < RIGHT_RAD
        taken_s = 1e-9 * (stamp_ns - min(self._reports.truth))
        driven_m = polyline.length(self._reports.true_path_m(to_ns=stamp_ns))
        self._robot.say(f"after {taken_s:.0f} s and {driven_m:.1f} m: {found.reason}")
        self._robot.say(
            f"CONFIRMED after {found.depth} edges, {'right' if right else 'WRONG'}: hands over x {pose[0]:.2f} m, "
            f"y {pose[1]:.2f} m, {off_m:.3f} m and {math.degrees(off_rad):.1f} degrees off the truth"
        )
        return right

    def _show_row(self, news: SearchNews) -> None:
        """Prints one row of the search forest: match edge, match node, remaining candidates, turn."""
        reports, stamp_ns = self._reports, news.stamp_ns

        def is_complete() -> bool:
            candidates = reports.candidates.get(stamp_ns)
            return stamp_ns in reports.meetpoints and candidates is not None and candidates.total >= news.candidates

        self._wait(is_complete, wall_s=ROW_LIMIT_S, shows_rows=False)
        meetpoint, candidates = reports.meetpoints.get(stamp_ns), reports.candidates.get(stamp_ns)
        if meetpoint is None or candidates is None:
            return
        if news.depth == 0:
            self._depths = []
        self._robot.say(f"search depth {news.depth}")
        traversal = reports.traversals.get(stamp_ns)
        if traversal is not None and news.depth:
            rank, degree = traversal.rank, self._degree_before
            name = turn_name(rank, degree) if degree > rank else f"RANK_{rank}"
            self._robot.say(
                f"  match edge E{news.depth - 1}: {name}, length {traversal.length_m:.2f} m, chord "
                f"{traversal.chord_m:.2f} m"
            )
        self._degree_before = meetpoint.degree
        self._robot.say(f"  match node M{news.depth}: degree {meetpoint.degree}, r {meetpoint.r_m:.2f} m")
        total = candidates.total
        places = [f"{node} along {edge}" for node, edge in zip(candidates.nodes, candidates.edges)][:LISTED]
        more = f", and {total - LISTED} more" if total > LISTED else ""
        self._robot.say(
            f"  {total} candidate{'s' * (total != 1)} (node along edge): {', '.join(places) or 'none'}{more}"
        )
        turn = f"; votes for {news.turn}" if news.turn else ""
        self._robot.say(f"  {news.state}: {news.reason}{turn}")
        self._depths.append(Depth(candidates.poses, self._true_at(stamp_ns), news.turn or str(news.state)))

    # -- the tour

    def _drive_tour(self, found: SearchNews) -> bool:
        """Drive to the nodes of the tour; whether all were reached."""
        reports, robot = self._reports, self._robot
        self._confirmed_ns = found.stamp_ns
        if not self._wait(
            lambda: reports.localization == LocalizationState.LOCALIZED, simulated_s=LOCALIZATION_LIMIT_S
        ):
            robot.say(f"the localization is {reports.localization or 'silent'}, not LOCALIZED: no tour")
            return False
        if not robot.takes_goals():
            robot.say("no action server goto_node")
            return False
        reached = True
        rng = np.random.default_rng(self._p.seed)
        for node in tour.nodes(self._atlas, reports.newest_truth[:2], self._p.tour, rng):
            arrival = self._drive_to(node)
            if robot.is_ending():
                return False
            if arrival is None:
                robot.stop()
                robot.say(f"goto_node {node}: not there within {self._p.tour_limit_s:g} s")
                reached = False
                continue
            off_m = float(np.hypot(*(reports.newest_truth[:2] - self._atlas.nodes.position_m[node])))
            robot.say(
                f"goto_node {node}: {arrival.reason}, {arrival.travelled_m:.1f} m driven; truly {off_m:.2f} m from the "
                "node"
            )
            reached = reached and arrival.outcome == Outcome.SUCCEEDED
        self._show_tracking()
        return reached

    def _drive_to(self, node: int) -> Optional[Arrival]:
        """How it ended; None if it did not. The driver may hear of the localization a little later than this demo, and
        is asked again then.
        """
        arrival = None
        for _ in range(REQUESTS):
            self._robot.go_to(node)
            self._wait(lambda: self._robot.arrival() is not None, simulated_s=self._p.tour_limit_s)
            arrival = self._robot.arrival()
            if arrival is None or arrival.outcome != Outcome.NOT_LOCALIZED:
                break
            self._wait(lambda: False, simulated_s=1.0)
        return arrival

    def _show_tracking(self) -> None:
        reports = self._reports
        stamps_ns = np.array(sorted(stamp for stamp in reports.poses if stamp >= self._confirmed_ns), np.int64)
        estimates = np.array([reports.poses[stamp] for stamp in stamps_ns.tolist()]).reshape(-1, 3)
        figures = pose_errors.summary(pose_errors.of(stamps_ns, estimates, reports.true_trajectory()))
        if figures["position_mean_m"] is None:
            self._robot.say("tracking: no pose of the localization")
            return
        self._robot.say(
            f"tracking over {polyline.length(reports.true_path_m(self._confirmed_ns)):.0f} m: mean "
            f"{figures['position_mean_m']:.3f} m, 95 % within {figures['position_p95_m']:.3f} m, most "
            f"{figures['position_max_m']:.3f} m; heading mean {figures['yaw_mean_deg']:.2f} degrees, at "
            f"{len(stamps_ns)} scans"
        )

    # -- what both need

    def _wait(
        self,
        condition: Callable[[], bool],
        simulated_s: float = math.inf,
        wall_s: float = math.inf,
        shows_rows: bool = True,
    ) -> bool:
        """Listen until the condition holds, or too much time has passed; rows of the search are shown as they come."""
        began_s, wall_began_s = self._reports.simulated_s, self._robot.wall_s()
        while not self._robot.is_ending():
            if condition():
                return True
            if self._reports.simulated_s - began_s > simulated_s or self._robot.wall_s() - wall_began_s > wall_s:
                return False
            self._robot.listen()
            while shows_rows and self._reports.rows:
                self._show_row(self._reports.rows.popleft())
        return False

    def _true_at(self, stamp_ns: int) -> np.ndarray:
        return self._reports.true_trajectory().at(np.int64(stamp_ns))

    def _draw(self, outcome: str) -> None:
        reports = self._reports
        if not self._p.picture or reports.grid_map is None:
            return
        last_ns = max(reports.poses, default=0)
        story = WakeUpStory(
            self._depths,
            reports.true_path_m(to_ns=self._confirmed_ns or math.inf),
            reports.true_path_m(self._confirmed_ns) if self._confirmed_ns else np.zeros((0, 2)),
            None if reports.initial_pose is None else reports.initial_pose[1],
            reports.poses.get(last_ns),
            reports.truth.get(last_ns),
        )
        path = Path(self._p.picture)
        path.parent.mkdir(parents=True, exist_ok=True)
        title = f"{self._atlas.name}: {outcome} after {max(len(self._depths) - 1, 0)} edges"
        wake_up_picture.draw(path, reports.grid_map, story, title)
        self._robot.say(f"picture: {path}")
