"""The document's tables, and predicted covariance against drawn bearings."""

from __future__ import annotations

import numpy as np
import pytest
from made_bearings import FIELD, VIEWERS, seen
from scipy.optimize import fsolve

from glass_nav.localization.bearings import bearing_errors, triangulation
from glass_nav.world import landmark_map

# Seed document, Table 1: rows 45 to 47 degrees between the first two, columns 53 to 55 between the last two [cm].
TABLE_1 = [
    [19.2, 19.4, 23.7, 30.2, 37.7],
    [15.1, 9.5, 11.7, 18.8, 27.0],
    [19.2, 9.5, 0.0, 9.3, 18.4],
    [27.7, 18.7, 11.4, 9.4, 14.7],
    [37.6, 29.3, 22.6, 18.5, 18.6],
]
# Table 2: rows 34 to 36 degrees, columns 28 to 30.
TABLE_2 = [
    [32.8, 26.0, 35.2, 51.8, 70.1],
    [34.6, 16.1, 17.3, 35.0, 54.4],
    [43.6, 21.4, 0.0, 20.9, 41.0],
    [55.8, 34.6, 16.6, 15.6, 32.2],
    [69.2, 49.4, 32.6, 24.4, 30.9],
]
LENIENT = triangulation.TriangulationLimits(max_misfit_chance=1e-9)  # every draw counts


def around_origin(ranges_m, first_deg, second_deg):
    direction = np.radians([0.0, first_deg, first_deg + second_deg])
    return np.array(ranges_m)[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])


@pytest.mark.parametrize(
    "ranges_m, first_deg, second_deg, table_cm, within_cm",
    [
        pytest.param((8.563, 7.937, 7.573), 46.0, 54.0, TABLE_1, 0.1, id="table 1"),
        pytest.param((8.592, 8.711, 10.210), 35.0, 29.0, TABLE_2, 0.15, id="table 2"),
    ],
)
def test_the_tables_of_the_document_are_met_in_every_cell(ranges_m, first_deg, second_deg, table_cm, within_cm):
    found = bearing_errors.limits_of_error(around_origin(ranges_m, first_deg, second_deg), np.zeros(2), np.radians(1.0))
    assert np.abs(100.0 * found - table_cm).max() < within_cm


def test_a_table_of_another_geometry_is_what_solving_the_two_angles_gives():
    """Second implementation: root finding on the angles as defined, landmarks on three sides of a hall."""
    landmarks_m, point_m, step_rad = np.array([[12.0, 1.0], [2.0, 9.0], [-4.0, -3.0]]), np.array([3.0, 2.0]), 0.0087

    def between(point):
        x, y = (landmarks_m - point).T
        return np.mod(np.diff(np.arctan2(y, x)), 2.0 * np.pi)

    found = bearing_errors.limits_of_error(landmarks_m, point_m, step_rad)
    for row, first in enumerate((-1.0, -0.5, 0.0, 0.5, 1.0)):
        for column, second in enumerate((-1.0, -0.5, 0.0, 0.5, 1.0)):
            wanted = between(point_m) + step_rad * np.array([first, second])
            solved = fsolve(lambda point, wanted=wanted: between(point) - wanted, point_m + 1e-3, xtol=1e-12)
            assert found[row, column] == pytest.approx(np.hypot(*(solved - point_m)), abs=1e-8)
    assert found[2, 2] < 1e-12


@pytest.mark.parametrize(
    ("ranges_m", "between_deg"), [((8.563, 7.937, 7.573), (46.0, 54.0)), ((3.0, 9.0, 4.0), (80.0, 20.0))]
)
def test_the_largest_step_keeps_the_error_just_within_the_limit(ranges_m, between_deg):
    landmarks_m = around_origin(ranges_m, *between_deg)
    step_rad = bearing_errors.largest_step(landmarks_m, np.zeros(2), 0.3)
    assert bearing_errors.limits_of_error(landmarks_m, np.zeros(2), step_rad).max() == pytest.approx(0.3, rel=3e-3)
    np.testing.assert_allclose(np.degrees(bearing_errors.angles_between(landmarks_m, np.zeros(2))), between_deg)


def test_with_landmarks_near_enough_any_step_will_do():
    landmarks_m = around_origin((0.01, 0.02, 0.01), 120.0, 120.0)
    assert bearing_errors.largest_step(landmarks_m, np.zeros(2), 5.0) == np.radians(45.0)


def test_on_the_circle_through_the_landmarks_no_step_is_small_enough():
    landmarks_m = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    with pytest.raises(ValueError, match="no step keeps the error within 0.3 m: the robot is on the circle"):
        bearing_errors.largest_step(landmarks_m, np.array([1.0, 1.0]), 0.3)
    with pytest.raises(ValueError, match="must be at four places"):
        bearing_errors.limits_of_error(landmarks_m, np.array([1.0, 0.0]), 0.01)


