"""Line segments of points, against cases worked by hand and lines drawn from known segments."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import segments
from glass_nav.geometry.segments import NO_SEGMENT


def along(*corners, step=0.1):
    """Points from corner to corner, both included."""
    points = [np.array(corners[:1], float)]
    for start, end in zip(np.array(corners[:-1], float), np.array(corners[1:], float)):
        count = round(np.hypot(*(end - start)) / step)
        points.append(start + np.arange(1, count + 1)[:, None] / count * (end - start))
    return np.concatenate(points)


def test_a_right_angle_is_two_segments_that_meet_in_the_corner():
    points = along((0, 0), (4, 0), (4, 2))
    found, label = segments.split_and_merge(points, tolerance=0.05, least_length=0.3)
    np.testing.assert_allclose(found, [[0, 0, 4, 0], [4, 0, 4, 2]], atol=1e-9)
    assert label.tolist() == [0] * 40 + [1] * 21


@pytest.mark.parametrize("seed", range(10))
def test_a_rough_wall_is_one_segment_near_the_true_one(seed):
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-np.pi, np.pi)
    true = np.array([np.cos(angle), np.sin(angle)])
    points = along((0, 0), 5.0 * true) + rng.uniform(-0.05, 0.05, (51, 2))
    found, label = segments.split_and_merge(points, tolerance=0.12, least_length=0.3)
    assert len(found) == 1 and (label == 0).all()
    np.testing.assert_allclose(found[0], [0, 0, *(5.0 * true)], atol=0.08)


def test_a_segment_runs_as_its_points_do():
    points = along((3, 1), (0, 1))
    np.testing.assert_allclose(segments.fit(points), [3, 1, 0, 1], atol=1e-12)
    np.testing.assert_allclose(segments.fit(points[::-1]), [0, 1, 3, 1], atol=1e-12)


def test_the_line_of_a_segment_is_that_of_least_squared_distances():
    """Against the eigenvector of the scatter matrix."""
    points = np.random.default_rng(0).normal(0.0, [2.0, 0.3], (200, 2)) @ np.array([[0.6, 0.8], [-0.8, 0.6]])
    found = segments.fit(points)
    direction = (found[2:] - found[:2]) / np.hypot(*(found[2:] - found[:2]))
    axis = np.linalg.eigh(np.cov(points.T))[1][:, 1]
    assert abs(direction @ axis) == pytest.approx(1.0, abs=1e-12)
    offset = points.mean(axis=0) - found[:2]
    assert offset[0] * direction[1] - offset[1] * direction[0] == pytest.approx(0.0, abs=1e-12)


def test_an_arc_is_chords_no_further_from_it_than_the_tolerance():
    angle = np.linspace(0.0, np.pi, 200)
    points = 2.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    found, label = segments.split_and_merge(points, tolerance=0.05, least_length=0.1)
    assert (label >= 0).all() and 4 <= len(found) <= 12
    middle = (found[:, :2] + found[:, 2:]) / 2.0
    assert (np.abs(np.hypot(*middle.T) - 2.0) < 0.1).all()


def test_what_is_short_is_none():
    points = along((0, 0), (4, 0), (4, 0.2), (8, 0.2))
    found, label = segments.split_and_merge(points, tolerance=0.05, least_length=0.3)
    assert len(found) == 2 and (label == NO_SEGMENT).sum() <= 2
    assert len(segments.split_and_merge(points, 0.05, 5.0)[0]) == 0


@pytest.mark.parametrize(
    "points", [np.zeros((0, 2)), np.ones((1, 2)), np.ones((5, 2))], ids=["none", "one", "five times the same"]
)
def test_points_that_make_no_line_make_no_segment(points):
    found, label = segments.split_and_merge(points, 0.1, 0.3)
    assert found.shape == (0, 4) and (label == NO_SEGMENT).all() and len(label) == len(points)


def test_a_closed_line_has_its_corners():
    points = along((0, 0), (2, 0), (2, 1), (0, 1), (0, 0))
    assert points[segments.corners(points, 0.05)].round(9).tolist() == [[0, 0], [2, 0], [2, 1], [0, 1], [0, 0]]


def test_equal_variances_give_the_plain_fit_and_the_textbook_covariance():
    """Points along x, 1 apart, at y = 2: the heading's variance is s^2 / sum x^2 about the middle, the offset's there
    s^2 / N; seen from x = 0 the turn adds its lever."""
    points = np.column_stack([np.arange(3.0, 8.0), np.full(5, 2.0)])
    found, covariance = segments.weighted_fit(points, np.full(5, 0.04))
    np.testing.assert_allclose(found, segments.fit(points), atol=1e-12)
    heading = 0.04 / 10.0
    np.testing.assert_allclose(
        covariance, [[heading, -5.0 * heading], [-5.0 * heading, 0.04 / 5 + 25 * heading]], rtol=1e-9
    )


def test_a_point_that_is_hardly_known_hardly_moves_the_line():
    points = np.column_stack([np.arange(5.0), [0, 0, 0, 0, 1.0]])
    found, _ = segments.weighted_fit(points[::-1], np.array([1e6, 1.0, 1.0, 1.0, 1.0]))
    np.testing.assert_allclose(found, [4, 0, 0, 0], atol=1e-4)
