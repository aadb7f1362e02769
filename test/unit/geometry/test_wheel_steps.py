"""Steps of a base on two wheels, against the glass document's equations and against circles."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2, wheel_steps

BASE_M = 0.4


def by_document(pose, left_m, right_m):
    """Equations (2) to (4) of seed document glass_localization.txt, as they are printed."""
    forward_m = 0.5 * (left_m + right_m)
    turn = np.arctan((right_m - left_m) / BASE_M)
    x, y, yaw = pose
    return np.array([x + forward_m * np.cos(yaw), y + forward_m * np.sin(yaw), yaw + turn])


def test_short_steps_are_those_of_the_document():
    rng = np.random.default_rng(0)
    left_m, right_m = rng.uniform(-0.5, 1.0, 2)
    for parts, limit_m in ((100, 2e-2), (10_000, 2e-4)):
        pose = np.array([1.0, 2.0, 0.3])
        start = pose
        for _ in range(parts):
            pose = by_document(pose, left_m / parts, right_m / parts)
        ours = wheel_steps.followed(start, np.array([left_m]), np.array([right_m]), BASE_M)[0]
        assert np.hypot(*(pose - ours)[:2]) < limit_m and abs(pose[2] - ours[2]) < limit_m


def test_wheels_that_roll_unequally_drive_a_circle():
    around = wheel_steps.step_of(2.0 * np.pi * (1.0 - BASE_M / 2.0), 2.0 * np.pi * (1.0 + BASE_M / 2.0), BASE_M)
    np.testing.assert_allclose(around, [0.0, 0.0, 2.0 * np.pi], atol=1e-9)
    half = wheel_steps.step_of(np.pi * (1.0 - BASE_M / 2.0), np.pi * (1.0 + BASE_M / 2.0), BASE_M)
    np.testing.assert_allclose(half, [0.0, 2.0, np.pi], atol=1e-9)


def test_equal_wheels_drive_straight_and_opposite_ones_turn_on_the_spot():
    np.testing.assert_allclose(wheel_steps.step_of(0.5, 0.5, BASE_M), [0.5, 0.0, 0.0])
    np.testing.assert_allclose(wheel_steps.step_of(-0.2, 0.2, BASE_M), [0.0, 0.0, 1.0])


@pytest.mark.parametrize("left_m, right_m", [(0.3, 0.5), (-0.3, -0.2), (0.0, 0.4), (-0.1, 0.1), (0.2, 0.2)])
def test_increments_come_back_from_their_step(left_m, right_m):
    back = wheel_steps.increments_of(wheel_steps.step_of(left_m, right_m, BASE_M), BASE_M)
    np.testing.assert_allclose(back, [left_m, right_m, 0.0], atol=1e-12)


def test_a_step_of_several_arcs_is_one_arc_that_is_turned():
    step = np.array([0.3, 0.2, -0.4])
    left_m, right_m, turned = wheel_steps.increments_of(step, BASE_M)
    arc = wheel_steps.step_of(left_m, right_m, BASE_M)
    moved = se2.compose(np.array([0.0, 0.0, turned]), arc)
    np.testing.assert_allclose(moved[:2], step[:2], atol=1e-12)
    assert arc[2] == pytest.approx(step[2])


def test_steps_follow_one_another():
    rng = np.random.default_rng(1)
    left_m, right_m = rng.uniform(-0.1, 0.3, (2, 30))
    pose = np.array([3.0, -1.0, 3.0])
    poses = wheel_steps.followed(pose, left_m, right_m, BASE_M)
    for index in range(30):
        pose = se2.compose(pose, wheel_steps.step_of(left_m[index], right_m[index], BASE_M))
        np.testing.assert_allclose(poses[index], pose, atol=1e-9)
