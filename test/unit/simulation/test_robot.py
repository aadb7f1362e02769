from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.simulation.robot import KINDS, Obstacles, Robot, RobotParams, arc

NOTHING = Obstacles(np.zeros((0, 2, 2)))
WALL = Obstacles(np.array([[[2.0, -5.0], [2.0, 5.0]]]))
AGILE = dict(max_acceleration_m_s2=1e6, max_turn_acceleration_rad_s2=1e6)


def driven(robot, command, seconds, dt_s=0.02):
    for _ in range(round(seconds / dt_s)):
        robot.step(np.array(command, float), dt_s)
    return robot


@pytest.mark.parametrize(
    "twist",
    [
        [1.0, 0.0, 0.0],
        [0.0, 0.5, 0.0],
        [0.3, -0.2, 1.1],
        [0.0, 0.0, 2.0],
        [1.0, 1.0, 1e-7],
        [0.5, 0.1, 1.00001e-6],
        [2.0, 0.0, -6.0],
    ],
)
def test_an_arc_is_the_sum_of_many_short_straight_steps(twist):
    twist, parts = np.array(twist), 3000
    pose = np.zeros(3)
    middle = np.array([0.0, 0.0, twist[2] / parts / 2])
    for _ in range(parts):  # half the turn, straight on, half the turn
        pose = se2.compose(se2.compose(pose, middle), np.array([*(twist[:2] / parts), twist[2] / parts / 2]))
    exact = arc(twist)
    assert np.abs(exact[:2] - pose[:2]).max() < 3e-6
    assert abs(angles.wrap(exact[2] - pose[2])) < 1e-9


def test_a_quarter_of_a_circle_by_hand():
    np.testing.assert_allclose(arc(np.array([math.pi / 2, 0.0, math.pi / 2])), [1.0, 1.0, math.pi / 2], atol=1e-12)


