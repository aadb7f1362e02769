from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glass_nav.evaluation.metrics import integrity_scores
from glass_nav.geometry.trajectory import Trajectory

SECOND = 10**9


def claims(off, states="LOCALIZED", level=0.3, deviation=0.1, yaw=0.0, reference=True):
    """Scans a second and half a metre apart, with those errors (S, 3) in map; one state for all, or one each."""
    off = np.array(off, float)
    count = len(off)
    stamps_ns = np.arange(count) * SECOND
    true = np.column_stack([0.5 * np.arange(count), np.zeros(count), np.full(count, yaw)])
    return integrity_scores.trace(
        stamps_ns,
        true + off,
        true,
        [states] * count if isinstance(states, str) else states,
        np.tile(np.diag([deviation**2] * 3), (count, 1, 1)),
        np.full((count, 3), 0.5 * level),
        np.full((count, 3), level),
        Trajectory(stamps_ns, true) if reference else None,
    )


def figures(*args, **kwargs):
    return integrity_scores.summary(claims(*args, **kwargs))


def test_errors_are_along_and_across_the_heading():
    error = claims([[0.3, 0.1, 0.0]], yaw=0.5 * np.pi).error
    np.testing.assert_allclose(error, [[0.1, -0.3, 0.0]], atol=1e-12)


def test_a_covariance_turns_with_the_robot():
    trace = integrity_scores.trace(
        np.array([0]),
        np.array([[0.0, 0.0, 0.5 * np.pi]]),
        np.zeros((1, 3)),
        ["LOCALIZED"],
        np.diag([4.0, 1.0, 0.01])[None],
        np.ones((1, 3)),
        np.ones((1, 3)),
        None,
    )
    np.testing.assert_allclose(trace.covariance[0], np.diag([1.0, 4.0, 0.01]), atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_error_above_its_level_on_any_axis_misleads(axis):
    off = np.zeros((4, 3))
    off[1, axis] = 0.31
    found = figures(off)
    assert found["misleading_share"] == 0.25
    assert found["misleading_max_s"] == 1.0
    assert found["misleading_max_m"] == pytest.approx(0.5, abs=0.32)


def test_only_a_pose_that_is_localized_misleads():
    found = figures(np.tile([5.0, 0.0, 0.0], (4, 1)), ["LOST", "UNCERTAIN", "LOCALIZED", "GLOBAL_SEARCH"])
    assert found["misleading_share"] == 0.25


def test_the_longest_row_counts_not_the_sum():
    off = np.zeros((8, 3))
    off[[1, 2, 5], 0] = 0.4
    assert figures(off)["misleading_max_s"] == 2.0
    assert integrity_scores.rows_of(np.array([True, False, True, True])) == [(0, 0), (2, 3)]


def test_nees_of_consistent_errors_is_that_of_chi_squared():
    rng = np.random.default_rng(3)
    found = figures(rng.normal(0.0, 0.1, (4000, 3)), level=10.0)
    assert found["nees_median"] == pytest.approx(integrity_scores.CONSISTENT_NEES, abs=0.15)
    assert found["level_ratio"] == pytest.approx(10.0 / 0.196, rel=0.1)


def test_certainty_that_is_wrong_has_an_infinite_nees():
    assert np.isinf(claims([[0.1, 0.0, 0.0]], deviation=0.0).nees).all()
    assert np.isinf(claims([[np.inf, 0.0, 0.0]]).nees).all()


def test_a_covariance_of_few_particles_has_no_inverse_and_an_infinite_nees():
    seen = claims([[0.1, 0.0, 0.0]])
    along = np.array([0.48, 0.42, 0.77])  # all particles on two lines; rounding leaves a variance of 1e-16 beside them
    singular = np.outer(along, along) + np.outer([0.1, -0.05, 0.0], [0.1, -0.05, 0.0])
    assert np.isinf(replace(seen, covariance=singular[None]).nees).all()


def test_an_alarm_at_a_small_error_is_false():
    off = [[0.1, 0.0, 0.0], [0.1, 0.0, 0.1], [0.3, 0.0, 0.0], [0.1, 0.0, 0.0]]
    assert figures(off, ["LOST", "LOST", "UNCERTAIN", "LOCALIZED"])["alarm_share"] == 0.25


def test_the_time_to_an_alarm_begins_when_the_pose_goes_wrong():
    off = np.zeros((7, 3))
    off[2:5, 0] = 1.0
    states = ["LOCALIZED"] * 4 + ["LOST"] * 2 + ["LOCALIZED"]
    found = figures(off, states)
    assert (found["time_to_alarm_s"], found["time_back_s"]) == (2.0, 4.0)


def test_without_a_wrong_pose_no_time_passes():
    found = figures(np.zeros((3, 3)))
    assert (found["time_to_alarm_s"], found["time_back_s"]) == (0.0, 0.0)


def test_an_alarm_that_never_comes_is_not_a_number():
    found = figures([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    assert (found["time_to_alarm_s"], found["time_back_s"]) == (None, None)


def test_a_pose_that_comes_right_by_itself_ends_the_wait_for_an_alarm():
    assert figures([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]])["time_to_alarm_s"] == 1.0


def test_without_a_reference_there_is_no_figure():
    assert set(figures(np.zeros((3, 3)), reference=False).values()) == {None}


def test_without_a_localized_scan_there_is_no_nees_and_no_ratio():
    found = figures(np.zeros((3, 3)), "LOST")
    assert found["nees_median"] is None and found["level_ratio"] is None
    assert found["misleading_share"] == 0.0


def test_an_imprecise_reference_excuses_as_much_as_it_is_off():
    trace = claims([[0.35, 0.0, 0.0], [0.7, 0.0, 0.0]]).with_reference_deviation(0.1, 0.02)
    assert trace.misleading.tolist() == [False, True]  # sqrt(0.3^2 + 0.329^2) = 0.445
    assert trace.nees[0] == pytest.approx(0.35**2 / 0.02)
