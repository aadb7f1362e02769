"""Segments of walls: rooms whose walls are known, seen from inside."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.geometry.segments import NO_SEGMENT
from glass_nav.world import wall_segments
from glass_nav.world.grid_map import UNKNOWN, GridMap

CELL_M = 0.05


def grid(occupancy, map_from_grid=(0.0, 0.0, 0.0)):
    return GridMap(occupancy.astype(np.int8), CELL_M, np.array(map_from_grid, float))


def room(columns=80, rows=60):
    """4 x 3 m inside one layer of wall cells, unknown beyond."""
    occupancy = np.full((rows + 4, columns + 4), UNKNOWN)
    occupancy[1:-1, 1:-1] = 100
    occupancy[2:-2, 2:-2] = 0
    return occupancy


def test_a_room_has_four_walls_through_the_middle_of_their_cells_with_free_space_to_the_left():
    found = wall_segments.extract(grid(room()))
    low, right, top = 0.075, 4.125, 3.125  # middles of the wall's cells; the free ones reach from 0.1 to 4.1, 3.1
    expected = [[low, low, right, low], [right, low, right, top], [right, top, low, top], [low, top, low, low]]
    assert len(found.segments_m) == 4
    for wall in expected:
        away = np.abs(found.segments_m - wall).max(axis=1)
        assert away.min() < 0.06, f"{wall}: {found.segments_m}"
    assert (found.face_segment != NO_SEGMENT).all()
    assert len(found.faces_m) == 2 * (80 + 60)


def test_segments_are_where_the_map_is():
    pose = np.array([10.0, -3.0, 0.4])
    here = wall_segments.extract(grid(room())).segments_m
    there = wall_segments.extract(grid(room(), pose)).segments_m
    np.testing.assert_allclose(there.reshape(-1, 2), se2.transform_points(pose, here.reshape(-1, 2)), atol=1e-9)


def test_a_pane_of_one_cell_is_seen_from_both_sides():
    occupancy = room()
    occupancy[30, 2:-2] = 100
    found = wall_segments.extract(grid(occupancy)).segments_m
    at_pane = found[np.abs(found[:, [1, 3]] - 30.5 * CELL_M).max(axis=1) < 0.02]
    assert len(at_pane) == 2
    assert sorted(np.sign(at_pane[:, 2] - at_pane[:, 0])) == [-1.0, 1.0]


def test_a_dotted_wall_behind_unknown_cells_is_a_wall():
    """Every fourth cell of the lower wall is known, and so is none of those before it."""
    occupancy = room()
    occupancy[1, 2:-2] = UNKNOWN
    occupancy[1, 2:-2:4] = 100
    occupancy[2, 2:-2] = UNKNOWN
    found = wall_segments.extract(grid(occupancy)).segments_m
    lower = found[found[:, [1, 3]].max(axis=1) < 0.2]
    assert len(lower) == 1 and lower[0, 2] - lower[0, 0] == pytest.approx(4.0, abs=0.1)
    assert (lower[0, [1, 3]] <= 0.126).all()


@pytest.mark.parametrize("gap_cells, pieces", [(3, 1), (20, 2)])
def test_a_wall_goes_on_behind_a_small_gap_of_unknown_cells_only(gap_cells, pieces):
    occupancy = room()
    occupancy[-2, 40 : 40 + gap_cells] = UNKNOWN
    found = wall_segments.extract(grid(occupancy)).segments_m
    assert (np.abs(found[:, [1, 3]] - 3.125).max(axis=1) < 0.02).sum() == pieces


def test_unknown_space_has_no_walls_and_neither_has_an_empty_map():
    occupancy = np.full((20, 20), UNKNOWN)
    assert wall_segments.extract(grid(occupancy)).segments_m.shape == (0, 4)
    occupancy[5:15, 5:15] = 0
    found = wall_segments.extract(grid(occupancy))
    assert found.segments_m.shape == (0, 4) and found.faces_m.shape == (0, 2)


def test_where_walls_touch_at_a_corner_no_segment_goes_through():
    occupancy = np.full((40, 40), 100)
    occupancy[5:20, 5:20] = 0
    occupancy[20:35, 20:35] = 0  # touches the other at its corner
    found = wall_segments.extract(grid(occupancy)).segments_m
    assert len(found) == 8
    assert (np.hypot(found[:, 2] - found[:, 0], found[:, 3] - found[:, 1]) < 16.5 * CELL_M).all()


def test_a_slanted_wall_is_one_segment():
    rows, columns = np.mgrid[:100, :100]
    occupancy = np.where(rows < 0.37 * columns + 10, 100, 0)
    found = wall_segments.extract(grid(occupancy)).segments_m
    lengths = np.hypot(found[:, 2] - found[:, 0], found[:, 3] - found[:, 1])
    assert len(found) == 1 and lengths[0] == pytest.approx(5.0 * np.hypot(1.0, 0.37), abs=0.15)
    slope = (found[0, 3] - found[0, 1]) / (found[0, 2] - found[0, 0])
    assert slope == pytest.approx(0.37, abs=0.01)


def test_outlines_run_around_a_piece_and_its_hole_with_the_piece_to_the_left():
    cells = np.zeros((6, 7), bool)
    cells[1:5, 1:6] = True
    cells[2:4, 2:4] = False
    around = sorted(wall_segments.outlines(cells), key=len)
    assert [len(line) for line in around] == [8, 18]

    def area(line):
        x, y = line.T
        return 0.5 * (np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))

    assert [area(line) for line in around] == [-4.0, 20.0]  # counter-clockwise around the piece, clockwise the hole
