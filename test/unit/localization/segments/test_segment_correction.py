"""Correction by segments: single steps worked by hand, rooms of known walls, and what is not defined by the walls."""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from buildings import CORRIDOR, L_ROOM, off

from glass_nav.geometry import angles, se2
from glass_nav.localization.particle_filter import importance_weights
from glass_nav.localization.segments.segment_correction import SegmentCorrectionParams, SegmentCorrector, judged, votes
from glass_nav.simulation import building_file, building_map, lidar
from glass_nav.world import wall_segments

MAPS = Path(__file__).resolve().parents[4] / "maps"
FLOOR = np.array([[-10.0, 0.0, 10.0, 0.0]])
CORNER = np.array([[0.0, 0.0, 10.0, 0.0], [0.0, 10.0, 0.0, 0.0]])


def document(**more):
    return SegmentCorrectionParams(method="document", **more)


def starts(true, count, seed, reach_m=0.4, reach_rad=np.radians(8.0)):
    rng = np.random.default_rng(seed)
    shift = rng.uniform(-1.0, 1.0, (count, 3)) * [reach_m / np.sqrt(2), reach_m / np.sqrt(2), reach_rad]
    return np.asarray(true) + shift


# -- single steps


def test_a_point_in_the_middle_of_the_neighbourhood_has_half_a_vote():
    np.testing.assert_allclose(votes(np.array([0.0, 0.2, 0.4, np.inf]), 0.2), [1.0, 0.5, 0.2, 0.0])


def test_one_step_of_the_document_is_the_weighted_mean_of_all_displacements():
    """Two points: 0.3 m above the floor, 0.1 m right of the wall; c = 0.3, so weights 1/2 and 9/10."""
    corrector = SegmentCorrector(CORNER, document(neighbourhood_m=0.3, iterations=1, correct_orientation=False))
    moved = corrector.correct(np.array([[5.0, 0.3], [0.1, 5.0]]), np.zeros(3)).map_from_base
    np.testing.assert_allclose(moved, [0.9 * -0.1 / 1.4, 0.5 * -0.3 / 1.4, 0.0], atol=1e-12)


def test_one_step_of_least_squares_puts_both_walls_where_they_are():
    corrector = SegmentCorrector(
        CORNER, SegmentCorrectionParams(neighbourhood_m=0.3, iterations=1, correct_orientation=False)
    )
    moved = corrector.correct(np.array([[5.0, 0.3], [0.1, 5.0]]), np.zeros(3)).map_from_base
    np.testing.assert_allclose(moved, [-0.1, -0.3, 0.0], atol=1e-12)


def test_the_neighbourhood_shrinks_as_the_document_says():
    """Two steps, c = 0.4 and 0.2, of one point near a wall and one 0.4 m from it, worked by hand."""
    corrector = SegmentCorrector(FLOOR, document(neighbourhood_m=0.4, iterations=2, correct_orientation=False))
    y, far = 0.1, 0.4
    for c in (0.4, 0.2):
        near_w, far_w = c**2 / (y**2 + c**2), c**2 / (far**2 + c**2)
        step = (near_w * y + far_w * far) / (near_w + far_w)
        y, far = y - step, far - step
    moved = corrector.correct(np.array([[1.0, 0.1], [2.0, 0.4]]), np.zeros(3)).map_from_base
    assert moved[1] == pytest.approx(y - 0.1, abs=1e-12)


def test_beyond_its_end_a_segment_pulls_to_its_line():
    corrector = SegmentCorrector(FLOOR, document(iterations=1, correct_orientation=False))
    moved = corrector.correct(np.array([[10.4, 0.3]]), np.zeros(3)).map_from_base
    np.testing.assert_allclose(moved, [0.0, -0.3, 0.0], atol=1e-12)


@pytest.mark.parametrize("method", ["document", "least_squares"])
def test_a_turned_robot_is_turned_back(method):
    true = np.array([0.0, 1.0, 0.3])
    points = se2.transform_points(se2.inverse(true), np.column_stack([np.linspace(-4, 4, 41), np.zeros(41)]))
    corrector = SegmentCorrector(FLOOR, SegmentCorrectionParams(method=method))
    for turn in (-0.15, 0.1):
        found = corrector.correct(points, true + [0.0, 0.0, turn])
        assert found.map_from_base[1:] == pytest.approx(true[1:], abs=2e-3)
        left = corrector.correct(points, true + [0.0, 0.0, turn]).map_from_base[2]
        assert abs(left - true[2]) < abs(turn)
    kept = SegmentCorrector(FLOOR, SegmentCorrectionParams(method=method, correct_orientation=False))
    assert kept.correct(points, true + [0.0, 0.2, 0.05]).map_from_base[2] == pytest.approx(0.35, abs=1e-12)


