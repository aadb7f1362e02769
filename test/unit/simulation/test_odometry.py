from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.simulation.odometry import EXACT, Odometry, OdometryParams
from glass_nav.simulation.path_follower import PathFollower
from glass_nav.simulation.robot import KINDS, Obstacles, Robot, RobotParams, arc

STEP_S = 0.02


def reported(p, kind, twists, seed=0):
    odometry = Odometry(p, kind, np.random.default_rng(seed))
    for twist in twists:
        odometry.step(np.array(twist, float), STEP_S)
    return odometry


def true_pose(twists):
    pose = np.zeros(3)
    for twist in twists:
        pose = se2.compose(pose, arc(np.array(twist, float)))
    return pose


@pytest.fixture(scope="module", params=KINDS)
def office_drive(request):
    """kind, twists and poses of a drive of 33 m round a corridor."""
    waypoints = np.array([[0, 0], [8, 0], [8, 6], [2, 6], [2, 3], [5, 3], [5, 1], [0, 1], [0, 0]], float)
    params = RobotParams(request.param)
    follower = PathFollower(waypoints, params)
    robot = Robot(params, follower.start, Obstacles(np.zeros((0, 2, 2))))
    twists = []
    while not (follower.done and robot.standing):
        twists.append(robot.step(follower.command(robot.map_from_base), STEP_S))
    return request.param, twists, follower.length_m


def test_exact_wheels_tell_the_truth(office_drive):
    kind, twists, _ = office_drive
    error = reported(EXACT, kind, twists).odom_from_base - true_pose(twists)
    assert np.hypot(*error[:2]) < 1e-6
    assert abs(angles.wrap(error[2])) < 1e-9


@pytest.mark.long_run
def test_an_ordinary_drive_drifts_by_one_to_three_percent(office_drive):
    kind, twists, length_m = office_drive
    truth = true_pose(twists)
    drifts = [
        np.hypot(*(reported(OdometryParams(), kind, twists, seed).odom_from_base - truth)[:2]) / length_m
        for seed in range(12)
    ]
    assert 0.005 < np.median(drifts) < 0.03
    assert max(drifts) < 0.08


def test_a_standing_robot_does_not_drift():
    odometry = reported(OdometryParams(slip_event_per_m=1e3), "diff", [[0, 0, 0]] * 1000)
    np.testing.assert_array_equal(odometry.odom_from_base, [0.0, 0.0, 0.0])


def test_a_larger_left_radius_by_hand():
    """Both wheels 1 % too large, the right one 0.2 % more, the left one less: 10 m are reported as 10.1 m on an arc of
    2 * 0.002 / 0.4 rad/m."""
    p = replace(EXACT, wheel_radius_sigma=0.01, wheel_mismatch_sigma=0.002)

    class Ones:
        def normal(self, size):
            return np.ones(size)

        def random(self, size):
            return np.full(size, 0.5)

    odometry = Odometry(p, "diff", Ones())
    odometry.step(np.array([10.0, 0.0, 0.0]), 1.0)
    turn = 10.0 * 2 * 0.002 / 0.4
    np.testing.assert_allclose(odometry.odom_from_base, arc(np.array([10.1, 0.0, turn])))
    np.testing.assert_allclose(odometry.velocity, [10.1, 0.0, turn])


def test_a_wrong_wheel_base_tells_turns_too_wide_and_leaves_ways_alone():
    p = replace(EXACT, wheel_base_sigma=0.01)
    turned = [reported(p, "diff", [[0, 0, 0.01]] * 100, seed).odom_from_base[2] for seed in range(200)]
    assert np.std(turned) == pytest.approx(0.01, rel=0.2)
    assert np.mean(turned) == pytest.approx(1.0, abs=0.003)
    np.testing.assert_allclose(reported(p, "diff", [[0.01, 0, 0]] * 100).odom_from_base, [1.0, 0.0, 0.0], atol=1e-12)


@pytest.mark.long_run
@pytest.mark.parametrize("steps", [10, 400])
def test_slip_grows_with_the_root_of_the_way_however_it_is_cut(steps):
    p = replace(EXACT, slip_m_per_sqrt_m=0.02, slip_rad_per_sqrt_m=0.01)
    ends = np.array([reported(p, "diff", [[4.0 / steps, 0, 0]] * steps, seed).odom_from_base for seed in range(200)])
    assert np.std(ends[:, 0]) == pytest.approx(0.02 * 2, rel=0.2)
    assert np.std(ends[:, 2]) == pytest.approx(0.01 * 2, rel=0.2)


def test_slip_of_a_turn_grows_with_the_root_of_the_turn():
    p = replace(EXACT, slip_rad_per_sqrt_rad=0.02)
    ends = [reported(p, "omni", [[0, 0, 0.1]] * 20, seed).odom_from_base[2] - 2.0 for seed in range(200)]
    assert np.std(ends) == pytest.approx(0.02 * math.sqrt(2.0), rel=0.2)


def test_only_an_omnidirectional_base_slips_sideways():
    p = replace(EXACT, slip_m_per_sqrt_m=0.05)
    assert reported(p, "diff", [[0.1, 0, 0]] * 10).odom_from_base[1] == 0.0
    assert reported(p, "omni", [[0.1, 0, 0]] * 10).odom_from_base[1] != 0.0


@pytest.mark.long_run
@pytest.mark.parametrize("kind", KINDS)
def test_a_wheel_that_spins_tells_a_way_that_was_none(kind):
    p = replace(EXACT, slip_event_per_m=0.05, slip_event_max_m=0.04)
    twists = [[0.01, 0, 0]] * 1000
    ends = np.array([reported(p, kind, twists, seed).odom_from_base for seed in range(60)])
    told_truth = np.abs(ends[:, 2]) < 1e-9
    assert 0.4 < told_truth.mean() < 0.8  # exp(-0.05 * 10) = 0.61
    assert np.abs(ends[~told_truth, 2]).max() < 4 * 0.04 / 0.4
    assert np.abs(ends[~told_truth, 2]).max() > 0.01
    steps = np.abs(np.diff([reported(p, kind, twists[:count], 3).odom_from_base[2] for count in range(0, 1000, 10)]))
    assert steps.max() <= 0.04 / 0.4 + 1e-9  # no jump


def test_a_seed_is_a_robot():
    twists = [[0.01, 0.0, 0.001]] * 300
    ends = [reported(OdometryParams(), "diff", twists, seed).odom_from_base.tobytes() for seed in (1, 1, 2)]
    assert ends[0] == ends[1] != ends[2]


@pytest.mark.parametrize(
    "values, text",
    [
        ({"wheel_base_m": 0.0}, "wheel_base_m of the odometry must be > 0 m, got 0.0"),
        ({"wheel_radius_sigma": -0.1}, "wheel_radius_sigma of the odometry must be >= 0 and finite, got -0.1"),
        ({"slip_event_per_m": math.inf}, "slip_event_per_m of the odometry must be >= 0 and finite, got inf"),
    ],
)
def test_impossible_wheels_are_refused(values, text):
    with pytest.raises(ValueError) as caught:
        OdometryParams(**values)
    assert str(caught.value) == text
