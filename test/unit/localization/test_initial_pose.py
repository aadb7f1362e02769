"""Where the robot starts, by default and as somebody says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.localization.initial_pose import StartPose, checked


def test_the_defaults_are_those_of_amcl():
    start = StartPose()  # AMCL 1.17.3, by its documentation: 0.5 m, 0.5 m, 15 degrees
    np.testing.assert_array_equal(start.pose, np.zeros(3))
    np.testing.assert_allclose(np.sqrt(np.diag(start.covariance)), [0.5, 0.5, np.radians(15.0)])


def test_pose_and_covariance_are_in_the_order_x_y_yaw():
    start = StartPose(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    np.testing.assert_array_equal(start.pose, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(start.covariance, np.diag([0.1, 0.2, 0.3]))


def test_a_start_may_be_exact():
    np.testing.assert_array_equal(StartPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0).covariance, np.zeros((3, 3)))


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(initial_pose_x=math.nan), "~initial_pose_x must be finite, got nan"),
        (dict(initial_pose_y=math.inf), "~initial_pose_y must be finite, got inf"),
        (dict(initial_pose_a=-math.inf), "~initial_pose_a must be finite, got -inf"),
        (dict(initial_cov_xx=-0.1), "~initial_cov_xx must be finite and >= 0, got -0.1"),
        (dict(initial_cov_yy=math.nan), "~initial_cov_yy must be finite and >= 0, got nan"),
        (dict(initial_cov_aa=math.inf), "~initial_cov_aa must be finite and >= 0, got inf"),
    ],
)
def test_what_is_no_start_is_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        StartPose(**values)
    assert str(err.value) == text


def test_a_given_poses_axes_are_as_long_as_its_deviations():
    given = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, 0.0], [0.0, 0.0, 0.01]])
    pose, covariance, axes = checked([1, 2, 3], given)
    np.testing.assert_array_equal(pose, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(covariance, given)
    np.testing.assert_allclose(axes @ axes.T, given, atol=1e-15)


@pytest.mark.parametrize(
    "pose, covariance, text",
    [
        ([0, 0], np.eye(3), "a pose needs finite x, y, yaw, got"),
        ([0, 0, math.nan], np.eye(3), "a pose needs finite x, y, yaw, got"),
        ([0, 0, 0], np.eye(2), "a pose needs a finite covariance (3, 3), got"),
        ([0, 0, 0], np.full((3, 3), math.inf), "a pose needs a finite covariance (3, 3), got"),
        ([0, 0, 0], np.triu(np.ones((3, 3))), "the covariance of a pose must be symmetric, got"),
        ([0, 0, 0], np.diag([1.0, -0.1, 1.0]), "the covariance of a pose must not be negative, got"),
    ],
)
def test_a_given_pose_that_is_none_is_refused_in_one_line(pose, covariance, text):
    with pytest.raises(ValueError) as err:
        checked(pose, covariance)
    assert str(err.value).startswith(text) and "\n" not in str(err.value)
