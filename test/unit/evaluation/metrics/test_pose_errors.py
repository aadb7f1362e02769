from __future__ import annotations

import numpy as np
import pytest

from glass_nav.evaluation.metrics import pose_errors
from glass_nav.geometry.trajectory import Trajectory

REFERENCE = Trajectory(np.array([0, 10, 20]) * 10**9, np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 1.0]]))


def test_errors_are_to_the_reference_interpolated_at_each_stamp():
    stamps = np.array([5, 15]) * 10**9
    errors = pose_errors.of(stamps, np.array([[5.0, 3.0, -0.2], [10.0, 9.0, 0.5]]), REFERENCE)
    np.testing.assert_allclose(errors.position_m, [3.0, 4.0])
    np.testing.assert_allclose(errors.yaw_rad, [0.2, 0.0], atol=1e-12)


def test_the_yaw_error_takes_the_shorter_way():
    reference = Trajectory(np.array([0]), np.array([[0.0, 0.0, 3.1]]))
    errors = pose_errors.of(np.array([0]), np.array([[0.0, 0.0, -3.1]]), reference)
    np.testing.assert_allclose(errors.yaw_rad, 2 * np.pi - 6.2)


def test_scans_outside_the_time_of_the_reference_count_in_no_figure():
    stamps = np.array([-1, 0, 20, 21]) * 10**9 + [0, -500_000, 500_000, 0]  # half a millisecond is rounding
    errors = pose_errors.of(stamps, np.tile([3.0, 4.0, 0.0], (4, 1)), REFERENCE)
    assert errors.matched.tolist() == [False, True, True, False]
    assert pose_errors.summary(errors)["position_max_m"] == pytest.approx(np.hypot(7.0, 6.0))


@pytest.mark.parametrize("reference", [None, Trajectory(np.zeros(0, np.int64), np.zeros((0, 3)))])
def test_without_a_reference_every_figure_is_none(reference):
    errors = pose_errors.of(np.array([0]), np.zeros((1, 3)), reference)
    figures = pose_errors.summary(errors)
    assert not errors.matched.any()
    assert set(figures.values()) == {None}
    full = pose_errors.summary(pose_errors.of(np.array([0]), np.zeros((1, 3)), REFERENCE))
    assert figures.keys() == full.keys()


def test_the_figures_are_those_of_the_errors():
    position = np.array([0.0, 0.3, 0.4, 0.6, 2.0])
    figures = pose_errors.summary(pose_errors.PoseErrors(position, np.radians([0.0, 1.0, 2.0, 3.0, 14.0])))
    assert figures == pytest.approx(
        {
            "position_mean_m": 0.66,
            "position_median_m": 0.4,
            "position_rmse_m": np.sqrt((0.09 + 0.16 + 0.36 + 4.0) / 5),
            "position_p95_m": 0.6 + 0.8 * 1.4,
            "position_max_m": 2.0,
            "yaw_mean_deg": 4.0,
            "yaw_median_deg": 2.0,
            "yaw_p95_deg": 3.0 + 0.8 * 11.0,
            "lost_share": 0.4,
            "lost_1m_share": 0.2,
        }
    )


def test_an_estimate_that_is_no_pose_is_lost_and_not_left_out():
    estimates = np.array([[0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    errors = pose_errors.of(np.array([0, 10]) * 10**9, estimates, REFERENCE)
    figures = pose_errors.summary(errors)
    assert figures["lost_share"] == 0.5
    assert figures["position_mean_m"] is None
    assert figures["position_p95_m"] is None
    assert figures["yaw_mean_deg"] == pytest.approx(90.0)
