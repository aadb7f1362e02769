"""Points inside and outside of polygons."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import polygons

CORNER_ROOM = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]])


@pytest.mark.parametrize("corners", [CORNER_ROOM, CORNER_ROOM[::-1]], ids=["counter-clockwise", "clockwise"])
def test_a_corner_room_holds_what_is_round_its_corner_and_not_what_is_in_it(corners):
    points = np.array([[0.5, 2.5], [3.5, 0.5], [0.5, 0.5], [2.0, 2.0], [-0.1, 0.5], [0.5, 3.1], [4.1, 0.5]])
    assert polygons.inside(corners, points).tolist() == [True, True, True, False, False, False, False]


@pytest.mark.parametrize("seed", range(5))
def test_a_point_is_in_a_triangle_if_it_is_left_of_all_three_sides(seed):
    rng = np.random.default_rng(seed)
    corners, points = rng.uniform(-1.0, 1.0, (3, 2)), rng.uniform(-1.0, 1.0, (500, 2))
    side = np.roll(corners, -1, axis=0) - corners
    off = points[:, None] - corners
    left = side[:, 0] * off[..., 1] - side[:, 1] * off[..., 0] > 0.0
    assert np.array_equal(polygons.inside(corners, points), left.all(axis=1) | (~left).all(axis=1))


def test_a_corner_at_the_height_of_a_point_counts_once():
    diamond = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    assert polygons.inside(diamond, np.array([[0.0, 0.0], [-2.0, 0.0], [2.0, 0.0]])).tolist() == [True, False, False]