def test_a_step_of_one_degree_is_a_uniform_error_of_half_a_degree():
    draws = np.random.default_rng(0).uniform(-0.5, 0.5, 200000)
    assert bearing_errors.step_sigma(1.0) == pytest.approx(draws.std(), rel=0.01)


@pytest.mark.long_run
@pytest.mark.parametrize("number", range(4))
@pytest.mark.parametrize("sigma_deg", [0.1, 0.3])
def test_the_predicted_covariance_is_that_of_drawn_bearings(number, sigma_deg):
    pose, sigma_rad = VIEWERS[number], np.radians(sigma_deg)
    rng = np.random.default_rng(100 + number)
    drawn = np.array(
        [
            triangulation.triangulate(seen(FIELD, pose, sigma_rad, rng), FIELD, LENIENT).map_from_base
            for _ in range(1500)
        ]
    )
    deviation = drawn.std(axis=0)
    predicted = np.sqrt(np.diag(bearing_errors.covariance(FIELD, pose, sigma_rad)))
    np.testing.assert_allclose(deviation, predicted, rtol=0.1)
    told = np.sqrt(np.diag(triangulation.triangulate(seen(FIELD, pose, sigma_rad), FIELD).covariance))
    np.testing.assert_allclose(told, predicted, rtol=1e-6)


@pytest.mark.long_run
def test_the_covariance_counts_how_unsure_the_landmarks_are():
    unsure = landmark_map.seen_from_all_sides(FIELD.ids, FIELD.positions_m, sigma_m=0.05)
    rng, pose, sigma_rad = np.random.default_rng(5), VIEWERS[0], np.radians(0.1)
    drawn = []
    for _ in range(1500):
        there = landmark_map.seen_from_all_sides(FIELD.ids, FIELD.positions_m + rng.normal(0.0, 0.05, (4, 2)))
        drawn.append(triangulation.triangulate(seen(there, pose, sigma_rad, rng), unsure, LENIENT).map_from_base)
    predicted = np.sqrt(np.diag(bearing_errors.covariance(unsure, pose, sigma_rad)))
    np.testing.assert_allclose(np.std(drawn, axis=0), predicted, rtol=0.1)


def test_two_landmarks_fix_no_pose():
    two = landmark_map.seen_from_all_sides("AB", FIELD.positions_m[:2])
    with pytest.raises(ValueError, match="2 landmarks do not fix the pose at x 0.00 m, y 0.00 m: three are needed"):
        bearing_errors.covariance(two, np.zeros(3), 0.01)


def test_sigma_over_points_is_the_worst_direction_of_the_covariance():
    sigma_rad = np.radians(0.3)
    visible = np.ones((4, 4), bool)
    visible[3, 1] = False
    sigma = bearing_errors.expected_sigma(FIELD, VIEWERS[:, :2], visible, sigma_rad)
    for number, pose in enumerate(VIEWERS):
        some = landmark_map.seen_from_all_sides(
            np.array(FIELD.ids)[visible[number]].tolist(), FIELD.positions_m[visible[number]]
        )
        worst = np.linalg.eigvalsh(bearing_errors.covariance(some, pose, sigma_rad)[:2, :2])[-1]
        assert sigma[number] == pytest.approx(np.sqrt(worst), rel=1e-6)


def test_without_three_landmarks_or_on_their_circle_no_position_is_expected():
    circle = landmark_map.seen_from_all_sides("ABC", np.array([[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0]]))
    points = np.array([[0.0, -5.0], [0.0, 1.0], [0.0, 1.0]])
    visible = np.array([[True, True, True], [True, True, False], [True, True, True]])
    sigma = bearing_errors.expected_sigma(circle, points, visible, 0.01)
    assert sigma[0] > 100.0 and sigma[1] == np.inf and sigma[2] < 0.2


def test_a_layout_within_the_drawing_of_figure_6_gives_the_errors_of_figure_7():
    tags_m = np.array([[-3.0, 5.0], [-1.0, 4.0], [0.0, 4.0], [2.0, 5.0]])  # found by test/benchmark/landmark_layouts.py
    errors_m = []
    for viewer_m in np.array([[0.0, 3.0], [-1.0, 3.0], [0.0, 2.0], [-1.0, 2.0]]):
        around = tags_m[np.argsort(np.arctan2(*(tags_m - viewer_m).T))]  # clockwise, as the viewer sees them
        errors_m += [
            bearing_errors.limits_of_error(np.delete(around, left_out, axis=0), viewer_m, np.radians(1.0)).max()
            for left_out in range(4)
        ]
    assert max(errors_m) == pytest.approx(0.135, abs=0.001) and len(errors_m) == 16
