"""Where tags are seen, where they may hang, and where one more helps."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import angles
from glass_nav.localization.bearings import bearing_errors, landmark_planning
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world import landmark_map
from glass_nav.world.grid_map import GridMap
from glass_nav.world.landmark_map import LandmarkMap

SIGMA = bearing_errors.step_sigma(np.radians(1.0))


def room(width=120, height=80, wall_at=None) -> GridMap:
    """A room of 12 x 8 m, walls one cell of 0.1 m thick; a wall across it at a column, to two thirds of its height."""
    occupancy = np.zeros((height, width), np.int8)
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
    if wall_at is not None:
        occupancy[: height * 2 // 3, wall_at] = 100
    return GridMap(occupancy, 0.1, np.array([1.0, 2.0, 0.0]))


def test_points_are_free_apart_and_clear_of_walls():
    points = landmark_planning.points(room(), 0.5)
    assert (points.min(axis=0) > [1.3, 2.3]).all() and (points.max(axis=0) < [12.7, 9.7]).all()
    assert np.unique(np.round(np.diff(np.unique(points[:, 0])), 6)).tolist() == [0.5]
    with pytest.raises(ValueError, match="^the map has no free place 0.25 m away from walls, searched every 0.5 m$"):
        landmark_planning.points(room(4, 4), 0.5)


def test_a_wall_hides_a_tag_and_not_the_one_that_hangs_on_it():
    tags = LandmarkMap(
        ("east", "wall"),
        np.array([[12.85, 3.0], [6.95, 3.0]]),
        np.radians([180.0, 180.0]),
        np.full(2, np.pi),
        np.full(2, 15.0),
    )
    points = np.array([[3.0, 3.0], [10.0, 3.0], [3.0, 9.5]])
    seen = landmark_planning.visible(RayCaster(room(wall_at=60)), tags, points)
    assert seen.tolist() == [[False, True], [True, False], [False, True]]
    assert landmark_planning.visible(RayCaster(room()), tags, points)[0].tolist() == [True, True]
    assert not landmark_planning.visible(RayCaster(room()), landmark_map.NONE, points).any()


def test_candidates_hang_on_walls_and_look_into_the_room():
    places = landmark_planning.candidates(room(), 1.0)
    assert len(places) % 3 == 0
    ahead = places.positions_m + 0.5 * np.stack([np.cos(places.facing_rad), np.sin(places.facing_rad)], axis=-1)
    assert room().is_free(ahead).mean() > 0.95  # in the corners, a tilted one looks along the wall
    south = places.positions_m[:, 1] < 2.2
    middle = (places.positions_m[:, 0] > 3.0) & (places.positions_m[:, 0] < 11.0)
    straight = places.facing_rad[south & middle][::3]
    np.testing.assert_allclose(angles.wrap(straight - np.pi / 2.0), 0.0, atol=1e-9)


def test_in_a_turned_map_candidates_look_into_the_room_too():
    turned = GridMap(room().occupancy, 0.1, np.array([0.0, 0.0, 2.0]))
    places = landmark_planning.candidates(turned, 1.0)
    ahead = places.positions_m + 0.5 * np.stack([np.cos(places.facing_rad), np.sin(places.facing_rad)], axis=-1)
    assert turned.is_free(ahead).mean() > 0.95


def test_the_suggested_place_is_the_best_of_all_tried_one_by_one():
    """Second implementation: expected_sigma() of the whole map with each candidate added."""
    grid = room(wall_at=60)
    walls, points = RayCaster(grid), landmark_planning.points(grid, 1.0)
    tags = LandmarkMap(
        ("a", "b"), np.array([[1.15, 3.0], [1.15, 8.5]]), np.zeros(2), np.full(2, np.pi), np.full(2, 15.0)
    )
    places = landmark_planning.candidates(grid, 2.0)

    def cost(landmarks):
        seen = landmark_planning.visible(walls, landmarks, points)
        sigma = bearing_errors.expected_sigma(landmarks, points, seen, SIGMA)
        return float((np.minimum(sigma, 1.0) + np.maximum(3 - seen.sum(axis=1), 0)).mean())

    def with_one(number):
        return tags.joined(
            LandmarkMap(
                ("c",),
                places.positions_m[[number]],
                places.facing_rad[[number]],
                places.view_rad[[number]],
                places.range_m[[number]],
            )
        )

    costs = [cost(with_one(number)) for number in range(len(places))]
    before = landmark_planning.visible(walls, tags, points)
    (best,) = landmark_planning.suggest(walls, tags, before, points, places, SIGMA, 1)
    number = int(np.argmin(costs))
    assert cost(with_one(number)) < cost(tags)
    np.testing.assert_allclose(best.position_m, places.positions_m[number])
    assert best.facing_rad == places.facing_rad[number]
    after = with_one(number)
    seen = landmark_planning.visible(walls, after, points)
    np.testing.assert_array_equal(best.seen, seen.sum(axis=1))
    np.testing.assert_allclose(best.sigma_m, bearing_errors.expected_sigma(after, points, seen, SIGMA))


def test_from_nothing_three_tags_make_positions_and_more_make_them_better():
    grid = room()
    walls, points = RayCaster(grid), landmark_planning.points(grid, 1.0)
    none = np.zeros((len(points), 0), bool)
    found = landmark_planning.suggest(
        walls, landmark_map.NONE, none, points, landmark_planning.candidates(grid, 1.0), SIGMA, 6
    )
    assert len(found) == 6
    known = [np.isfinite(each.sigma_m).mean() for each in found]
    assert known[:2] == [0.0, 0.0] and known[2] > 0.3 and known[5] >= known[2]


def test_where_no_tag_can_hang_none_is_suggested():
    free = GridMap(np.zeros((40, 40), np.int8), 0.1, np.zeros(3))
    points = landmark_planning.points(free, 1.0)
    places = landmark_planning.candidates(free, 1.0)
    assert len(places) == 0
    none = np.zeros((len(points), 0), bool)
    assert landmark_planning.suggest(RayCaster(free), landmark_map.NONE, none, points, places, SIGMA, 3) == []
