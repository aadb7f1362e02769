"""Every decision of the driver, with a simulated robot in a T of corridors that hears what the nodes would tell it."""

from __future__ import annotations

import copy
import functools
import logging
import math
import re

import numpy as np
import pytest
from made_buildings import COARSE, t_corridor

from glass_nav.driving.decisions import (
    Action,
    Command,
    DriveStatus,
    Feedback,
    GoalEnd,
    MeetpointReport,
    TraversalReport,
    VisitReport,
)
from glass_nav.driving.driver import Driver
from glass_nav.driving.driver_params import DriveParams, DriverRules
from glass_nav.driving.input_watch import Odometry
from glass_nav.driving.place_goals import PlaceGoal
from glass_nav.driving.recovery import RecoveryParams
from glass_nav.driving.tasks import Ending
from glass_nav.geometry import se2
from glass_nav.health import Level
from glass_nav.log_line import LogLine
from glass_nav.simulation import building_map
from glass_nav.simulation.building import Building
from glass_nav.simulation.odometry import EXACT
from glass_nav.simulation.robot import RobotParams
from glass_nav.simulation.simulation import Simulation
from glass_nav.topology.atlas import atlas_builder
from glass_nav.topology.atlas.atlas import AtlasError
from glass_nav.vocabulary import DriverPhase, LocalizationState, Outcome, SearchState
from glass_nav.world.grid_map import GridMap

CONTROL_S = 0.05
QUICK = RecoveryParams(recovery_wait_s=0.5, recovery_back_off_m=0.1, recovery_turn_rad=0.5)
WAITS = DriverRules(seek_at_start=False)  # for somebody to ask
PATHS = {"all": np.array([[1.0, 1.0], [11.0, 1.0], [6.0, 1.0], [6.0, -4.0]])}
POSE_GOAL = PlaceGoal(-1, np.array([4.0, 1.0, 0.0]), "map")


@functools.lru_cache(maxsize=None)
def floor():
    """The T, its map and its atlas."""
    building = Building(t_corridor().walls, paths=PATHS, start=np.array([4.5, 0.9, 0.1]), name="t")
    grid_map = building_map.draw(building)
    return building, grid_map, atlas_builder.build(grid_map, "t", "t")[0]


class Elsewhere:
    """A task that somebody else drives, until it is told how it ended."""

    needs_pose, steers = True, False
    phase, reason, remaining_m = DriverPhase.GOING, "another one drives", math.nan

    def __init__(self):
        self.ending, self.cancelled, self.held = None, False, 0

    def step(self, now):
        return np.ones(3)

    def hold(self):
        self.held += 1

    def cancel(self):
        self.cancelled = True


