"""Property: whatever is asked for and wherever things stand, the base does not touch them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.driving import braking, velocity
from glass_nav.driving.base_limits import BaseLimits
from glass_nav.geometry import se2
from glass_nav.simulation import robot

LIMITS = BaseLimits()
CONTROL_S = 0.05
AHEAD = np.array([0.5, 0.0, 0.0])


def some_obstacles(rng):
    """(K, 2) points all around, outside of the margin."""
    count = int(rng.integers(1, 60))
    away = LIMITS.robot_radius_m + LIMITS.margin_m + 0.01 + rng.uniform(0.0, 1.2, count) ** 2
    bearing = rng.uniform(-math.pi, math.pi, count)
    return away[:, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])


def some_velocity(rng):
    return np.array([rng.uniform(-0.3, 0.5), 0.0, rng.uniform(-1.0, 1.0) * rng.integers(2)])


def nearest_m(pose, obstacles_m):
    return float(np.hypot(*(obstacles_m - pose[:2]).T).min())


@pytest.mark.parametrize("creep", [False, True])
@pytest.mark.parametrize("seed", range(60))
def test_the_outline_touches_nothing_on_any_way_that_is_allowed(seed, creep):
    """One velocity is asked for again and again; the base brakes and speeds up as it can."""
    rng = np.random.default_rng(seed)
    obstacles_m, wanted = some_obstacles(rng), some_velocity(rng)
    pose, command, travelled_m = np.zeros(3), np.zeros(3), 0.0
    for step in range(80):
        seen = se2.transform_points(se2.inverse(pose), obstacles_m)
        safe = braking.allowed(wanted, seen, LIMITS, creep)
        command = velocity.limited(safe, command, LIMITS, CONTROL_S)
        for _ in range(3):
            pose = robot.moved(pose, command * CONTROL_S / 3)
            assert nearest_m(pose, obstacles_m) > LIMITS.robot_radius_m, f"step {step}"
        travelled_m += abs(command[0]) * CONTROL_S
    assert travelled_m > 0.0 or braking.room_m(wanted, obstacles_m, LIMITS) < 0.05


@pytest.mark.parametrize("seed", range(40))
def test_the_room_is_the_way_until_the_margin_is_touched(seed):
    """Second way: the arc in closed form, in small steps."""
    rng = np.random.default_rng(seed)
    obstacles_m = some_obstacles(rng)
    asked = np.array([0.4, 0.0, rng.uniform(-1.0, 1.0)])
    along = np.arange(0.0, 1.0, 0.005)
    away = np.array([nearest_m(robot.moved(np.zeros(3), asked * way / 0.4), obstacles_m) for way in along])
    touched = away < LIMITS.robot_radius_m + LIMITS.margin_m
    true_m = float(along[touched.argmax()]) if touched.any() else 1.0
    room_m = braking.room_m(asked, obstacles_m, LIMITS)
    grazed = bool(touched.any()) and np.count_nonzero(touched) < 8  # less than a step of the way: it may be between
    assert room_m <= true_m + 1e-9 or grazed
    assert room_m >= true_m - 0.07


def test_before_a_wall_it_stands_and_further_away_it_is_slower_the_nearer_it_is():
    def before(gap_m):
        wall = np.column_stack([np.full(41, LIMITS.robot_radius_m + LIMITS.margin_m + gap_m), np.linspace(-1, 1, 41)])
        return float(braking.allowed(AHEAD, wall, LIMITS)[0])

    speeds = [before(gap_m) for gap_m in (0.02, 0.1, 0.15, 0.25, 0.3, 2.0)]
    assert speeds[0] == 0.0 and speeds[-1] == AHEAD[0]
    assert all(0.0 < nearer < further for nearer, further in zip(speeds[1:-1], speeds[2:]))


def test_in_a_dead_end_it_may_turn_and_back_out():
    corner = np.array(
        [[0.225, y] for y in np.linspace(-0.3, 0.3, 13)]
        + [[x, side] for x in np.linspace(-1.0, 0.2, 25) for side in (-0.26, 0.26)]
    )
    assert braking.allowed(AHEAD, corner, LIMITS).tolist() == [0.0, 0.0, 0.0]
    turning = np.array([0.2, 0.0, 0.8])
    assert braking.allowed(turning, corner, LIMITS).tolist() == [0.0, 0.0, 0.8]
    on_the_spot = np.array([0.0, 0.0, 0.8])
    assert braking.allowed(on_the_spot, corner, LIMITS).tolist() == on_the_spot.tolist()
    back = np.array([-0.1, 0.0, 0.0])
    assert braking.allowed(back, corner, LIMITS).tolist() == back.tolist()


def test_an_obstacle_beside_its_way_is_passed_in_a_bend():
    post = np.array([[0.4, 0.2]])
    around = braking.allowed(AHEAD, post, LIMITS)
    assert around[0] > 0.0 and around[2] < 0.0  # to the right of what stands to the left


@pytest.mark.parametrize("half_m, driven", [(0.245, True), (0.235, False)])
def test_a_passage_is_driven_through_if_it_is_as_wide_as_the_base_and_its_margins(half_m, driven):
    x = np.linspace(0.5, 3.0, 101)
    walls = np.concatenate([np.column_stack([x, np.full(101, side)]) for side in (-half_m, half_m)])
    inside = walls - [1.0, 0.0]
    assert (braking.room_m(AHEAD, walls, LIMITS, 2.0) == 2.0) == driven
    assert (braking.room_m(AHEAD, inside, LIMITS, 1.5) == 1.5) == driven


@pytest.mark.parametrize("half_m, out", [(0.235, True), (0.215, False)])
def test_back_where_it_came_in_it_creeps_through_what_is_too_narrow_for_its_margins(half_m, out):
    x = np.linspace(-0.5, 0.5, 101)
    walls = np.concatenate([np.column_stack([x, np.full(101, side)]) for side in (-half_m, half_m)])
    walls = se2.transform_points(np.array([0.0, 0.0, 0.1]), walls)  # it does not stand quite along them
    assert braking.allowed(AHEAD, walls, LIMITS)[0] == 0.0
    creeping = braking.allowed(AHEAD, walls, LIMITS, creep=True)
    assert (0.0 < creeping[0] < 0.05) == out and (creeping[0] == 0.0) != out


@pytest.mark.parametrize(
    "obstacles",
    [np.zeros((0, 2)), np.array([[np.nan, 0.0], [np.inf, np.inf]]), np.array([[5.0, 0.0]])],
    ids=["nothing", "no points", "far away"],
)
def test_where_nothing_stands_it_does_as_it_is_asked(obstacles):
    assert braking.allowed(AHEAD, obstacles, LIMITS).tolist() == AHEAD.tolist()
    assert braking.room_m(AHEAD, obstacles, LIMITS, 2.0) == 2.0
