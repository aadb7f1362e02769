"""How thick walls are drawn: walls of known thickness, alone and beside each other."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.sensing import wall_thickness as walls
from glass_nav.sensing.raycast import changed_box
from glass_nav.sensing.wall_thickness import wall_thickness
from glass_nav.world.grid_map import GridMap

CELL_M = 0.05


def thickness_of(occupied, resolution_m=CELL_M):
    occupied = np.asarray(occupied, bool)
    grid_map = GridMap(np.where(occupied, 100, 0).astype(np.int8), resolution_m, np.zeros(3))
    thickness_m = wall_thickness(grid_map)
    assert thickness_m.shape == (occupied.size,)
    assert thickness_m.dtype == np.float32
    return thickness_m.reshape(occupied.shape)


def wall(cells, across=60, along=60):
    occupied = np.zeros((along, across), bool)
    occupied[:, 20 : 20 + cells] = True
    return occupied


@pytest.mark.parametrize("cells", [1, 3, 5, 7, 9, 15])
def test_every_cell_of_a_wall_knows_how_thick_the_wall_is(cells):
    thickness_m = thickness_of(wall(cells))
    np.testing.assert_allclose(thickness_m[10:-10, 20 : 20 + cells], cells * CELL_M, rtol=1e-5)


@pytest.mark.parametrize("cells", [2, 4, 6])
def test_an_even_wall_has_no_middle_cell_and_is_a_cell_off_at_most(cells):
    thickness_m = thickness_of(wall(cells))[10:-10, 20 : 20 + cells]
    assert np.all(np.abs(thickness_m - cells * CELL_M) <= CELL_M + 1e-6)


def test_a_wall_across_is_as_thick_as_one_along():
    np.testing.assert_allclose(thickness_of(wall(5).T), thickness_of(wall(5)).T)


def test_what_is_free_has_no_thickness():
    occupied = wall(5)
    assert np.all(thickness_of(occupied)[~occupied] == 0.0)


def test_a_map_without_walls_has_no_thickness():
    np.testing.assert_array_equal(thickness_of(np.zeros((4, 6))), np.zeros((4, 6)))


def test_a_thin_wall_beside_a_thick_one_stays_thin():
    occupied = wall(9)
    occupied[:, 30] = True  # one free column between them
    thickness_m = thickness_of(occupied)
    np.testing.assert_allclose(thickness_m[10:-10, 30], CELL_M, rtol=1e-5)
    np.testing.assert_allclose(thickness_m[10:-10, 20:29], 9 * CELL_M, rtol=1e-5)


def test_where_the_map_is_solid_the_thickness_is_one_cell():
    thickness_m = thickness_of(wall(35))  # 1.75 m, thicker than any wall
    np.testing.assert_allclose(thickness_m[25:-25, 28:47], CELL_M, rtol=1e-5)


def test_outside_the_map_is_free():
    occupied = np.zeros((20, 20), bool)
    occupied[:, :3] = True  # a wall along the border
    np.testing.assert_allclose(thickness_of(occupied)[5:-5, :3], 3 * CELL_M, rtol=1e-5)


def test_coarse_cells_are_walls_of_one_cell():
    occupied = np.zeros((9, 9), bool)
    occupied[:, 4] = True
    thickness_m = thickness_of(occupied, resolution_m=0.5)
    np.testing.assert_allclose(thickness_m[:, 4], 0.5, rtol=1e-5)
    assert np.all(thickness_m[:, :4] == 0.0)


@pytest.mark.parametrize("seed", range(20))
def test_a_redrawn_box_is_as_if_all_was_worked_out(seed):
    rng = np.random.default_rng(seed)
    before = np.where(rng.random((90, 110)) < 0.02, 100, 0).astype(np.int8)
    for _ in range(12):
        row, column = rng.integers(0, 90), rng.integers(0, 110)
        before[row : row + rng.integers(1, 40), column : column + rng.integers(1, 40)] = 100
    after = before.copy()
    row, column = rng.integers(0, 90), rng.integers(0, 110)
    after[row : row + rng.integers(1, 12), column : column + rng.integers(1, 12)] = rng.choice([0, 100])
    maps = [GridMap(cells, CELL_M, np.zeros(3)) for cells in (before, after)]
    thickness_m = wall_thickness(maps[0])
    walls.redraw(thickness_m, maps[1], *changed_box(*maps))
    np.testing.assert_array_equal(thickness_m, wall_thickness(maps[1]))


@pytest.mark.parametrize("rows", [1, 7, 59])
@pytest.mark.parametrize("share", [0.3, 0.95])
def test_made_in_strips_it_is_the_same(monkeypatch, rows, share):
    occupied = np.random.default_rng(rows).random((60, 50)) < share
    whole = thickness_of(occupied)
    monkeypatch.setattr(walls, "_STRIP_ROWS", rows)
    np.testing.assert_array_equal(thickness_of(occupied), whole)