class Robot:
    """A driver in the T, and what the world and the other nodes tell it."""

    def __init__(self, rules=DriverRules(), backend=None):
        building, _, atlas = floor()
        self.simulation = Simulation(building, COARSE, RobotParams(braking_factor=4.0), odometry=EXACT)
        self.driver = Driver(DriveParams(rules, recovery=QUICK), atlas=atlas, backend=backend)
        self.decided = []
        self.command = np.zeros(3)
        self.localization = LocalizationState.LOCALIZED
        self.sees, self.held = True, False  # held: its wheels slip
        self.carried_m = np.zeros(3)  # added to what odometry says

    @property
    def now_s(self):
        return self.simulation.stamp_ns * 1e-9

    def do(self, decided):
        """Carry out what was decided just now; returned, too."""
        self.decided += decided
        commands = [each.velocity for each in decided if isinstance(each, Command)]
        self.command = commands[-1] if commands else np.zeros(3)
        return decided

    def scan(self):
        """A scan, and the control steps until the next."""
        frame = self.simulation.look()
        self.driver.at(self.now_s)
        if self.localization is not None:
            self.driver.localization_reports(self.localization, "")
        if self.sees:
            assert self.driver.see(frame.scan, frame.odom_from_base + self.carried_m)
        for _ in range(round(self.simulation.scan_period_s / CONTROL_S)):
            self.driver.at(self.now_s)
            self.control()
            self.simulation.move(CONTROL_S, self.command * [not self.held, 1.0, 1.0])

    def control(self):
        pose = self.simulation.reading.odom_from_base
        map_from_odom = se2.compose(self.simulation.map_from_base, se2.inverse(pose))
        odometry = Odometry(self.simulation.stamp_ns, pose + self.carried_m)
        return self.do(self.driver.control(odometry, map_from_odom, "no scan used yet"))

    def run(self, until, limit_s=90.0):
        """Until something holds; what was decided meanwhile."""
        begin = len(self.decided)
        for _ in range(round(limit_s / self.simulation.scan_period_s)):
            if until():
                return self.decided[begin:]
            self.scan()
        assert until(), f"not after {limit_s} s: {self.driver.status}"
        return self.decided[begin:]

    def run_for(self, duration_s):
        until_s = self.now_s + duration_s
        return self.run(lambda: self.now_s >= until_s)

    def run_to_end(self, limit_s=90.0):
        """Of the goal that is on."""
        count = len(self.all(GoalEnd))
        self.run(lambda: len(self.all(GoalEnd)) > count, limit_s)
        return self.all(GoalEnd)[-1]

    def all(self, kind):
        return only(self.decided, kind)

    @property
    def phase(self):
        return self.driver.status.phase

    @property
    def arrival(self):
        """The last that was reported."""
        return self.all(MeetpointReport)[-1].arrival


def only(decided, kind):
    return [each for each in decided if isinstance(each, kind)]


def lines(decided):
    return [line.text for line in only(decided, LogLine)]


@functools.lru_cache(maxsize=None)
def driven_to_the_junction(rules):
    robot = Robot(rules)
    if not rules.seek_at_start:
        robot.scan()
        robot.do(robot.driver.traverse_edge(""))
    robot.run(lambda: robot.phase == DriverPhase.ARRIVED)
    return robot


def standing(rules=DriverRules()):
    """A robot at the junction of the T; driven there once for all tests."""
    return copy.deepcopy(driven_to_the_junction(rules))


def started(rules=WAITS, backend=None):
    """A robot that has seen something and stands."""
    robot = Robot(rules, backend)
    robot.run_for(0.5)
    return robot


# -- what it does alone


@pytest.mark.long_run
def test_at_the_start_it_halts_until_it_sees_and_then_drives_to_a_meetpoint_and_reports_it():
    robot = Robot()
    robot.sees = False
    robot.scan()
    assert (robot.driver.status.phase, robot.driver.status.reason) == (DriverPhase.HALTED, "no scan used yet")
    robot.sees = True
    robot.scan()
    assert robot.phase == DriverPhase.SEEKING and robot.driver.status.task == "~seek_at_start"
    robot.run(lambda: robot.phase == DriverPhase.ARRIVED)
    assert len(robot.all(MeetpointReport)) == 1 and not robot.all(TraversalReport) and not robot.all(Feedback)
    assert robot.arrival.meetpoint.degree == 3 and robot.arrival.traversal is None
    assert lines(robot.decided)[0] == "~seek_at_start begins"
    assert lines(robot.decided)[-1].startswith("~seek_at_start: SUCCEEDED, at a meetpoint of degree 3")


@pytest.mark.long_run
def test_after_a_task_it_commands_zeros_for_a_moment_and_then_nothing():
    robot = standing()
    quiet = robot.run_for(2.0)
    assert 5 <= len(only(quiet, Command)) <= 12 and all(np.all(each.velocity == 0.0) for each in only(quiet, Command))
    assert not only(robot.run_for(1.0), Command)
    assert robot.phase == DriverPhase.ARRIVED