@pytest.mark.parametrize("dt_s", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("kind", KINDS)
def test_at_a_steady_velocity_the_length_of_a_step_does_not_matter(kind, dt_s):
    command = [0.5, 0.2 if kind == "omni" else 0.0, 0.7]
    robot = driven(Robot(RobotParams(kind, **AGILE), np.zeros(3), NOTHING), command, 3.0, dt_s)
    expected = arc(3.0 * np.array(command))
    np.testing.assert_allclose(robot.map_from_base[:2], expected[:2], atol=2e-6)


def test_two_wheels_never_go_sideways_and_an_omnidirectional_base_does():
    for kind, way_m in (("diff", 0.0), ("omni", 1.0)):
        robot = driven(Robot(RobotParams(kind, **AGILE), np.zeros(3), NOTHING), [0.0, 0.5, 0.0], 2.0)
        np.testing.assert_allclose(robot.map_from_base, [0.0, way_m, 0.0], atol=1e-4)


@pytest.mark.parametrize("dt_s", [0.01, 0.05, 0.3])
def test_it_accelerates_at_its_limit_and_rolls_out_at_it(dt_s):
    p = RobotParams(max_acceleration_m_s2=0.5, max_speed_m_s=0.6)
    robot = driven(Robot(p, np.zeros(3), NOTHING), [2.0, 0.0, 0.0], 3.0, dt_s)
    # 1.2 s to 0.6 m/s: 0.36 m; then at the limit of its speed
    assert robot.velocity[0] == pytest.approx(0.6)
    assert robot.map_from_base[0] == pytest.approx(0.36 + 0.6 * 1.8, abs=1e-9)
    before = robot.map_from_base[0]
    driven(robot, [0.0, 0.0, 0.0], 3.0, dt_s)
    assert robot.standing
    assert robot.map_from_base[0] - before == pytest.approx(0.36, abs=1e-9)


def test_with_brakes_it_stands_sooner_than_it_got_under_way():
    p = RobotParams(max_acceleration_m_s2=0.5, max_speed_m_s=0.5, max_turn_acceleration_rad_s2=2.0, braking_factor=4.0)
    robot = driven(Robot(p, np.zeros(3), NOTHING), [0.5, 0.0, 1.0], 3.0)
    driven(robot, [0.0, 0.0, 0.0], 0.24)
    assert robot.velocity[2] == 0.0 and robot.velocity[0] == pytest.approx(0.02)  # 0.5 m/s less 0.24 s of 2 m/s^2
    driven(robot, [-0.5, 0.0, 0.0], 0.2)
    assert robot.velocity[0] > -0.1  # to go back it accelerates


def test_turning_has_its_own_limits():
    robot = Robot(RobotParams(max_turn_rad_s=1.0, max_turn_acceleration_rad_s2=2.0), np.zeros(3), NOTHING)
    driven(robot, [0.0, 0.0, -9.0], 1.0)
    assert robot.velocity[2] == -1.0
    assert robot.map_from_base[2] == pytest.approx(-0.75)


def test_the_speed_limit_keeps_the_direction_of_an_omnidirectional_base():
    robot = driven(Robot(RobotParams("omni", max_speed_m_s=0.5), np.zeros(3), NOTHING), [3.0, 4.0, 0.0], 2.0)
    np.testing.assert_allclose(robot.velocity, [0.3, 0.4, 0.0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dt_s", [0.02, 5.0])
@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_a_wall_stops_it_with_its_rim_at_the_wall(kind, dt_s, yaw):
    p = RobotParams(kind, radius_m=0.3)
    robot = driven(Robot(p, np.array([0.0, 0.0, yaw]), WALL), [0.8, 0.0, 0.0], 10.0, dt_s)
    assert robot.blocked
    assert robot.standing
    assert robot.map_from_base[0] == pytest.approx(1.7, abs=1e-5)


def test_from_a_wall_it_may_turn_and_leave():
    robot = driven(Robot(RobotParams(), np.zeros(3), WALL), [0.8, 0.0, 0.0], 5.0)
    assert robot.blocked
    driven(robot, [0.0, 0.0, 1.0], 1.0)
    assert not robot.blocked
    driven(robot, [-0.5, 0.0, 0.0], 2.0)
    assert not robot.blocked
    assert robot.map_from_base[0] < 1.7


def test_what_it_made_adds_up_to_where_it_is_also_at_a_wall():
    robot = Robot(RobotParams("omni"), np.array([0.5, 0.3, 0.4]), WALL)
    pose = robot.map_from_base
    for step in range(200):
        pose = se2.compose(pose, arc(robot.step(np.array([0.7, 0.1, 0.5 * math.cos(step / 20)]), 0.05)))
    assert robot.blocked
    np.testing.assert_allclose(pose[:2], robot.map_from_base[:2], atol=1e-9)


def test_the_nearest_segment_counts_and_a_point_is_one_too():
    obstacles = Obstacles(np.array([[[0.0, 2.0], [4.0, 2.0]], [[6.0, 0.0], [6.0, 0.0]]]))
    assert obstacles.clearance(np.array([1.0, 0.5])) == pytest.approx(1.5)
    assert obstacles.clearance(np.array([7.0, 6.0])) == pytest.approx(5.0)  # 3, 4, 5 from the end
    assert obstacles.clearance(np.array([5.0, 0.0])) == pytest.approx(1.0)
    assert NOTHING.clearance(np.zeros(2)) == math.inf


@pytest.mark.parametrize(
    "values, text",
    [
        ({"kind": "tank"}, "robot must be diff or omni, got 'tank'"),
        ({"radius_m": 0.0}, "radius_m of the robot must be > 0 and finite, got 0.0"),
        ({"max_speed_m_s": math.nan}, "max_speed_m_s of the robot must be > 0 and finite, got nan"),
        ({"max_turn_rad_s": math.inf}, "max_turn_rad_s of the robot must be > 0 and finite, got inf"),
    ],
)
def test_impossible_robots_are_refused(values, text):
    with pytest.raises(ValueError) as caught:
        RobotParams(**values)
    assert str(caught.value) == text


def test_a_command_that_is_no_number_is_refused():
    with pytest.raises(ValueError, match=r"^a velocity command must be finite, got \[nan, 0.0, 0.0\]$"):
        Robot(RobotParams(), np.zeros(3), NOTHING).step(np.array([np.nan, 0.0, 0.0]), 0.1)