# -- rooms


@pytest.fixture(scope="module")
def room_walls():
    return wall_segments.extract(L_ROOM.grid_map(), wall_segments.FINE_TOLERANCE_CELLS).segments_m


@pytest.mark.parametrize("seed", range(5))
def test_in_a_room_a_scan_finds_the_true_pose(room_walls, seed):
    true = np.array([2.3, 1.7, 0.4 * seed])
    points = L_ROOM.scan(true, rng=np.random.default_rng(seed)).points_in_base()
    corrector = SegmentCorrector(room_walls)
    for start in starts(true, 5, seed):
        found = corrector.correct(points, start)
        away_m, away_rad = off(found.map_from_base, true)
        assert away_m < 0.02 and away_rad < np.radians(0.3)
        assert not len(found.free) and found.free_heading_rad is None
        assert found.after.combined > found.before.combined and found.after.mse_m2 < found.before.mse_m2


def test_in_a_room_the_document_finds_it_too_with_more_steps(room_walls):
    true = np.array([2.3, 1.7, 1.0])
    points = L_ROOM.scan(true, rng=np.random.default_rng(0)).points_in_base()
    corrector = SegmentCorrector(room_walls, document(iterations=60))
    for start in starts(true, 5, 0, 0.2, np.radians(4.0)):
        away_m, away_rad = off(corrector.correct(points, start).map_from_base, true)
        assert away_m < 0.02 and away_rad < np.radians(0.3)


def test_people_in_a_room_do_not_pull(room_walls):
    true = np.array([2.3, 1.7, 1.0])
    points = L_ROOM.scan(true, rng=np.random.default_rng(0)).points_in_base().copy()
    points[20:50] *= 0.55  # a sixth of the beams end at somebody
    corrector = SegmentCorrector(room_walls)
    for start in starts(true, 5, 1, 0.3, np.radians(5.0)):
        found = corrector.correct(points, start)
        away_m, away_rad = off(found.map_from_base, true)
        assert away_m < 0.02 and away_rad < np.radians(0.3)
        assert found.after.mse_m2 > 100.0 * found.after.mse_inliers_m2  # the document's Emse is spoilt by them
        assert 0.75 < found.after.inlier_share < 0.9


# -- what walls do not constrain


@pytest.mark.parametrize("method", ["document", "least_squares"])
@pytest.mark.parametrize("heading_deg", [0.0, 30.0, 90.0, 155.0])
def test_in_a_hallway_only_the_way_across_is_corrected(method, heading_deg):
    """The document's hallway effect, for hallways along an axis and others."""
    hall = np.array([0.0, 0.0, np.radians(heading_deg)])
    walls = se2.transform_points(hall, CORRIDOR.lines_m[[0, 2]].reshape(-1, 2)).reshape(-1, 4)
    in_hall = np.array([30.0, 1.1, 0.2])
    scan = CORRIDOR.scan(in_hall)
    points = scan.points_in_base()[scan.ranges_m < 12.0]
    along, across = np.array([np.cos(hall[2]), np.sin(hall[2])]), np.array([-np.sin(hall[2]), np.cos(hall[2])])
    true, shift = se2.compose(hall, in_hall), 0.3 * along + 0.2 * across
    corrector = SegmentCorrector(walls, SegmentCorrectionParams(method=method, iterations=30))
    found = corrector.correct(points, true + [*shift, np.radians(3.0)])
    left = found.map_from_base - true
    assert left[:2] @ across == pytest.approx(0.0, abs=0.01) and abs(angles.wrap(left[2])) < np.radians(0.3)
    assert left[:2] @ along == pytest.approx(0.3, abs=1e-3)
    assert found.free_heading_rad is not None
    assert abs(np.sin(found.free_heading_rad - hall[2])) < 1e-3
    np.testing.assert_allclose(found.free @ found.free.T, np.eye(1), atol=1e-12)