def test_without_seek_at_start_it_waits_for_a_request():
    robot = Robot(WAITS)
    robot.sees = False
    robot.scan()
    robot.sees = True
    robot.run_for(1.0)
    assert not robot.decided
    assert (robot.driver.status.phase, robot.driver.status.reason) == (DriverPhase.IDLE, "nothing is asked for")


@pytest.mark.long_run
def test_a_search_that_waits_hears_of_the_meetpoint_again_and_again():
    robot = standing()
    assert not only(robot.run_for(3.0), MeetpointReport)
    robot.driver.search_reports(SearchState.WAITING)
    assert len(only(robot.run_for(5.0), MeetpointReport)) == 3
    robot.driver.search_reports(SearchState.SEARCHING)
    assert not only(robot.run_for(3.0), MeetpointReport)


@pytest.mark.long_run
def test_a_search_that_it_does_not_drive_for_hears_of_it_once():
    robot = standing(DriverRules(follow_turn_choice=False))
    robot.driver.search_reports(SearchState.WAITING)
    assert not only(robot.run_for(5.0), MeetpointReport)


@pytest.mark.long_run
def test_a_search_hears_of_a_meetpoint_to_which_the_robot_came_along_no_edge():
    robot = Robot()
    robot.driver.search_reports(SearchState.TENTATIVE)
    robot.run(lambda: robot.phase == DriverPhase.ARRIVED)
    (edge,), (meetpoint,) = robot.all(TraversalReport), robot.all(MeetpointReport)
    assert edge.arrival.traversal is not None and not edge.arrival.traversal.was_followed
    assert edge.arrival.stamp_ns == meetpoint.arrival.stamp_ns
    assert "the robot did not come along one edge: the search continues by dead reckoning" in lines(robot.decided)


def test_without_an_atlas_to_search_in_it_says_so_and_stands_until_a_search_waits():
    robot = Robot()
    robot.run_for(0.4)
    assert robot.phase == DriverPhase.SEEKING
    decided = robot.do(robot.driver.search_reports(SearchState.NO_ATLAS))
    line = "the search has no atlas of the map that is served: the robot does not drive for it"
    assert LogLine(line, logging.ERROR) in decided
    robot.run_for(2.0)
    assert robot.phase == DriverPhase.FAILED and not robot.command.any()
    assert robot.driver.status.reason == "~seek_at_start: the search has no atlas of the map that is served"
    assert robot.driver.search_reports(SearchState.NO_ATLAS) == []
    robot.driver.search_reports(SearchState.WAITING)
    robot.run_for(0.2)
    assert robot.phase == DriverPhase.SEEKING


@pytest.mark.long_run
def test_without_an_atlas_to_search_in_a_robot_that_stands_fails_and_one_with_a_goal_goes_on():
    robot = standing()
    robot.do(robot.driver.search_reports(SearchState.NO_ATLAS))
    assert robot.driver.status.reason == "the search has no atlas of the map that is served"
    robot = standing()
    robot.do(robot.driver.traverse_edge(""))
    robot.do(robot.driver.search_reports(SearchState.NO_ATLAS))
    assert robot.driver.status.task == "traverse_edge"


@pytest.mark.long_run
def test_moved_away_from_its_meetpoint_it_stands_at_none_and_seeks_one_only_for_a_search_that_waits():
    robot = standing()
    robot.carried_m = np.array([0.5, 0.0, 0.0])
    robot.run_for(0.2)
    assert robot.driver.status.reason == "the robot was moved away from its meetpoint"
    assert robot.phase == DriverPhase.IDLE
    assert "not used: the robot is not at a meetpoint" in lines(robot.do(robot.driver.turn_choice(1, "LEFT", 0)))[0]
    robot.driver.search_reports(SearchState.CONFIRMED)
    robot.run_for(0.2)
    assert robot.phase == DriverPhase.IDLE
    robot.driver.search_reports(SearchState.WAITING)
    robot.run_for(0.2)
    assert robot.phase == DriverPhase.SEEKING


