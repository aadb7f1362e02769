"""Cells and metres, in grids that lie straight and in grids that are turned in the map."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.world.grid_map import GridMap

ORIGINS = [
    pytest.param((0.0, 0.0, 0.0), id="at the origin"),
    pytest.param((-3.2, 7.5, 0.0), id="moved"),
    pytest.param((4.0, -1.0, 2.1), id="moved and turned"),
]


def grid(occupancy, origin=(0.0, 0.0, 0.0), resolution_m=0.1):
    return GridMap(np.array(occupancy, np.int8), resolution_m, np.array(origin))


def test_a_cell_is_where_rows_times_resolution_put_it():
    # Worked by hand: row 2, column 1 of 0.5 m cells has its centre at (0.75, 1.25) of the grid; the grid is
    # turned by 90 degrees and then moved by (10, 20).
    turned = grid(np.zeros((4, 3)), (10.0, 20.0, np.pi / 2), 0.5)
    np.testing.assert_allclose(turned.centres(np.array(2), np.array(1)), [10.0 - 1.25, 20.0 + 0.75])


def test_a_digest_tells_maps_apart_and_is_the_same_for_the_same_one():
    cells = np.zeros((3, 4))
    other = cells.copy()
    other[1, 2] = 100
    maps = [
        grid(cells),
        grid(other),
        grid(cells.T),
        grid(cells, (1.0, 0.0, 0.0)),
        grid(cells, (0.0, 0.0, 0.1)),
        grid(cells, resolution_m=0.05),
    ]
    assert len({each.digest for each in maps}) == len(maps)
    assert grid(cells, (-0.0, 0.0, 1e-9), float(np.float32(0.1))).digest == grid(cells).digest  # by a message


@pytest.mark.parametrize("origin", ORIGINS)
def test_the_centre_of_a_cell_lies_in_that_cell(origin):
    rows, columns = np.indices((7, 5))
    there = grid(np.zeros((7, 5)), origin)
    found_rows, found_columns = there.cells(there.centres(rows, columns))
    np.testing.assert_array_equal(found_rows, rows)
    np.testing.assert_array_equal(found_columns, columns)


@pytest.mark.parametrize("origin", ORIGINS)
@pytest.mark.parametrize("seed", range(5))
def test_every_point_is_within_half_a_diagonal_of_the_centre_of_its_cell(origin, seed):
    points = np.random.default_rng(seed).uniform(-5.0, 5.0, (200, 2))
    there = grid(np.zeros((7, 5)), origin)
    off = there.centres(*there.cells(points)) - points  # also for cells that do not exist
    assert np.all(np.hypot(off[:, 0], off[:, 1]) <= 0.05 * np.sqrt(2.0) + 1e-9)


def test_points_before_the_first_cell_have_negative_rows_and_columns():
    rows, columns = grid(np.zeros((2, 2))).cells(np.array([[-0.01, 0.05], [0.05, -0.01], [-0.25, -0.15]]))
    np.testing.assert_array_equal(rows, [0, -1, -2])
    np.testing.assert_array_equal(columns, [-1, 0, -3])


def test_a_cell_exists_only_inside_the_grid():
    there = grid(np.zeros((2, 3)))
    rows, columns = np.array([0, 1, 2, -1, 0, 0]), np.array([0, 2, 0, 0, 3, -1])
    np.testing.assert_array_equal(there.contains(rows, columns), [True, True, False, False, False, False])


def test_between_free_and_occupied_a_cell_is_neither():
    there = grid([[0, 25, 26, 64, 65, 100, -1]])
    np.testing.assert_array_equal(there.free, [[True, True, False, False, False, False, False]])
    np.testing.assert_array_equal(there.occupied, [[False, False, False, False, True, True, False]])


@pytest.mark.parametrize("origin", ORIGINS)
def test_a_robot_may_stand_in_free_cells_only(origin):
    there = grid([[0, 100, -1], [50, 0, 0]], origin)
    points = there.centres(*np.indices((2, 3)))
    np.testing.assert_array_equal(there.is_free(points), [[True, False, False], [False, True, True]])


def test_outside_the_map_nothing_is_free():
    there = grid(np.zeros((2, 2)))
    assert not there.is_free(np.array([[-0.05, 0.05], [0.05, -0.05], [0.25, 0.05], [0.05, 0.25]])).any()


@pytest.mark.parametrize(
    "occupancy, resolution_m, origin, text",
    [
        (
            np.zeros((3,), np.int8),
            0.1,
            np.zeros(3),
            "a map needs occupancy (H, W) with at least one cell, got shape (3,)",
        ),
        (
            np.zeros((0, 4), np.int8),
            0.1,
            np.zeros(3),
            "a map needs occupancy (H, W) with at least one cell, got shape (0, 4)",
        ),
        (np.zeros((2, 2)), 0.1, np.zeros(3), "a map needs occupancy of int8, got float64"),
        (np.zeros((2, 2), np.int8), 0.0, np.zeros(3), "a map needs resolution > 0 m, got 0.0"),
        (np.zeros((2, 2), np.int8), np.nan, np.zeros(3), "a map needs resolution > 0 m, got nan"),
        (np.zeros((2, 2), np.int8), np.inf, np.zeros(3), "a map needs resolution > 0 m, got inf"),
        (np.zeros((2, 2), np.int8), 0.1, np.zeros(2), "a map needs an origin of x, y, yaw, all finite, got [0. 0.]"),
        (
            np.zeros((2, 2), np.int8),
            0.1,
            np.array([0.0, np.inf, 0.0]),
            "a map needs an origin of x, y, yaw, all finite, got [ 0. inf  0.]",
        ),
    ],
)
def test_what_is_no_map_is_refused_in_one_line(occupancy, resolution_m, origin, text):
    with pytest.raises(ValueError) as err:
        GridMap(occupancy, resolution_m, origin)
    assert str(err.value) == text


def test_a_fingerprint_is_of_cells_and_place_and_outlives_a_message():
    cells = [[0, 100, -1], [0, 0, 0]]
    here = grid(cells, (1.5, -2.0, 0.1), 0.05)
    assert here.fingerprint == grid(cells, (1.5, -2.0, 0.1 + 1e-9), float(np.float32(0.05))).fingerprint
    others = [
        grid([[0, 100, -1], [0, 0, 1]], (1.5, -2.0, 0.1), 0.05),
        grid(cells, (1.5, -2.0, 0.2), 0.05),
        grid(cells, (1.6, -2.0, 0.1), 0.05),
        grid(cells, (1.5, -2.0, 0.1), 0.1),
        grid(np.reshape(cells, (3, 2)), (1.5, -2.0, 0.1), 0.05),
    ]
    assert len({each.fingerprint for each in [here, *others]}) == 6
    assert grid(cells, (-0.0, 0.0, 0.0)).fingerprint == grid(cells, (0.0, 0.0, 0.0)).fingerprint


def test_cells_are_counted_by_what_they_are():
    there = grid([[0, 25, 26], [64, 65, 100], [-1, -1, 0]])
    assert (there.free_count, there.occupied_count) == (3, 2)
