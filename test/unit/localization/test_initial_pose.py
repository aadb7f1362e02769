"""Where the robot starts when nobody says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.localization.initial_pose import StartPose


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