@pytest.mark.long_run
def test_where_every_attempt_fails_it_gives_up_until_a_search_waits_anew():
    robot = Robot(DriverRules(seek_attempts=2))
    robot.driver.search_reports(SearchState.SEARCHING)
    robot.held = True
    robot.run(lambda: len([line for line in lines(robot.decided) if "BLOCKED" in line]) == 2, 240.0)
    assert robot.phase == DriverPhase.FAILED
    assert robot.driver.status.reason.startswith("~seek_at_start: gives up: the robot makes no progress")
    assert robot.driver.health.level == Level.ERROR
    assert not only(robot.run_for(2.0), DriveStatus)
    robot.driver.search_reports(SearchState.WAITING)
    robot.driver.search_reports(SearchState.WAITING)
    robot.run_for(0.2)
    assert robot.phase == DriverPhase.SEEKING


# -- turns


@pytest.mark.long_run
def test_a_turn_that_answers_its_meetpoint_is_driven_and_the_edge_reported_before_the_next_meetpoint():
    robot = standing()
    left = robot.arrival
    robot.do(robot.driver.turn_choice(1, "LEFT", left.stamp_ns))
    assert robot.phase == DriverPhase.FOLLOWING and robot.driver.status.task == "turn_choice LEFT"
    told = robot.run(lambda: robot.phase == DriverPhase.ARRIVED)
    reports = [each for each in told if isinstance(each, (TraversalReport, MeetpointReport))]
    assert [type(each) for each in reports] == [TraversalReport, MeetpointReport]
    assert reports[0].arrival is reports[1].arrival and reports[0].arrival.traversal.rank == 1
    statuses = only(told, DriveStatus)
    assert max(status.travelled_m for status in statuses) > 2.0
    assert len(statuses) > 10  # twice a second


@pytest.mark.parametrize(
    "rank, name, stamp, text",
    [
        (1, "LEFT", 7_000_000, "turn_choice LEFT not used: it answers the meetpoint of 0.007 s, the robot stands at"),
        (9, "", 0, "turn_choice 9 refused: turn of rank 9: the meetpoint it left has degree 3, allowed 0 to 2"),
    ],
)
def test_a_turn_that_it_cannot_take_is_reported(rank, name, stamp, text):
    robot = standing()
    (line,) = robot.do(robot.driver.turn_choice(rank, name, stamp))
    assert line.text.startswith(text) and line.level == logging.WARNING and line.often
    assert robot.phase == DriverPhase.ARRIVED


@pytest.mark.long_run
def test_a_turn_waits_for_nobody():
    robot = standing()
    robot.do(robot.driver.turn_choice(1, "LEFT", 0))
    (line,) = robot.do(robot.driver.turn_choice(2, "RIGHT", 0))
    assert line.text == "turn_choice RIGHT not used: turn_choice LEFT is on"
    robot = standing(DriverRules(follow_turn_choice=False))
    assert robot.driver.turn_choice(1, "LEFT", 0) == []


# -- goals along edges


def test_a_goal_along_an_edge_is_refused_where_there_is_none():
    robot = started()
    (end,) = only(robot.do(robot.driver.traverse_edge("LEFT")), GoalEnd)
    assert end.action == Action.TRAVERSE_EDGE and end.arrival is None and end.travelled_m == 0.0
    assert end.ending == Ending(
        Outcome.NOT_AT_MEETPOINT, "the robot is not at a meetpoint: a goal without edge drives to one"
    )
    robot = standing()
    for words, text in (("AHEAD", "edge must be LEFT, "), ("RANK_9", "turn of rank 9: the meetpoint it left has")):
        told = robot.do(robot.driver.traverse_edge(words))
        (end,) = only(told, GoalEnd)
        assert end.ending.outcome == Outcome.REFUSED and end.ending.reason.startswith(text)
        assert lines(told) == [f"traverse_edge {words} refused: {end.ending.reason}"]