def test_one_wall_leaves_the_way_along_it_free():
    points = np.column_stack([np.linspace(-2, 2, 21), np.full(21, -1.0)])
    found = SegmentCorrector(FLOOR).correct(points, np.array([3.0, 1.2, 0.1]))
    assert found.map_from_base == pytest.approx([3.0, 1.0, 0.0], abs=1e-3)
    assert found.free_heading_rad == pytest.approx(0.0, abs=1e-3) or found.free_heading_rad == pytest.approx(
        np.pi, abs=1e-3
    )


def test_one_point_constrains_one_direction_of_three():
    found = SegmentCorrector(FLOOR).correct(np.array([[0.0, -1.0]]), np.array([0.0, 1.2, 0.0]))
    assert found.map_from_base == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert found.free.shape == (2, 3) and found.free_heading_rad is None


@pytest.mark.parametrize("method", ["document", "least_squares"])
@pytest.mark.parametrize(
    "segments, points",
    [
        pytest.param(np.zeros((0, 4)), np.ones((5, 2)), id="no segments"),
        pytest.param(FLOOR, np.zeros((0, 2)), id="no points"),
        pytest.param(FLOOR, np.full((4, 2), np.nan), id="no finite point"),
        pytest.param(np.zeros((0, 4)), np.zeros((0, 2)), id="neither"),
    ],
)
def test_where_there_is_nothing_to_fit_the_pose_stays_and_says_so(method, segments, points):
    corrector = SegmentCorrector(segments, SegmentCorrectionParams(method=method))
    found = corrector.correct(points, np.array([1.0, 2.0, 3.0]))
    assert found.map_from_base.tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_array_equal(found.free, np.eye(3))
    assert found.after == found.before or np.isnan(found.after.mse_m2)
    assert (found.after.classification_factor, found.after.combined, found.after.inlier_share) == (0.0, 0.0, 0.0)


def test_points_that_are_not_finite_make_no_difference(room_walls):
    true = np.array([2.3, 1.7, 1.0])
    points = L_ROOM.scan(true, rng=np.random.default_rng(0)).points_in_base()
    spoilt = np.insert(
        points, [0, 7, 7, 90, 180], [[np.nan, 1], [np.inf, 0], [0, -np.inf], [np.nan] * 2, [1, np.nan]], axis=0
    )
    corrector = SegmentCorrector(room_walls)
    clean, found = corrector.correct(points, true + 0.1), corrector.correct(spoilt, true + 0.1)
    np.testing.assert_array_equal(found.map_from_base, clean.map_from_base)
    assert found.after == clean.after
    assert astuple(corrector.quality(spoilt, found.map_from_base)) == pytest.approx(astuple(found.after), rel=1e-9)


def test_bad_input_is_refused():
    corrector = SegmentCorrector(FLOOR)
    with pytest.raises(ValueError, match=r"a rough pose needs finite x, y, yaw, got \[0.0, nan, 0.0\]"):
        corrector.correct(np.ones((2, 2)), [0.0, np.nan, 0.0])
    with pytest.raises(ValueError, match=r"end points must have shape \(N, 2\), got \(2, 3\)"):
        corrector.correct(np.ones((2, 3)), np.zeros(3))


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"method": "icp"}, "method must be one of least_squares, document, got 'icp'"),
        ({"neighbourhood_m": 0.0}, "neighbourhood_m must be finite and > 0 m, got 0.0"),
        (
            {"classification_neighbourhood_m": np.inf},
            "classification_neighbourhood_m must be finite and > 0 m, got inf",
        ),
        ({"outlier_m": np.inf}, "outlier_m must be finite and > 0 m, got inf"),
        ({"iterations": 0}, "iterations must be >= 1, got 0"),
        ({"least_constraint": 1.0}, "least_constraint must be in (0, 1), got 1.0"),
    ],
)
def test_parameters_that_mean_nothing_are_refused(fields, line):
    with pytest.raises(ValueError) as refused:
        SegmentCorrectionParams(**fields)
    assert str(refused.value) == line


# -- quality


def test_the_measures_by_hand():
    """Distances 0, 0.1 and an outlier of 2 m; c = 0.1, so votes 1, 1/2 and 1/401."""
    quality = judged(np.array([0.0, 0.1, 2.0]), 0.1, 0.3, 0.05)
    factor = (1.0 + 0.5 + 1.0 / 401.0) / 3.0
    assert quality.points == 3 and quality.inlier_share == pytest.approx(2.0 / 3.0)
    assert quality.mse_m2 == pytest.approx(4.01 / 3.0) and quality.mse_inliers_m2 == pytest.approx(0.005)
    assert quality.classification_factor == pytest.approx(factor)
    assert quality.combined == pytest.approx(factor * 0.0025 / (0.0025 + 4.01 / 3.0))


