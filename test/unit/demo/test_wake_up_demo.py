"""The script of the demo, with a robot that does what a test says."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Callable, List, Optional

import made_atlases
import numpy as np
import pytest

from glass_nav.demo.reports import Candidates, Reports, SearchNews
from glass_nav.demo.wake_up_demo import Arrival, WakeUpDemo, WakeUpDemoParams
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.vocabulary import LocalizationState, Outcome, SearchState
from glass_nav.world.grid_map import GridMap

S = 10**9
ATLAS = made_atlases.corridors([(0, 0), (8, 0), (16, 0)], [1.0] * 3, [(0, 1), (1, 2)])
THERE = Arrival(Outcome.SUCCEEDED, "it stands at the goal", 8.0)
TOO_EARLY = Arrival(Outcome.NOT_LOCALIZED, "no localization", 0.0)
BLOCKED = Arrival(Outcome.BLOCKED, "it is blocked", 1.0)
Event = Callable[[], None]


class Robot:
    """Each listen() takes a second, simulated and on the wall, and one event."""

    def __init__(self, *events: Event) -> None:
        self.reports = Reports()
        self.events = list(events)
        self.lines: List[str] = []
        self.goals: List[int] = []
        self.arrivals: List[Optional[Arrival]] = []  # of the goals to come; the last one of all others
        self.ends_at_s = math.inf
        self.why_no_restart = ""
        self.restarts = 0
        self.stops = 0
        self.serves = True
        self._wall_s = 0.0

    def listen(self) -> None:
        self._wall_s += 1.0
        if self.reports.truth:
            self.stand(self.reports.newest_truth)
        if self.events:
            self.events.pop(0)()

    def stand(self, pose: np.ndarray) -> None:
        stamp_ns = max(self.reports.truth, default=0) + S
        self.reports.truth[stamp_ns] = pose
        if self.reports.localization is not None:
            self.reports.poses[stamp_ns] = pose + np.array([0.03, 0.0, 0.0])

    def is_ending(self) -> bool:
        return self._wall_s >= self.ends_at_s

    def wall_s(self) -> float:
        return self._wall_s

    def say(self, line: str) -> None:
        self.lines.append(line)

    def restart_search(self) -> str:
        self.restarts += 1
        return self.why_no_restart

    def takes_goals(self) -> bool:
        return self.serves

    def go_to(self, node: int) -> None:
        self.goals.append(node)
        arrival = self.arrivals[min(len(self.goals), len(self.arrivals)) - 1]
        if arrival is not None and arrival.outcome == Outcome.SUCCEEDED:
            self.stand(np.array([*ATLAS.nodes.position_m[node], 0.0]))

    def arrival(self) -> Optional[Arrival]:
        return self.arrivals[min(len(self.goals), len(self.arrivals)) - 1] if self.goals else None

    def stop(self) -> None:
        self.stops += 1

    # -- events

    def wakes_up(self) -> None:
        self.reports.truth[S] = np.zeros(3)
        self.reports.grid_map = GridMap(np.zeros((40, 40), np.int8), 0.5, np.zeros(3))

    def search_reports(
        self, state: SearchState, depth: int = 0, turn: str = "", traversal: Optional[Traversal] = None
    ) -> Event:
        """A row of the search, with all that belongs to it."""

        def event() -> None:
            stamp_ns = max(self.reports.truth)
            self.reports.meetpoints[stamp_ns] = Meetpoint(3, 1.5, stamp_ns=stamp_ns)
            self.reports.candidates[stamp_ns] = Candidates(10, list(range(10)), [0] * 10, np.zeros((10, 3)))
            if traversal is not None:
                self.reports.traversals[stamp_ns] = traversal
            self.reports.take_search(SearchNews(stamp_ns, state, "why", depth, 10, turn))

        return event

    def says(self, state: SearchState, stamp_ns: int = 0) -> Event:
        return lambda: self.reports.take_search(SearchNews(stamp_ns, state, "why", 0, 1, ""))

    def hands_over(self, x_m: float) -> Event:
        def event() -> None:
            self.reports.initial_pose = max(self.reports.truth), np.array([x_m, 0.0, 0.0])

        return event

    def is_localized(self) -> None:
        self.reports.localization = LocalizationState.LOCALIZED


def run(robot: Robot, **fields: Any) -> bool:
    p = WakeUpDemoParams(**{"atlas": "made", "tour": 1, "search_limit_s": 20.0, "tour_limit_s": 5.0, **fields})
    return WakeUpDemo(ATLAS, p, robot.reports, robot).run()


def found(robot: Robot, x_m: float = 0.1) -> "list[Event]":
    return [robot.wakes_up, robot.search_reports(SearchState.CONFIRMED), robot.hands_over(x_m)]


def localized(*arrivals: Optional[Arrival]) -> Robot:
    robot = Robot()
    robot.events = [*found(robot), robot.is_localized]
    robot.arrivals = list(arrivals)
    return robot


def test_a_robot_that_finds_its_place_drives_its_tour_and_is_measured(tmp_path: Path) -> None:
    robot = localized(THERE)
    picture = tmp_path / "out" / "wakeup.png"
    assert run(robot, tour=2, picture=str(picture))
    text = "\n".join(robot.lines)
    assert "wakes up at x 0.00 m, y 0.00 m, yaw 0 degrees, which the robot does not know" in text
    assert (
        "CONFIRMED after 0 edges, right: hands over x 0.10 m, y 0.00 m, 0.100 m and 0.0 degrees off the truth" in text
    )
    assert len(robot.goals) == 2
    assert f"goto_node {robot.goals[0]}: it stands at the goal, 8.0 m driven; truly 0.00 m from the node" in text
    assert "m: mean 0.030 m, 95 % within 0.030 m, most 0.030 m; heading mean 0.00 degrees, at " in text
    assert robot.lines[-1] == f"picture: {picture}" and picture.stat().st_size > 10_000


def test_rows_of_the_search_are_shown_as_the_document_draws_them() -> None:
    robot = Robot()
    robot.events = [
        robot.wakes_up,
        robot.search_reports(SearchState.SEARCHING, 0, "LEFT"),
        robot.search_reports(SearchState.AMBIGUOUS, 1, "", Traversal(1, 8.0, 7.5)),
    ]
    assert not run(robot)
    places = ", ".join(f"{node} along 0" for node in range(8))
    assert robot.lines[1:9] == [
        "search depth 0",
        "  match node M0: degree 3, r 1.50 m",
        f"  10 candidates (node along edge): {places}, and 2 more",
        "  SEARCHING: why; votes for LEFT",
        "search depth 1",
        "  match edge E0: LEFT, length 8.00 m, chord 7.50 m",
        "  match node M1: degree 3, r 1.50 m",
        f"  10 candidates (node along edge): {places}, and 2 more",
    ]
    assert robot.lines[10] == "AMBIGUOUS: why"
    assert robot.lines[11:] == ["  may be at x 0.00 m, y 0.00 m, yaw 0 degrees"] * 10


def test_a_turn_that_the_meetpoint_before_does_not_have_is_shown_by_its_number() -> None:
    robot = Robot()
    robot.events = [robot.wakes_up, robot.search_reports(SearchState.LOST, 1, "", Traversal(4, 8.0, 7.5))]
    run(robot, searches=1)
    assert "  match edge E0: RANK_4, length 8.00 m, chord 7.50 m" in robot.lines


def test_a_row_without_its_reports_is_left_out() -> None:
    robot = Robot()
    robot.events = [robot.wakes_up, robot.says(SearchState.AMBIGUOUS, 7)]
    assert not run(robot)
    assert robot.lines[1:] == ["AMBIGUOUS: why"]


def test_a_lost_robot_searches_again() -> None:
    robot = localized(THERE)
    confirmed = robot.events[1:]
    robot.events = [
        robot.wakes_up,
        robot.search_reports(SearchState.LOST),
        robot.says(SearchState.WAITING),
        *confirmed,
    ]
    assert run(robot)
    assert robot.restarts == 1
    assert "LOST: a new search starts where the robot stands" in robot.lines


def test_it_searches_no_more_often_than_allowed() -> None:
    robot = Robot()
    robot.events = [robot.wakes_up, robot.search_reports(SearchState.LOST), robot.says(SearchState.WAITING)]
    robot.events.append(robot.search_reports(SearchState.LOST))
    assert not run(robot, searches=2)
    assert robot.restarts == 1 and "LOST: why" in robot.lines


@pytest.mark.parametrize("why_not", ["no such service", ""])
def test_where_no_other_search_begins_the_robot_stays_lost(why_not: str) -> None:
    robot = Robot()
    robot.events = [robot.wakes_up, robot.search_reports(SearchState.LOST)]
    robot.why_no_restart = why_not
    assert not run(robot)
    assert robot.restarts == 1 and ("no new search: no such service" in robot.lines) == bool(why_not)
    assert "LOST: why" in robot.lines


def test_a_place_that_is_wrong_is_said_and_no_tour_is_driven() -> None:
    robot = Robot()
    robot.events = found(robot, x_m=3.0)
    assert not run(robot)
    assert any("WRONG: hands over x 3.00 m" in line for line in robot.lines) and not robot.goals


def test_without_an_initial_pose_there_is_nothing_to_judge() -> None:
    robot = Robot()
    robot.events = [robot.wakes_up, robot.search_reports(SearchState.CONFIRMED)]
    assert not run(robot)
    assert robot.lines[-1] == "CONFIRMED, but no initialpose came"


def test_where_nothing_is_heard_the_demo_says_what_may_be_missing() -> None:
    robot = Robot()
    assert not run(robot, start_limit_s=3.0)
    assert robot.lines == ["no messages received: is launch/wakeup.launch running?"]


def test_a_search_that_takes_too_long_is_drawn_as_it_stands(tmp_path: Path) -> None:
    robot = Robot()
    robot.events = [robot.wakes_up, robot.search_reports(SearchState.SEARCHING, 0, "LEFT")]
    assert not run(robot, picture=str(tmp_path / "wakeup.png"))
    assert robot.lines[-2:] == ["the search did not end within 20 s", f"picture: {tmp_path / 'wakeup.png'}"]


def test_without_an_atlas_of_the_map_the_demo_ends_at_once() -> None:
    robot = Robot()
    robot.events = [robot.wakes_up, robot.says(SearchState.NO_ATLAS)]
    assert not run(robot)
    assert robot.lines[-1] == "NO_ATLAS: why" and not robot.goals and robot.wall_s() < 5.0


def test_a_demo_that_is_ended_is_silent_about_the_search() -> None:
    robot = Robot()
    robot.events = [robot.wakes_up]
    robot.ends_at_s = 4.0
    assert not run(robot)
    assert len(robot.lines) == 1


def test_a_driver_that_has_not_heard_of_the_localization_is_asked_again() -> None:
    robot = localized(TOO_EARLY, TOO_EARLY, THERE)
    assert run(robot)
    assert len(robot.goals) == 3 and len(set(robot.goals)) == 1


def test_nor_is_it_asked_for_ever() -> None:
    robot = localized(TOO_EARLY)
    assert not run(robot)
    assert len(robot.goals) == 3 and len(set(robot.goals)) == 1


def test_a_node_that_is_not_reached_is_said_and_the_tour_goes_on() -> None:
    robot = localized(BLOCKED, None)
    assert not run(robot, tour=2)
    assert len(robot.goals) == 2 and robot.stops == 1
    assert any("it is blocked, 1.0 m driven" in line for line in robot.lines)
    assert f"goto_node {robot.goals[1]}: not there within 5 s" in robot.lines


def test_a_tour_that_is_ended_is_not_measured() -> None:
    robot = localized(None)
    robot.ends_at_s = 8.0
    assert not run(robot)
    assert robot.goals and not any("tracking" in line for line in robot.lines)


def test_a_robot_without_localization_or_driver_drives_no_tour() -> None:
    robot = Robot()
    robot.events = found(robot)
    assert not run(robot)
    assert robot.lines[-1] == "the localization is silent, not LOCALIZED: no tour"
    robot = localized(THERE)
    robot.serves = False
    assert not run(robot)
    assert robot.lines[-1] == "no action server goto_node"


def test_without_poses_nothing_is_measured() -> None:
    robot = localized(THERE)
    robot.reports.poses = NoPoses()
    assert run(robot, tour=0)
    assert robot.lines[-1] == "tracking: no pose of the localization"


class NoPoses(dict):  # type: ignore[type-arg]
    """Keeps none."""

    def __setitem__(self, key: Any, value: Any) -> None:
        pass


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"atlas": ""}, "~atlas must be a file, a folder or the name of a shipped atlas, got ''"),
        ({"tour": -1}, "~tour and ~seed must be >= 0, got -1 and 0"),
        ({"searches": 0}, "~searches must be >= 1, got 0"),
        ({"tour_limit_s": math.inf}, "~tour_limit_s must be > 0 and finite, got inf"),
    ],
)
def test_parameters_that_mean_nothing_are_refused(fields: Any, line: str) -> None:
    with pytest.raises(ValueError) as refused:
        WakeUpDemoParams(**{"atlas": "made", **fields})
    assert str(refused.value) == line
