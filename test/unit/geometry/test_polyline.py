from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import polyline
from glass_nav.geometry.polyline import Polyline

CORNER = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]])
CROSSING = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 3.0], [3.0, 3.0], [3.0, -3.0]])


def test_the_way_is_counted_round_the_corner():
    line = Polyline(CORNER)
    assert line.length == 7.0
    np.testing.assert_allclose(line.at(5.0), [4.0, 1.0])
    np.testing.assert_allclose(line.direction(3.9), [1.0, 0.0])
    np.testing.assert_allclose(line.direction(4.0), [0.0, 1.0])


def test_before_the_start_and_beyond_the_end_it_runs_straight_on():
    line = Polyline(CORNER)
    np.testing.assert_allclose(line.at(-1.0), [-1.0, 0.0])
    np.testing.assert_allclose(line.at(8.5), [4.0, 4.5])


@pytest.mark.parametrize("seed", range(5))
def test_the_nearest_point_is_that_of_a_fine_search(seed):
    rng = np.random.default_rng(seed)
    line = Polyline(np.cumsum(rng.normal(0.0, 1.0, (8, 2)), axis=0))
    ways = np.linspace(0.0, line.length, 20001)
    points = np.array([line.at(way) for way in ways])
    for point in rng.normal(0.0, 3.0, (10, 2)):
        found = np.hypot(*(line.at(line.nearest(point)) - point))
        assert found <= np.hypot(*(points - point).T).min() + 1e-9
        assert found == pytest.approx(np.hypot(*(points - point).T).min(), abs=1e-3)


def test_where_a_line_crosses_itself_the_way_so_far_decides():
    line, crossing = Polyline(CROSSING), np.array([3.0, 0.0])
    assert line.nearest(crossing, 2.0, 2.0) == pytest.approx(3.0)
    assert line.nearest(crossing, 13.0, 2.0) == pytest.approx(15.0)
    assert line.nearest(crossing, 4.0, 1.0) == pytest.approx(4.0)  # never back


def test_a_part_has_its_ends_and_the_corners_between_them():
    line = Polyline(CORNER)
    np.testing.assert_allclose(line.part(1.0, 6.0), [[1.0, 0.0], [4.0, 0.0], [4.0, 2.0]])
    np.testing.assert_allclose(line.part(6.0, 1.0), [[4.0, 2.0], [4.0, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(line.part(4.0, 4.0), [[4.0, 0.0], [4.0, 0.0]])


def test_points_that_repeat_the_one_before_are_left_out():
    np.testing.assert_array_equal(polyline.distinct(CORNER[[0, 0, 1, 2, 2]]), CORNER)


def test_a_line_is_as_long_as_its_pieces() -> None:
    assert polyline.length(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 6.0]])) == 7.0
    assert polyline.length(np.zeros((1, 2))) == 0.0


@pytest.mark.parametrize("count, along", [(0, []), (1, [0.0]), (3, [0.0, 5.0, 7.0])])
def test_distances_along_a_line_begin_with_0(count, along):
    points = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 6.0]])[:count]
    np.testing.assert_array_equal(polyline.distances_along(points), along)
