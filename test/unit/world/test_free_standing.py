"""Which walls of a map belong to things that stand free and are too thick for glass."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.world import free_standing
from glass_nav.world.grid_map import GridMap

GLASS_M = 0.2
BOX = (slice(20, 32), slice(30, 40))  # 0.6 x 0.5 m


def room(**parts) -> np.ndarray:
    """(100, 120) cells of 5 cm: a room in unknown space, with what is drawn in it."""
    cells = np.full((100, 120), -1, np.int8)
    cells[5:95, 5:115] = 100
    cells[6:94, 6:114] = 0
    for value in parts.values():
        value(cells)
    return cells


def outline(rows, columns, inside=-1):
    def draw(cells):
        cells[rows, columns] = 100
        cells[rows.start + 1 : rows.stop - 1, columns.start + 1 : columns.stop - 1] = inside

    return draw


def opaque(cells: np.ndarray) -> np.ndarray:
    return free_standing.walls(GridMap(cells, 0.05, np.zeros(3)), GLASS_M)


@pytest.mark.parametrize("inside", [-1, 100, 50])
def test_of_a_box_on_the_floor_all_occupied_cells_count(inside):
    cells = room(box=outline(*BOX, inside))
    expected = np.zeros(cells.shape, bool)
    expected[BOX] = cells[BOX] == 100
    np.testing.assert_array_equal(opaque(cells), expected)


def test_a_box_that_stands_askew_counts():
    rows, columns = np.indices((100, 120))
    along, across = (rows - 50) * 0.8 + (columns - 60) * 0.6, (columns - 60) * 0.8 - (rows - 50) * 0.6

    def draw(cells):
        cells[(abs(along) < 8) & (abs(across) < 5)] = 100
        cells[(abs(along) < 7) & (abs(across) < 4)] = -1

    cells = room(box=draw)
    assert np.count_nonzero(opaque(cells)) == np.count_nonzero(cells[10:90, 10:110] == 100) > 0


@pytest.mark.parametrize(
    "draw",
    [
        pytest.param(outline(*BOX, inside=0), id="the mapper saw its inside: a glass case"),
        pytest.param(outline(slice(20, 24), slice(30, 60)), id="no thicker than a double glazing"),
        pytest.param(outline(slice(6, 18), slice(30, 40)), id="it stands at the wall, which may be glass"),
        pytest.param(outline(slice(10, 93), slice(30, 40)), id="a room that the mapper did not enter"),
        pytest.param(lambda cells: None, id="walls and the unknown around them"),
    ],
)
def test_what_may_be_glass_does_not_count(draw):
    assert not opaque(room(drawn=draw)).any()


@pytest.mark.parametrize("side", [slice(0, 12), slice(88, 100)])
def test_what_the_edge_of_the_map_cuts_does_not_count(side):
    cells = np.zeros((100, 120), np.int8)
    outline(side, slice(30, 40))(cells)
    assert not opaque(cells).any()
    assert not opaque(cells.T.copy()).any()


def test_an_empty_map_has_none():
    assert not opaque(np.zeros((10, 10), np.int8)).any()
