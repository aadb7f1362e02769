"""The steps of a recovery, with a base of the simulation that does them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.driving import recovery
from glass_nav.driving.base_limits import BaseLimits
from glass_nav.driving.recovery import (
    ABORT,
    BACK_OFF,
    NEXT_CHOICE,
    NONE,
    RETRY,
    TURN,
    WAIT,
    Recovery,
    RecoveryParams,
    Stall,
)
from glass_nav.simulation.robot import Obstacles, Robot, RobotParams

CONTROL_S = 0.05
NOTHING = np.zeros((0, 2, 2))
WALL_BEHIND = np.array([[[-0.3, -2.0], [-0.3, 2.0]]])


def robot_among(obstacles):
    return Robot(RobotParams(), np.zeros(3), Obstacles(obstacles))


def made(steps, robot):
    """The step that is made until it is over, how long it took, and what the last one says."""
    names = []
    for _ in range(2000):
        step = steps.step(robot.map_from_base, CONTROL_S)
        if step.name not in recovery.MOVES:
            assert len(set(names)) <= 1
            return (names[0] if names else ""), len(names) * CONTROL_S, step
        names.append(step.name)
        robot.step(step.command, CONTROL_S)
    raise AssertionError(f"{names[-1]} does not end")


def test_what_blocks_is_waited_for_then_backed_off_from_then_looked_around_at_then_left_and_then_given_up():
    steps, robot = Recovery(RecoveryParams(), BaseLimits()), robot_among(NOTHING)
    tried = []
    for _ in range(5):
        steps.begin("a wall is in the way", robot.map_from_base)
        name, _, after = made(steps, robot)
        tried.append(name or after.name)
        assert after.name == (RETRY if name else tried[-1])
    assert tried == [WAIT, BACK_OFF, TURN, NEXT_CHOICE, ABORT]
    assert after.reason == "gives up: a wall is in the way"
    steps.begin("a wall is in the way", robot.map_from_base)
    assert steps.step(robot.map_from_base, CONTROL_S).name == ABORT


def test_each_step_does_what_its_parameters_say():
    p = RecoveryParams(recovery_wait_s=1.0, recovery_back_off_m=0.4, recovery_turn_rad=math.pi)
    steps, robot = Recovery(p, BaseLimits()), robot_among(NOTHING)
    steps.begin("a wall", robot.map_from_base)
    _, waited_s, _ = made(steps, robot)
    assert waited_s == pytest.approx(1.0, abs=2 * CONTROL_S)
    steps.begin("a wall", robot.map_from_base)
    made(steps, robot)
    assert robot.map_from_base[0] == pytest.approx(-0.4, abs=0.03)
    steps.begin("a wall", robot.map_from_base)
    made(steps, robot)
    assert abs(robot.map_from_base[2]) == pytest.approx(math.pi, abs=0.1)


def test_a_wall_behind_ends_the_way_back():
    steps, robot = Recovery(RecoveryParams(recovery_wait_s=0.0), BaseLimits()), robot_among(WALL_BEHIND)
    steps.begin("a wall", robot.map_from_base)
    assert made(steps, robot)[2].name == RETRY
    steps.begin("a wall", robot.map_from_base)
    name, spent_s, after = made(steps, robot)
    assert name == BACK_OFF and after.name == RETRY and spent_s < 4.0
    assert robot.map_from_base[0] > -0.1


def test_a_drive_that_came_on_begins_again_with_waiting():
    steps = Recovery(RecoveryParams(recovery_wait_s=0.1), BaseLimits())
    steps.begin("a cart", np.zeros(3))
    made(steps, robot_among(NOTHING))
    steps.begin("a person", np.array([1.0, 0.0, 0.0]))
    assert steps.step(np.array([1.0, 0.0, 0.0]), CONTROL_S).name == WAIT


def test_without_another_choice_it_is_given_up():
    steps = Recovery(RecoveryParams(), BaseLimits())
    steps.no_other_choice()
    steps.begin("a wall", np.zeros(3))
    assert steps.step(np.zeros(3), CONTROL_S).name == ABORT


def test_called_off_it_stands_and_has_tried_nothing():
    steps = Recovery(RecoveryParams(), BaseLimits())
    for _ in range(2):
        steps.begin("a wall", np.zeros(3))
    assert steps.is_on and steps.step(np.zeros(3), CONTROL_S).command[0] < 0.0
    steps.cancel()
    step = steps.step(np.zeros(3), CONTROL_S)
    assert (step.name, step.command.tolist()) == (NONE, [0.0, 0.0, 0.0]) and not steps.is_on
    steps.begin("a wall", np.zeros(3))
    assert steps.step(np.zeros(3), CONTROL_S).name == WAIT


def test_a_base_that_makes_no_way_though_it_is_told_to_is_noticed():
    stall, forward = Stall(), np.array([0.4, 0.0, 0.0])
    for step in range(200):  # it drives
        assert not stall.is_on(forward, np.array([0.02 * step, 0.0, 0.0]), CONTROL_S)
    held_at = np.array([3.98, 0.0, 0.0])
    told_s = next(step * CONTROL_S for step in range(200) if stall.is_on(forward, held_at, CONTROL_S))
    assert 0.5 < told_s < 2.0
    stall.clear()
    assert not any(stall.is_on(np.array([0.0, 0.0, 1.0]), np.zeros(3), CONTROL_S) for _ in range(200))  # it turns


@pytest.mark.parametrize(
    "name, value, allowed",
    [("recovery_wait_s", -1.0, ">= 0"), ("recovered_m", 0.0, "> 0"), ("recovery_speed_m_s", math.nan, "> 0")],
)
def test_a_parameter_out_of_its_range_is_refused(name, value, allowed):
    with pytest.raises(ValueError, match=f"^~{name} must be {allowed} and finite, got {value}$"):
        RecoveryParams(**{name: value})