@pytest.mark.long_run
def test_a_goal_is_told_of_its_progress_and_of_where_it_led():
    robot = standing(WAITS)
    (end,) = robot.all(GoalEnd)
    assert end.ending.outcome == Outcome.SUCCEEDED and end.arrival is robot.arrival and end.travelled_m > 0.5
    told = robot.all(Feedback)
    assert {each.action for each in told} == {Action.TRAVERSE_EDGE}
    assert {each.status.task for each in told} == {"traverse_edge"}
    assert {DriverPhase.SEEKING, DriverPhase.HOMING} <= {each.status.phase for each in told}


def test_preempted_it_stands_at_once():
    robot = standing()
    robot.do(robot.driver.traverse_edge("LEFT"))
    robot.run(lambda: robot.command[0] > 0.2)
    assert robot.driver.preempt(Action.GOTO_NODE) == []
    told = robot.do(robot.driver.preempt(Action.TRAVERSE_EDGE))
    assert robot.command.tolist() == [0.0, 0.0, 0.0]
    assert only(told, GoalEnd)[0].ending == Ending(Outcome.PREEMPTED, "cancelled: the robot stands")
    assert robot.driver.status.reason == "traverse_edge LEFT: cancelled: the robot stands"
    assert robot.phase == DriverPhase.IDLE
    assert robot.driver.preempt(Action.TRAVERSE_EDGE) == []


def test_a_goal_ends_what_is_on():
    robot = standing()
    robot.do(robot.driver.turn_choice(1, "LEFT", 0))
    told = robot.do(robot.driver.traverse_edge(""))  # nobody waits for a turn
    assert not only(told, GoalEnd) and robot.driver.status.task == "traverse_edge"
    told = robot.do(robot.driver.traverse_edge(""))  # its own server ended the one before
    assert not only(told, GoalEnd)
    told = robot.do(robot.driver.goto_node(POSE_GOAL))
    (end,) = only(told, GoalEnd)
    assert end.action == Action.TRAVERSE_EDGE
    assert end.ending == Ending(Outcome.PREEMPTED, "another goal took over")
    assert robot.driver.status.task == "goto_node pose"


# -- goals in the map


@pytest.mark.long_run
def test_a_place_of_the_map_is_driven_to():
    robot = standing()
    _, grid_map, atlas = floor()
    robot.driver.map_served(grid_map, "that of topic /map")
    assert robot.driver.route_m is None
    node = int(np.argmin(atlas.nodes.position_m[:, 0]))
    robot.do(robot.driver.goto_node(PlaceGoal(node)))
    robot.run_for(1.0)
    assert robot.phase == DriverPhase.GOING and robot.driver.status.task == f"goto_node {node}"
    np.testing.assert_allclose(robot.driver.route_m[-1], atlas.nodes.position_m[node])
    assert robot.driver.status.remaining_m > 1.0
    end = robot.run_to_end()
    assert end.action == Action.GOTO_NODE and end.ending == Ending(Outcome.SUCCEEDED, "it stands at the goal")
    assert np.hypot(*(end.map_from_base[:2] - atlas.nodes.position_m[node])) < 0.15
    assert end.stamp_ns > 0 and robot.phase == DriverPhase.IDLE
    (report,) = robot.all(VisitReport)
    junction = int(np.hypot(*(atlas.nodes.position_m - [6.0, 1.0]).T).argmin())
    assert [visit.node for visit in report.visits] == [junction] and report.stamp_ns > 0


