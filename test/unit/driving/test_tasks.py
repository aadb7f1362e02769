"""Tasks carried out by the simulated robot, with its lidar, in a small building: a corridor with a side corridor.

      4 m
    |     |
----+     +----------------   y 2
 A     B                 C
---------------------------   y 0
x 0       5 (middle of B)     12
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from made_buildings import SIDE_CORRIDOR_WALLS

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.driving.edge_tracking.edge_driver import EdgeDriver
from glass_nav.driving.recovery import RecoveryParams
from glass_nav.driving.route import RoutePlanner
from glass_nav.driving.route_follower import RouteFollowerParams
from glass_nav.driving.tasks import EdgeTask, GoTask, Moment
from glass_nav.geometry import se2
from glass_nav.simulation import building_map
from glass_nav.simulation.building import Building, Thing, box
from glass_nav.simulation.lidar import PRESETS
from glass_nav.simulation.odometry import EXACT
from glass_nav.simulation.robot import RobotParams
from glass_nav.simulation.simulation import Simulation
from glass_nav.topology.atlas import atlas_builder
from glass_nav.topology.observations import ObservationError
from glass_nav.vocabulary import DriverPhase, Outcome

LIMITS = BaseLimits()
CONTROL_S = 0.05
QUICK = RecoveryParams(recovery_wait_s=0.5, recovery_turn_rad=1.0)
PATHS = {"all": np.array([[1.0, 1.0], [5.0, 1.0], [5.0, 5.0], [5.0, 1.0], [11.0, 1.0]])}
CART = Thing(box(8.5, 1.0, 0.4, 1.8), mapped=False)  # across the corridor


def corridor(*things):
    return Building(SIDE_CORRIDOR_WALLS, things=things, paths=PATHS, start=np.array([2.0, 1.0, 0.0]), name="corridor")


class Drive:
    """A robot, its driver, and the time that goes on."""

    def __init__(self, building, start=(4.0, 1.0, 0.0), ledge_x=math.inf):
        """At ledge_x the floor has a step that no lidar sees and no wheel climbs."""
        lidar = replace(PRESETS["sensitive"], beams=361)
        self.simulation = Simulation(
            building, lidar, RobotParams(braking_factor=4.0), odometry=EXACT, start=np.array(start, float)
        )
        self.driver, self.ledge_x = EdgeDriver(), ledge_x
        self.last, self.touched = np.zeros(3), False
        self.commands = []

    def now(self):
        reading = self.simulation.reading
        return Moment(reading.odom_from_base, self.simulation.map_from_base, self.last, CONTROL_S)

    def run(self, task, until=lambda: False, limit_s=240.0):
        """Until the task has ended, or so long."""
        for step in range(round(limit_s / CONTROL_S)):
            if step % 4 == 0:  # 5 Hz
                frame = self.simulation.look()
                self.driver.see(frame.scan, frame.odom_from_base)
            self.last = task.step(self.now())
            self.commands.append(self.last)
            if task.ending is not None or until():
                return task.ending
            x, _, yaw = self.simulation.map_from_base
            held = x > self.ledge_x and math.cos(yaw) * self.last[0] > 0.0
            self.simulation.move(CONTROL_S, self.last * [not held, 1.0, 1.0])
            self.touched = self.touched or self.simulation.blocked
        raise AssertionError(f"no end in {limit_s} s: {task.phase}, {task.reason}")


def arrived(building, ledge_x=math.inf):
    """At the meetpoint B."""
    drive = Drive(building, ledge_x=ledge_x)
    task = EdgeTask(drive.driver, QUICK, LIMITS)
    assert drive.run(task).outcome == Outcome.SUCCEEDED
    assert task.arrival.meetpoint.degree == 3 and task.arrival.traversal is None
    assert np.hypot(*(drive.simulation.map_from_base[:2] - [5.0, 1.0])) < 0.4
    return drive


def rank_towards(drive, bearing_rad):
    """Of the edge that leaves in that direction of the map."""
    map_from_odom = se2.compose(drive.simulation.map_from_base, se2.inverse(drive.simulation.reading.odom_from_base))
    bearings = [branch.bearing_rad + map_from_odom[2] for branch in drive.driver.node.branches]
    return int(np.argmin([abs(math.remainder(bearing - bearing_rad, 2 * math.pi)) for bearing in bearings]))


@pytest.mark.long_run
def test_an_edge_is_followed_to_the_next_meetpoint_and_reported():
    drive = arrived(corridor())
    rank = rank_towards(drive, 0.0)
    task = EdgeTask(drive.driver, QUICK, LIMITS, rank)
    ending = drive.run(task)
    assert ending.outcome == Outcome.SUCCEEDED and task.phase == DriverPhase.ARRIVED
    assert (task.arrival.meetpoint.degree, task.arrival.traversal.rank) == (1, rank)
    assert task.arrival.traversal.length_m == pytest.approx(drive.simulation.map_from_base[0] - 5.0, abs=0.3)
    assert not drive.touched and math.isnan(task.remaining_m)
    assert task.step(drive.now()).tolist() == [0.0, 0.0, 0.0]  # it is over


@pytest.mark.long_run
def test_an_edge_that_there_is_not_and_a_meetpoint_that_it_is_not_at_are_refused():
    drive = arrived(corridor())
    with pytest.raises(ObservationError, match="^turn of rank 5: the meetpoint it left has degree 3, allowed 0 to 2$"):
        EdgeTask(drive.driver, QUICK, LIMITS, 5)
    drive.driver.stop()
    with pytest.raises(ValueError, match="^the robot is not at a meetpoint that it could leave"):
        EdgeTask(drive.driver, QUICK, LIMITS, 1)


@pytest.mark.long_run
def test_called_off_it_asks_for_a_standstill_and_the_driver_for_nothing():
    drive = arrived(corridor())
    task = EdgeTask(drive.driver, QUICK, LIMITS, rank_towards(drive, 0.0))
    drive.run(task, until=lambda: drive.last[0] > 0.3)
    task.cancel()
    assert drive.driver.progress.phase == DriverPhase.IDLE


@pytest.fixture(scope="module")
def planner():
    grid_map = building_map.draw(corridor())
    return RoutePlanner(atlas_builder.build(grid_map, "corridor", "corridor")[0], LIMITS, grid_map)


def going(drive, planner, goal, yaw=None):
    return GoTask(planner, drive.driver, RouteFollowerParams(), QUICK, LIMITS, goal, yaw)


def node_near(planner, x, y):
    return int(np.argmin(np.hypot(*(planner.atlas.nodes.position_m - [x, y]).T)))


@pytest.mark.long_run
def test_a_node_is_driven_to_along_the_edges(planner):
    drive = Drive(corridor(), (1.5, 0.8, 2.0))
    task = going(drive, planner, node_near(planner, 5.0, 1.0))
    assert task.reason == "looking for a path" and math.isnan(task.remaining_m)
    drive.run(task, until=lambda: drive.last[0] > 0.4)
    assert task.phase == DriverPhase.GOING and 0.0 < task.remaining_m < task.route.length_m
    assert drive.run(task).outcome == Outcome.SUCCEEDED
    there = planner.atlas.nodes.position_m[node_near(planner, 5.0, 1.0)]
    assert np.hypot(*(drive.simulation.map_from_base[:2] - there)) < 0.1
    assert not drive.touched


@pytest.mark.long_run
def test_a_pose_is_driven_to_and_turned_to(planner):
    drive = Drive(corridor(), (1.5, 0.8, 2.0))
    assert drive.run(going(drive, planner, np.array([5.2, 4.5]), -1.0)).outcome == Outcome.SUCCEEDED
    np.testing.assert_allclose(drive.simulation.map_from_base, [5.2, 4.5, -1.0], atol=0.12)


@pytest.mark.long_run
def test_a_cart_across_the_only_way_is_waited_for_looked_at_and_given_up(planner):
    drive = Drive(corridor(CART), (6.0, 1.0, 0.0))
    phases = set()
    task = going(drive, planner, node_near(planner, 11.5, 1.0))
    ending = drive.run(task, until=lambda: phases.add((task.phase, task.reason.split(":")[0])))
    assert ending.outcome == Outcome.BLOCKED
    assert ending.reason.endswith("without the 1 that are blocked")
    assert {reason for phase, reason in phases if phase == DriverPhase.RECOVERING} == {
        "waits",
        "backs off",
        "turns in place",
    }
    assert not drive.touched


def test_a_place_without_a_way_is_reported(planner):
    drive = Drive(corridor(), (1.5, 0.8, 2.0))
    ending = drive.run(going(drive, planner, np.array([30.0, 1.0])))
    assert ending.outcome == Outcome.NO_WAY and ending.reason.startswith("the goal at x 30.00 m")


def test_without_a_pose_in_the_map_it_stands(planner):
    drive = Drive(corridor())
    task = going(drive, planner, node_near(planner, 5.0, 1.0))
    assert task.step(replace(drive.now(), map_from_base=None)).tolist() == [0.0, 0.0, 0.0]
    task.cancel()
    assert task.ending is None


def test_a_robot_that_was_pushed_off_its_way_finds_another(planner):
    drive = Drive(corridor(), (1.5, 1.0, 0.0))
    task = going(drive, planner, np.array([11.0, 1.2]))
    drive.run(task, until=lambda: drive.last[0] > 0.3)
    before = task.route
    pushed = replace(drive.now(), map_from_base=np.array([5.0, 4.0, 0.0]))
    task.step(pushed)
    task.step(pushed)
    assert task.route is not before
    np.testing.assert_allclose(task.route.polyline_m[0], [5.0, 4.0])


@pytest.mark.long_run
def test_an_edge_that_cannot_be_driven_is_left_for_another_one_where_any_will_do():
    drive = arrived(corridor(), ledge_x=8.0)
    first = rank_towards(drive, 0.0)
    reasons = set()
    task = EdgeTask(drive.driver, QUICK, LIMITS, first, may_choose=True)
    ending = drive.run(task, until=lambda: reasons.add(task.reason.split(":")[0]))
    assert ending.outcome == Outcome.SUCCEEDED
    assert task.arrival.traversal.rank not in (0, first)
    assert reasons >= {"waits", "backs off", "turns in place", "back to the meetpoint that it left"}
    assert not drive.touched


@pytest.mark.long_run
def test_an_edge_that_was_asked_for_and_cannot_be_driven_is_reported_back_at_its_meetpoint():
    drive = arrived(corridor(), ledge_x=8.0)
    before = drive.simulation.map_from_base
    ending = drive.run(EdgeTask(drive.driver, QUICK, LIMITS, rank_towards(drive, 0.0)))
    assert ending.outcome == Outcome.BLOCKED
    assert ending.reason.endswith("is blocked; it went back to the meetpoint")
    assert np.hypot(*(drive.simulation.map_from_base - before)[:2]) < 0.4
    assert drive.driver.progress.phase == DriverPhase.ARRIVED


@pytest.mark.long_run
def test_a_search_that_is_held_everywhere_is_given_up():
    drive = Drive(corridor(), (5.0, 4.0, 0.0))
    drive.simulation.move = lambda dt_s, command, move=drive.simulation.move: move(dt_s, command * [0.0, 0.0, 1.0])
    ending = drive.run(EdgeTask(drive.driver, QUICK, LIMITS), limit_s=400.0)
    assert ending.outcome == Outcome.BLOCKED and ending.reason.startswith("gives up: the robot makes no progress")


@pytest.mark.long_run
def test_a_goal_behind_a_ledge_is_given_up(planner):
    drive = Drive(corridor(), (6.0, 1.0, 0.0), ledge_x=8.0)
    ending = drive.run(going(drive, planner, np.array([11.0, 1.0])))
    assert ending.outcome == Outcome.BLOCKED and ending.reason.startswith("gives up: the robot makes no progress")
    assert drive.simulation.map_from_base[0] < 8.3
