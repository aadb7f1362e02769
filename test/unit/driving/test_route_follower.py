"""Followed by a base of the simulation, which has limits of its own."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.driving import velocity
from glass_nav.driving.base_limits import BaseLimits
from glass_nav.driving.route_follower import RouteFollower, RouteFollowerParams
from glass_nav.geometry import angles
from glass_nav.simulation.robot import Obstacles, Robot, RobotParams

NOTHING = Obstacles(np.zeros((0, 2, 2)))
LIMITS = BaseLimits()
CONTROL_S = 0.05
ROUTES = {
    "straight": [[0, 0], [6, 0]],
    "corner": [[0, 0], [4, 0], [4, 3]],
    "steps of cells": [[0.05 * (index // 2), 0.05 * ((index + 1) // 2)] for index in range(80)],
    "short": [[0, 0], [0.2, 0.1]],
    "there and back": [[0, 0], [3, 0], [0.1, 0]],
}


def driven(points, pose=(0.0, 0.0, 0.0), yaw=None, limits=LIMITS, until_s=120.0):
    """Poses (N, 3) and commands (N, 3) until the base stands at the end."""
    follower = RouteFollower(np.array(points, float), limits, final_yaw_rad=yaw)
    robot = Robot(RobotParams(max_acceleration_m_s2=2.0, max_turn_acceleration_rad_s2=6.0), np.array(pose), NOTHING)
    command, poses, commands = np.zeros(3), [robot.map_from_base], [np.zeros(3)]
    for _ in range(round(until_s / CONTROL_S)):
        command = velocity.limited(follower.command(robot.map_from_base), command, limits, CONTROL_S)
        robot.step(command, CONTROL_S)
        poses.append(robot.map_from_base)
        commands.append(command)
        if follower.done and robot.standing:
            return np.array(poses), np.array(commands), follower
    raise AssertionError(f"not there after {until_s} s: {follower.remaining_m} m remain")


def off_line(points, line):
    line = np.array(line, float)
    start, along = line[:-1], np.diff(line, axis=0)
    offset = points[:, None] - start
    share = np.clip((offset * along).sum(-1) / (along**2).sum(-1), 0, 1)
    return np.linalg.norm(offset - share[..., None] * along, axis=-1).min(axis=1)


@pytest.mark.parametrize("name", ROUTES)
@pytest.mark.parametrize("heading", [0.0, 2.5, -1.5])
def test_a_route_is_followed_to_its_end_from_any_heading(name, heading):
    poses, commands, follower = driven(ROUTES[name], (*ROUTES[name][0], heading))
    assert np.hypot(*(poses[-1, :2] - ROUTES[name][-1])) < 0.1
    assert off_line(poses[:, :2], ROUTES[name]).max() < 0.15
    assert follower.remaining_m == 0.0
    assert np.abs(commands[:, 0]).max() <= LIMITS.max_speed_m_s + 1e-9
    assert np.abs(commands[:, 2]).max() <= LIMITS.max_turn_rad_s + 1e-9
    assert np.abs(np.diff(commands[:, 0])).max() <= LIMITS.max_acceleration_m_s2 * CONTROL_S + 1e-9


def test_it_turns_on_the_spot_before_it_sets_out():
    poses, commands, _ = driven(ROUTES["straight"], (0.0, 0.0, math.pi - 0.1))
    moving = np.flatnonzero(commands[:, 0] > 0.0)[0]
    assert abs(poses[moving, 2]) < 0.15
    assert np.hypot(*poses[moving, :2]) < 0.05


@pytest.mark.parametrize("yaw", [0.0, 1.5, -3.0])
def test_it_ends_with_the_heading_that_was_asked_for(yaw):
    poses, _, _ = driven(ROUTES["corner"], yaw=yaw)
    assert abs(float(angles.wrap(poses[-1, 2] - yaw))) < 0.1
    assert np.hypot(*(poses[-1, :2] - [4, 3])) < 0.1


def test_at_its_place_already_it_only_turns():
    poses, commands, _ = driven([[1.0, 1.0]], (1.0, 1.0, 0.0), yaw=2.0)
    assert (commands[:, 0] == 0.0).all()
    assert poses[-1, 2] == pytest.approx(2.0, abs=0.1)
    assert RouteFollower(np.array([[1.0, 1.0]]), LIMITS).command(np.zeros(3)).tolist() == [0.0, 0.0, 0.0]


def test_a_base_that_was_pushed_aside_comes_back_and_the_distance_is_reported():
    follower = RouteFollower(np.array(ROUTES["straight"], float), LIMITS)
    follower.command(np.array([1.0, 0.0, 0.0]))
    assert follower.off_route_m < 1e-9
    command = follower.command(np.array([1.2, 0.5, 0.0]))
    assert follower.off_route_m == pytest.approx(0.5)
    assert command[2] < 0.0


def test_an_end_that_was_missed_to_the_side_is_returned_to():
    follower = RouteFollower(np.array(ROUTES["straight"], float), LIMITS)
    follower.progress_m = 5.9
    assert follower.command(np.array([6.2, 0.4, 0.0]))[2] != 0.0
    assert not follower.done


@pytest.mark.parametrize("name", ["lookahead_m", "goal_tolerance_m", "goal_tolerance_rad"])
def test_a_tolerance_that_is_none_is_refused(name):
    with pytest.raises(ValueError, match=f"^~{name} must be > 0 and finite, got 0.0$"):
        RouteFollowerParams(**{name: 0.0})