def test_a_goal_in_the_map_needs_a_pose_there_but_waits_for_a_localization_that_fell_silent():
    robot = started()
    robot.localization = LocalizationState.LOST
    robot.scan()
    (end,) = only(robot.do(robot.driver.goto_node(POSE_GOAL)), GoalEnd)
    assert end.ending == Ending(Outcome.NOT_LOCALIZED, "the goal needs a pose in the map: the localization is LOST")
    robot.localization = LocalizationState.LOCALIZED
    robot.scan()
    robot.localization = None
    robot.run_for(3.2)
    assert not only(robot.do(robot.driver.goto_node(POSE_GOAL)), GoalEnd)
    robot.scan()
    assert robot.driver.status.reason.startswith("the localization is silent for 3.")
    assert robot.phase == DriverPhase.HALTED and robot.driver.health.level == Level.ERROR


def test_what_cannot_be_a_goal_is_refused():
    robot = started()
    (end,) = only(robot.do(robot.driver.goto_node(PlaceGoal(99))), GoalEnd)
    assert end.ending == Ending(Outcome.REFUSED, "node 99: the atlas t has nodes 0 to 3")


def test_a_map_that_differs_in_few_cells_is_used_with_a_warning():
    robot = started()
    grid_map = copy.deepcopy(floor()[1])
    row, column = np.argwhere(grid_map.free)[0]
    grid_map.occupancy[row, column] = 100
    changed = GridMap(grid_map.occupancy, grid_map.resolution_m, grid_map.map_from_grid)
    (line,) = robot.do(robot.driver.map_served(changed, "that of topic /map"))
    assert line.level == logging.WARNING
    assert line.text.startswith("the atlas was made from t, which differs from that of topic /map in 1 of ")


def test_another_map_is_not_that_of_the_atlas():
    robot = started()
    other = building_map.draw(Building((), paths={"p": np.eye(2)}, start=np.zeros(3), name="other"))
    with pytest.raises(AtlasError, match="^goto_node cannot be used: "):
        robot.driver.map_served(other, "that of topic /map")


@pytest.mark.long_run
def test_a_backend_drives_in_its_place_and_is_held_while_there_is_trouble():
    tasks = []

    def backend(_pose):
        tasks.append(Elsewhere())
        return tasks[-1]

    robot = started(backend=backend)
    robot.do(robot.driver.goto_node(POSE_GOAL))
    robot.run_for(1.0)
    assert not only(robot.run_for(1.0), Command) and not tasks[-1].held
    tasks[-1].ending = Ending(Outcome.NO_WAY, "none")
    end = robot.run_to_end()
    assert end.ending.outcome == Outcome.NO_WAY and tasks[-1].cancelled
    assert robot.phase == DriverPhase.FAILED
    robot.run_for(1.0)  # zero velocity is sent for a while
    robot.do(robot.driver.goto_node(POSE_GOAL))
    robot.localization = LocalizationState.LOST
    assert not only(robot.run_for(2.0), Command)
    assert robot.phase == DriverPhase.HALTED and tasks[-1].held and not tasks[-1].cancelled
    robot.localization = LocalizationState.LOCALIZED
    robot.run_for(0.5)
    assert robot.phase == DriverPhase.GOING
    robot.localization = LocalizationState.LOST
    began_s = robot.now_s
    end = robot.run_to_end(20.0)
    assert end.ending == Ending(Outcome.NOT_LOCALIZED, "the localization is LOST, for 10 s") and tasks[-1].cancelled
    assert 10.0 < robot.now_s - began_s < 12.0


def test_where_a_goal_of_somebody_else_failed_they_go_on():
    robot = started(DriverRules())
    robot.driver.search_reports(SearchState.WAITING)
    robot.do(robot.driver.traverse_edge(""))
    robot.sees = False
    robot.run_to_end(30.0)
    robot.sees = True
    robot.run_for(1.0)
    assert robot.phase == DriverPhase.FAILED  # though a search waits


# -- halts