def test_all_measures_are_best_at_the_true_pose(room_walls):
    true = np.array([2.3, 1.7, 1.0])
    points = L_ROOM.scan(true).points_in_base()
    corrector = SegmentCorrector(room_walls)
    here = corrector.quality(points, true)
    for shift in ([0.1, 0.0, 0.0], [0.0, -0.1, 0.0], [0.0, 0.0, 0.05], [0.3, 0.2, 0.0], [0.0, 0.0, -0.2]):
        there = corrector.quality(points, true + shift)
        assert there.mse_m2 > here.mse_m2 and there.combined < here.combined
        assert there.classification_factor < here.classification_factor


def test_the_combined_measure_falls_with_the_distance_from_the_true_pose(room_walls):
    """From 0.05 m on, in at least 95 % of 200 random directions from random places of the room."""
    rng = np.random.default_rng(0)
    corrector = SegmentCorrector(room_walls)
    falling = 0
    for _ in range(200):
        true = np.array([rng.uniform(1.0, 4.0), rng.uniform(1.0, 3.0), rng.uniform(-np.pi, np.pi)])
        points = L_ROOM.scan(true, rng=rng).points_in_base()
        heading = rng.uniform(-np.pi, np.pi)
        away = np.array([np.cos(heading), np.sin(heading), 0.0])
        measures = [
            corrector.quality(points, true + distance_m * away).combined for distance_m in (0.05, 0.1, 0.2, 0.3, 0.6)
        ]
        falling += bool(np.all(np.diff(measures) < 0.0))
    assert falling >= 190


def test_the_classification_factor_does_not_depend_on_the_iterations(room_walls):
    points = L_ROOM.scan(np.array([2.3, 1.7, 1.0])).points_in_base()
    factors = {
        SegmentCorrector(room_walls, SegmentCorrectionParams(iterations=iterations))
        .quality(points, np.array([2.4, 1.7, 1.0]))
        .classification_factor
        for iterations in (1, 15, 40)
    }
    assert len(factors) == 1


# -- glass


@pytest.fixture(scope="module")
def bridge():
    """Walls of a bridge of glass, and poses from which a lidar sees much through it and little of it."""
    building = building_file.load(MAPS / "glass_bridge" / "building.yaml")
    walls = wall_segments.extract(building_map.draw(building), wall_segments.FINE_TOLERANCE_CELLS).segments_m
    model, rng = lidar.preset("weak"), np.random.default_rng(7)
    way = building.paths["across"]
    yaw = np.arctan2(*(way[-1] - way[0])[::-1])
    poses = [np.array([*(way[0] + share * (way[-1] - way[0])), yaw]) for share in (0.1, 0.2, 0.4, 0.6, 0.8, 0.9)]
    return walls, model.angles_rad, [(pose, lidar.scan(model, building, pose, 0.0, rng)) for pose in poses]


def test_what_was_mirrored_or_seen_where_no_map_is_pulls_on_the_wrong_walls_unless_its_case_is_known(bridge):
    walls, angles_rad, views = bridge
    corrector = SegmentCorrector(walls)
    masked, unmasked = [], []
    for number, (true, seen) in enumerate(views):
        answered = np.isfinite(seen.ranges_m)
        towards = np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])
        points = np.where(answered, seen.ranges_m, np.nan)[:, None] * towards
        known = importance_weights.known_ends(seen.case)
        assert 0.6 < np.mean(known) < 1.0
        for start in starts(true, 4, number, 0.3, np.radians(6.0)):
            for chosen, errors in ((known, masked), (answered, unmasked)):
                found = corrector.correct(points[chosen], start)
                errors.append(_error_in_constrained_directions(found, true))
    assert max(masked) < 0.03
    assert np.mean(np.array(unmasked) > 0.2) == 0.5  # in the middle of the bridge


def _error_in_constrained_directions(found, true):
    left = np.append(found.map_from_base[:2] - true[:2], found.lever_m * angles.wrap(found.map_from_base[2] - true[2]))
    left -= found.free.T @ (found.free @ left)
    return float(np.hypot(left[0], left[1]))
