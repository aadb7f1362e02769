"""Where may a scan have been taken? Branch and bound against trying everything, and rooms by hand."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav import _grid
from glass_nav.geometry import angles, se2
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.world.grid_map import GridMap

BLOCK = 8  # cells


def by_trying(scores, allowed, points, headings):
    """{(block row, block column, heading): best summed score} by looking at every position."""
    height, width = scores.shape
    best = {}
    for heading, angle in enumerate(headings):
        cos, sin = np.cos(angle), np.sin(angle)
        dx = np.round(cos * points[:, 0] - sin * points[:, 1] + 1e-12).astype(int)
        dy = np.round(sin * points[:, 0] + cos * points[:, 1] + 1e-12).astype(int)
        for row, column in zip(*np.nonzero(allowed)):
            y, x = row + dy, column + dx
            inside = (y >= 0) & (y < height) & (x >= 0) & (x < width)
            total = int(scores[y[inside], x[inside]].astype(int).sum())
            key = row // BLOCK, column // BLOCK, heading
            best[key] = max(best.get(key, 0), total)
    return best


def search(scores, allowed, points, headings, keep, max_behind=1.0):
    """Row, column, heading and score of the best places."""
    complete = _grid.ScanSearch(_grid.MatchGrid(scores, allowed), points, headings, keep, max_behind)
    assert complete.advance(2**62)
    return complete.places()


@pytest.mark.parametrize("seed", range(8))
def test_branch_and_bound_finds_what_trying_everything_finds(seed):
    rng = np.random.default_rng(seed)
    height, width = rng.integers(5, 40, 2)
    scores = rng.integers(0, 256, (height, width)).astype(np.uint8)
    scores[rng.random((height, width)) < 0.7] = 0
    allowed = rng.random((height, width)) < 0.3
    points = rng.uniform(-15.0, 15.0, (int(rng.integers(1, 12)), 2))
    headings = rng.uniform(-np.pi, np.pi, 5)
    expected = by_trying(scores, allowed, points, headings)
    row, column, heading, score = search(scores, allowed, points, headings, 10_000)
    found = dict(zip(zip(row // BLOCK, column // BLOCK, heading), np.rint(score * len(points)).astype(int)))
    assert found == {key: total for key, total in expected.items() if total > 0}
    assert len(found) == len(row) and np.all(np.diff(score) <= 0.0)
    assert allowed[row, column].all()
    few = search(scores, allowed, points, headings, 7)
    np.testing.assert_array_equal(few[3], score[:7])
    near = search(scores, allowed, points, headings, 10_000, 0.1)
    assert 0 < len(near[3]) < len(score)
    np.testing.assert_array_equal(near[3], score[score >= score[0] - 25.5])


def test_many_points_add_up():
    """More than 16 bits hold, at a place that is allowed alone."""
    scores, allowed = np.full((30, 30), 255, np.uint8), np.zeros((30, 30), bool)
    allowed[12, 17] = True
    row, column, _, score = search(scores, allowed, np.zeros((700, 2)), np.zeros(1), 5)
    assert (row, column, score) == (12, 17, 255.0)


@pytest.mark.parametrize("slice_size", [1, 500])
def test_a_search_in_slices_finds_what_one_at_once_finds(slice_size):
    rng = np.random.default_rng(3)
    scores, allowed = rng.integers(0, 256, (40, 70)).astype(np.uint8), rng.random((40, 70)) < 0.3
    given = rng.uniform(-20.0, 20.0, (9, 2)), rng.uniform(-np.pi, np.pi, 7), 20
    sliced = _grid.ScanSearch(_grid.MatchGrid(scores, allowed), *given, 1.0)
    slices = 1
    while not sliced.advance(slice_size):
        slices += 1
    assert slices > 10
    for part, expected in zip(sliced.places(), search(scores, allowed, *given)):
        np.testing.assert_array_equal(part, expected)


def test_nothing_is_found_with_no_points_or_nothing_to_keep():
    full = np.full((9, 9), 255, np.uint8), np.ones((9, 9), bool)
    assert [len(part) for part in search(*full, np.zeros((0, 2)), np.zeros(1), 5)] == [0, 0, 0, 0]
    assert [len(part) for part in search(*full, np.zeros((3, 2)), np.zeros(1), 0)] == [0, 0, 0, 0]


@pytest.mark.parametrize(
    "scores, allowed, points, headings, text",
    [
        (np.zeros((4, 5)), np.zeros((5, 4)), np.zeros((1, 2)), np.zeros(1), "scores and allowed must be (H, W)"),
        (np.zeros((4, 5)), np.zeros((4, 5)), np.zeros((2, 3)), np.zeros(1), "points must be (B, 2)"),
        (np.zeros((4, 5)), np.zeros((4, 5)), np.zeros((2, 2)), np.zeros((1, 1)), "headings must be (A,)"),
    ],
)
def test_wrong_shapes_are_refused(scores, allowed, points, headings, text):
    with pytest.raises(ValueError) as err:
        search(scores.astype(np.uint8), allowed.astype(bool), points, headings, 5)
    assert str(err.value) == text


def room(resolution_m, map_from_grid=(0.0, 0.0, 0.0)):
    """6 m x 4 m, and a pillar that makes each place in it unlike all others."""
    height, width = int(round(4.0 / resolution_m)), int(round(6.0 / resolution_m))
    occupancy = np.zeros((height, width), np.int8)
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
    occupancy[int(0.7 * height) : int(0.85 * height), int(0.2 * width) : int(0.3 * width)] = 100
    return GridMap(occupancy, resolution_m, np.array(map_from_grid))


def walls_seen(grid_map, pose, count=200):
    """Wall points around a pose, in its frame."""
    rows, columns = np.nonzero(grid_map.occupied)
    points = grid_map.centres(rows, columns)
    chosen = np.linspace(0, len(points) - 1, count).astype(int)
    return se2.transform_points(se2.inverse(pose), points[chosen])


@pytest.mark.parametrize("resolution_m", [0.02, 0.05, 0.1, 0.13])
@pytest.mark.parametrize("map_from_grid", [(0.0, 0.0, 0.0), (20.0, -7.0, 2.1)], ids=["straight", "turned"])
def test_the_place_of_a_scan_is_the_best_at_any_resolution_and_origin(resolution_m, map_from_grid):
    grid_map = room(resolution_m, map_from_grid)
    true = se2.compose(np.array(map_from_grid), np.array([4.1, 1.3, 0.7]))
    found = ScanMatcher(grid_map, DistanceField(grid_map)).search(walls_seen(grid_map, true), 50)
    assert np.hypot(*(found.poses[0] - true)[:2]) < 0.15
    assert abs(angles.wrap(found.poses[0, 2] - true[2])) < np.radians(3.0)
    assert found.score[0] > 0.65 and np.all(found.score <= 1.0)


def test_an_area_bounds_the_search():
    grid_map = room(0.05)
    true = np.array([4.1, 1.3, 0.7])
    left = np.zeros(grid_map.occupancy.shape, bool)
    left[:, :60] = True
    found = ScanMatcher(grid_map, DistanceField(grid_map), left).search(walls_seen(grid_map, true), 500)
    assert len(found.poses) and np.all(found.poses[:, 0] < 3.1)


def test_where_nobody_can_be_nothing_can_be_sought():
    grid_map = room(0.1)
    field = DistanceField(grid_map)
    with pytest.raises(ValueError, match="^no free cell lies in the area$"):
        ScanMatcher(grid_map, field, grid_map.occupied)
    full = GridMap(np.full((5, 5), 100, np.int8), 0.1, np.zeros(3))
    with pytest.raises(ValueError, match="^the map has no free cell to be in$"):
        ScanMatcher(full, DistanceField(full))
