"""Two inscribed-angle circles: cases worked by hand, and random ones."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import angles
from glass_nav.localization.bearings import inscribed_circles

RIGHT_ANGLES = np.array([[4.0, 0.0], [0.0, 3.0], [-5.0, 0.0]])


def seen_from(landmarks_m: np.ndarray, pose: np.ndarray) -> np.ndarray:
    way = landmarks_m - pose[..., None, :2]
    return np.arctan2(way[..., 1], way[..., 0]) - pose[..., None, 2]


def test_landmarks_at_right_angles_are_seen_from_the_foot_of_the_height():
    # Thales: the circles over the sides AB and BC meet where the height from B meets AC, here the origin.
    poses, misfit = inscribed_circles.intersect(RIGHT_ANGLES[None], np.radians([[0.0, 90.0, 180.0]]))
    np.testing.assert_allclose(poses, [[0.0, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(misfit, [0.0], atol=1e-12)


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (2, 1, 0), (0, 2, 1)])
def test_the_order_of_the_landmarks_does_not_matter(order):
    pose = np.array([1.0, -2.0, 0.7])
    directions = seen_from(RIGHT_ANGLES, pose)
    found, _ = inscribed_circles.intersect(RIGHT_ANGLES[None, order], directions[None, order])
    np.testing.assert_allclose(found[0], pose, atol=1e-12)


@pytest.mark.parametrize(
    "place",
    [pytest.param((2.0, 1.5), id="between A and B"), pytest.param((8.0, -3.0), id="beyond A, in line with A and B")],
)
def test_a_robot_in_line_with_two_landmarks_is_found(place):  # one circle is a straight line there
    pose = np.array([*place, -1.2])
    found, _ = inscribed_circles.intersect(RIGHT_ANGLES[None], seen_from(RIGHT_ANGLES, pose)[None])
    np.testing.assert_allclose(found[0], pose, atol=1e-12)


def test_landmarks_in_a_line_give_the_pose_of_a_robot_beside_it():
    line = np.array([[0.0, 0.0], [2.0, 0.0], [5.0, 0.0]])
    pose = np.array([1.0, 3.0, 2.0])
    found, _ = inscribed_circles.intersect(line[None], seen_from(line, pose)[None])
    np.testing.assert_allclose(found[0], pose, atol=1e-12)


@pytest.mark.parametrize("first", range(0, 10000, 2500))
def test_exact_bearings_give_the_pose_wherever_the_landmarks_are(first):
    """Property: 1e-9 m over 10^4 random geometries that are 2 degrees or more away from the critical circle."""
    rng = np.random.default_rng(first)
    wanted, poses, landmarks = 2500, np.zeros((0, 3)), np.zeros((0, 3, 2))
    while len(poses) < wanted:
        tried = rng.uniform(-15.0, 15.0, (wanted, 3, 2))
        pose = np.column_stack([rng.uniform(-15.0, 15.0, (wanted, 2)), rng.uniform(-np.pi, np.pi, wanted)])
        excess = inscribed_circles.off_circle(tried, seen_from(tried, pose), np.full((wanted, 3), np.sqrt(0.5)))
        away = excess > np.radians(2.0)
        poses, landmarks = np.concatenate([poses, pose[away]]), np.concatenate([landmarks, tried[away]])
    poses, landmarks = poses[:wanted], landmarks[:wanted]
    found, misfit = inscribed_circles.intersect(landmarks, seen_from(landmarks, poses))
    assert np.hypot(*(found - poses)[:, :2].T).max() < 1e-9
    assert np.abs(angles.wrap(found[:, 2] - poses[:, 2])).max() < 1e-9
    assert misfit.max() < 1e-9


def test_directions_that_no_place_sees_are_told_by_a_misfit_of_half_a_turn():
    directions = np.radians([[0.0, 90.0, 180.0]])
    behind = directions + [[0.0, np.pi, 0.0]]  # B on the wrong side: the same circles, but nobody sees it there
    poses, misfit = inscribed_circles.intersect(RIGHT_ANGLES[None], behind)
    np.testing.assert_allclose(misfit, [np.pi], atol=1e-9)


@pytest.mark.parametrize(
    "landmarks_m",
    [pytest.param(RIGHT_ANGLES, id="circle"), pytest.param(np.array([[0.0, 1.0], [2.0, 2.0], [6.0, 4.0]]), id="line")],
)
def test_nothing_tells_where_on_the_circle_through_the_landmarks_the_robot_is(landmarks_m):
    centre, radius = inscribed_circles.circle(landmarks_m)
    way = np.array([0.7, 2.0, -1.9])[:, None]
    if np.isfinite(radius):
        points = centre + radius * np.hstack([np.cos(way), np.sin(way)])
    else:
        points = landmarks_m[0] + way * (landmarks_m[1] - landmarks_m[0])
    poses = np.column_stack([points, [0.0, 1.0, 2.0]])
    directions = seen_from(landmarks_m, poses)
    assert (
        inscribed_circles.off_circle(np.tile(landmarks_m, (3, 1, 1)), directions, np.full((3, 3), 0.01)) < 1e-6
    ).all()
    # one circle gives the same angles from everywhere on it; a line gives 0 or pi
    between = np.mod(np.diff(directions, axis=1), np.pi)
    np.testing.assert_allclose(np.sin(between - between[0]), 0.0, atol=1e-9)


def test_a_circle_is_counted_in_standard_deviations_of_the_angle_between_two_landmarks():
    # 1 m inside the circle of radius 5 around the origin, on its axis: AC is seen at 2 atan(5 / 4), not at 90 degrees.
    landmarks_m = np.array([[0.0, 5.0], [5.0, 0.0], [0.0, -5.0]])
    pose = np.array([-4.0, 0.0, 0.0])
    directions = seen_from(landmarks_m, pose)
    excess = [
        np.pi / 2.0 - 2.0 * np.arctan2(5.0, 4.0),  # inscribed at B is a right angle
        np.arctan2(5.0, 4.0) - np.pi / 4.0,
    ]  # and 45 degrees at A and C
    expected = np.abs(excess).min() / np.hypot(0.01, 0.02)
    found = inscribed_circles.off_circle(landmarks_m[None], directions[None], np.array([[0.01, 0.02, 0.01]]))
    np.testing.assert_allclose(found, [expected], rtol=1e-9)


def test_a_circle_through_three_points_is_as_far_from_each_of_them():
    points = np.array([[1.0, 2.0], [4.0, -1.0], [0.5, -3.0]])
    centre, radius = inscribed_circles.circle(points)
    np.testing.assert_allclose(np.hypot(*(points - centre).T), radius)
    assert inscribed_circles.circle(np.array([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]]))[1] == np.inf