def test_without_scans_it_halts_and_goes_on_when_they_come_again():
    robot = started()
    robot.do(robot.driver.traverse_edge(""))
    robot.run(lambda: np.abs(robot.command).max() > 0.3)
    robot.sees = False
    robot.run(lambda: robot.phase == DriverPhase.HALTED, 2.0)
    assert robot.command.tolist() == [0.0, 0.0, 0.0]
    assert re.match(r"^the last scan is 0\.[67] s old$", robot.driver.status.reason)
    told = robot.run_for(3.0)
    assert len([text for text in lines(robot.decided) if text.startswith("traverse_edge halts: ")]) == 1
    assert all(np.all(each.velocity == 0.0) for each in only(told, Command))
    robot.sees = True
    robot.run(lambda: np.abs(robot.command).max() > 0.3, 5.0)


def test_who_waits_for_a_goal_is_told_when_it_halts_for_too_long():
    robot = started()
    robot.do(robot.driver.traverse_edge(""))
    robot.sees = False
    began_s = robot.now_s
    end = robot.run_to_end(20.0)
    assert end.ending.outcome == Outcome.NO_INPUT and end.ending.reason.endswith(" s old, for 10 s")
    assert 10.0 < robot.now_s - began_s < 12.0


def test_what_nobody_waits_for_halts_as_long_as_it_takes():
    robot = standing()
    robot.do(robot.driver.turn_choice(1, "LEFT", 0))
    robot.sees = False
    robot.run_for(15.0)
    assert robot.phase == DriverPhase.HALTED and robot.driver.status.task == "turn_choice LEFT"


# -- inputs


def test_a_control_step_is_due_at_its_rate():
    driver = Driver(DriveParams(DriverRules(control_rate_hz=10.0)), now_s=5.0)
    driver.at(5.09)
    assert not driver.is_control_due
    driver.at(5.1)
    assert driver.is_control_due
    assert driver.odom_from_base is None
    driver.control(None, None, "none yet")
    assert not driver.is_control_due and driver.status.reason == "none yet"


def test_it_tells_which_scans_it_prefers():
    robot = started()
    assert not robot.driver.prefers_surfaces
    robot.driver.surfaces_came()
    assert robot.driver.prefers_surfaces
    np.testing.assert_array_equal(robot.driver.odom_from_base, robot.simulation.reading.odom_from_base)


def test_a_scan_is_seen_once():
    robot = started()
    frame = robot.simulation.look()
    assert robot.driver.see(frame.scan, frame.odom_from_base)
    assert not robot.driver.see(frame.scan, frame.odom_from_base)


def test_its_operators_are_told_what_it_does():
    robot = standing()
    health = robot.driver.health
    assert health.level == Level.OK and health.message.startswith("ARRIVED: at a meetpoint of degree 3")
    assert health.values == {"task": "", "localization": LocalizationState.LOCALIZED}
    assert robot.driver.edge_driver.node.degree == 3


def test_when_time_jumps_back_it_starts_over():
    robot = started()
    robot.do(robot.driver.traverse_edge(""))
    robot.run_for(1.0)
    told = robot.do(robot.driver.reset("time jumped back by 3.000 s"))
    assert lines(told)[0] == "time jumped back by 3.000 s: the driver restarts"
    assert only(told, GoalEnd)[0].ending == Ending(Outcome.RESET, "time jumped back by 3.000 s")
    assert robot.phase == DriverPhase.FAILED and robot.driver.health.values["localization"] == ""
    assert robot.driver.odom_from_base is None and robot.driver.edge_driver.local_graph is None
    assert robot.driver.see(robot.simulation.look().scan, np.zeros(3))  # whatever its stamp
    robot = standing()
    assert lines(robot.do(robot.driver.reset("why"))) == ["why: the driver restarts"]
    robot.run_for(0.2)
    assert robot.phase == DriverPhase.SEEKING  # as at the start


def test_decisions_are_reported_once():
    robot = started()
    robot.do(robot.driver.traverse_edge("LEFT"))
    assert robot.driver.preempt(Action.TRAVERSE_EDGE) == []
