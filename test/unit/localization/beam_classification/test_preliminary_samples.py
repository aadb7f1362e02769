"""The voters stand around the predicted pose as its covariance says, within limits."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import angles
from glass_nav.localization.beam_classification import preliminary_samples
from glass_nav.localization.beam_classification.preliminary_samples import PreliminarySamples

POSE = np.array([3.0, -2.0, 1.0])


def spread(count=37, covariance=None, **limits):
    """Samples without the predicted pose, relative to it."""
    covariance = np.diag([0.04, 0.04, 0.01]) if covariance is None else covariance
    samples = preliminary_samples.around(POSE, covariance, PreliminarySamples(sample_count=count, **limits))
    relative = samples[1:] - POSE
    relative[:, 2] = angles.wrap(relative[:, 2])
    return relative


@pytest.mark.parametrize("count", [1, 2, 3, 37])
def test_the_first_voter_is_the_predicted_pose_and_there_are_as_many_as_asked_for(count):
    samples = preliminary_samples.around(POSE, np.diag([0.04, 0.01, 0.01]), PreliminarySamples(sample_count=count))
    assert samples.shape == (count, 3)
    np.testing.assert_allclose(samples[0], POSE)


def test_voters_stand_at_regular_angular_intervals():
    relative = spread(37)
    bearing = np.sort(np.mod(np.arctan2(relative[:, 1], relative[:, 0]) + 1e-9, 2.0 * np.pi))
    np.testing.assert_allclose(np.diff(bearing), 2.0 * np.pi / 36, atol=1e-9)


def test_voters_stand_one_or_two_deviations_away():
    radius = np.hypot(*spread(37)[:, :2].T)
    assert set(np.round(radius / 0.2, 9)) == {1.0, 2.0}


@pytest.mark.parametrize("axis_rad", [0.6, -0.6, 2.0, 2.8])
def test_the_rings_are_as_long_as_the_covariance(axis_rad):
    along = np.array([np.cos(axis_rad), np.sin(axis_rad)])
    across = np.array([-along[1], along[0]])
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = 0.3**2 * np.outer(along, along) + 0.1**2 * np.outer(across, across)
    relative = spread(37, covariance)[:, :2]
    stretched = np.hypot(relative @ along / 0.3, relative @ across / 0.1)  # circles again
    np.testing.assert_allclose(np.sort(np.unique(np.round(stretched, 6))), [1.0, 2.0])


@pytest.mark.parametrize("count", [10, 37, 360])
def test_headings_reach_two_deviations_and_leave_no_gap(count):
    heading = np.sort(spread(count)[:, 2]) / 0.1
    assert np.abs(heading).max() <= 2.0
    assert np.diff(np.concatenate([[-2.0], heading, [2.0]])).max() < 3.0 * 4.0 / count
    assert abs(heading.mean()) < 4.0 / count


def test_a_filter_that_is_sure_still_asks_around():
    relative = spread(37, np.zeros((3, 3)), sample_min_radius_m=0.05, sample_min_heading_rad=0.03)
    np.testing.assert_allclose(np.unique(np.round(np.hypot(*relative[:, :2].T), 9)), [0.05, 0.1])
    assert 0.05 < np.abs(relative[:, 2]).max() <= 0.06


def test_a_filter_that_knows_nothing_asks_nearby():
    relative = spread(37, np.diag([100.0, 100.0, 10.0]), sample_max_radius_m=0.5, sample_max_heading_rad=0.35)
    np.testing.assert_allclose(np.unique(np.round(np.hypot(*relative[:, :2].T), 9)), [0.5, 1.0])
    assert 0.6 < np.abs(relative[:, 2]).max() <= 0.7


def test_headings_go_round():
    samples = preliminary_samples.around(
        np.array([0.0, 0.0, np.pi - 0.01]), np.diag([0.0, 0.0, 0.04]), PreliminarySamples()
    )
    assert samples[:, 2].min() >= -np.pi and samples[:, 2].max() < np.pi
    assert np.all(np.abs(angles.wrap(samples[:, 2] - np.pi)) < 0.42)


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(sample_count=0), "~sample_count must be >= 1, got 0"),
        (dict(sample_min_radius_m=0.0), "~sample_min_radius_m must be in (0, ~sample_max_radius_m = 0.5] m, got 0.0"),
        (dict(sample_min_radius_m=0.6), "~sample_min_radius_m must be in (0, ~sample_max_radius_m = 0.5] m, got 0.6"),
        (
            dict(sample_min_heading_rad=0.0),
            "~sample_min_heading_rad must be in (0, ~sample_max_heading_rad = 0.35] rad, got 0.0",
        ),
        (
            dict(sample_max_heading_rad=0.001),
            "~sample_min_heading_rad must be in (0, ~sample_max_heading_rad = 0.001] rad, got 0.005",
        ),
    ],
)
def test_wrong_limits_are_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        PreliminarySamples(**values)
    assert str(err.value) == text
