"""The grid around a robot in halls that are too wide for the window of its map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_buildings import scan_at, walled

from glass_nav.driving.edge_tracking.local_map import LocalMap, LocalMapParams
from glass_nav.driving.edge_tracking.map_around import MapAround
from glass_nav.simulation.building import Building

P = LocalMapParams(window_m=10.0, narrow_window_m=5.0)


def hall(width_m: float, height_m: float) -> Building:
    """Its corner at the origin."""
    return walled(np.array([[0.0, 0.0], [width_m, 0.0], [width_m, height_m], [0.0, height_m]]))


def looked_around(around: MapAround, building: Building, at: "tuple[float, float]", p: LocalMapParams = P) -> MapAround:
    """After a turn on the spot; a new map if none is given."""
    for number in range(4):
        pose = np.array([*at, 1.6 * number])
        around.add(scan_at(building, tuple(pose), np.random.default_rng(number)), pose)
    return around


@pytest.mark.parametrize(
    "width_m, at, cell_m",
    [
        pytest.param(4.0, (2.0, 2.0), 0.05, id="a room"),
        pytest.param(12.0, (6.0, 6.0), 0.1, id="the middle of a hall"),
        pytest.param(12.0, (6.0, 0.6), 0.2, id="beside its wall: its middle counts"),
        pytest.param(20.0, (10.0, 10.0), 0.2, id="a larger one"),
        pytest.param(60.0, (30.0, 30.0), 0.2, id="no lidar reaches its walls"),
    ],
)
def test_a_wide_hall_is_seen_with_coarse_cells_and_all_of_its_walls(
    width_m: float, at: "tuple[float, float]", cell_m: float
) -> None:
    building = hall(width_m, width_m)
    around = MapAround(P)
    for _ in range(3):  # it grows step by step
        grid = looked_around(around, building, at).grid_around(np.array(at))
    assert grid.resolution_m == pytest.approx(cell_m) and around.coarse_m == pytest.approx(cell_m - 0.05)
    if width_m > 50.0:
        return
    walls = grid.centres(*np.nonzero(grid.occupied))
    off = np.abs(np.abs(walls - 0.5 * width_m).max(axis=1) - 0.5 * width_m)
    assert off.max() < 1.5 * cell_m and len(walls) > 2.0 * width_m / cell_m
    sides = [(walls[:, axis] < 0.5 * width_m).any() and (walls[:, axis] > 0.5 * width_m).any() for axis in (0, 1)]
    assert all(sides)
    around.clear()
    assert around.coarse_m == 0.0 and not around.walls().occupied.any()


def test_back_in_a_narrow_place_the_map_is_fine_again() -> None:
    around = looked_around(MapAround(P), hall(12.0, 12.0), (6.0, 6.0))
    assert around.grid_around(np.array([6.0, 6.0])).resolution_m == pytest.approx(0.1)
    assert around.walls().resolution_m == pytest.approx(0.1)  # the fine map reaches none
    looked_around(around, hall(12.0, 2.0), (11.0, 1.0))
    assert around.grid_around(np.array([11.0, 1.0])).resolution_m == pytest.approx(0.05)
    assert around.walls().resolution_m == pytest.approx(0.05)


@pytest.mark.parametrize("shift_m", [0.0, 0.05, -7.35])
def test_a_coarser_map_knows_what_the_fine_one_knew(shift_m: float) -> None:
    pose = np.array([2.0 + shift_m, 2.0, 0.3])
    fine = LocalMap(replace(P, extend_glass_m=0.0))
    building = walled(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]) + [shift_m, 0.0])
    for number in range(4):
        fine.add(scan_at(building, tuple(pose), np.random.default_rng(number)), pose)
    coarse = fine.coarser(2)
    grid, before = coarse.grid(), fine.grid()
    rows, columns = np.nonzero(fine.occupied())
    assert grid.occupied[grid.cells(before.centres(rows, columns))].all()
    free = grid.centres(*np.nonzero(grid.free))
    assert before.free[before.cells(free)].all() and len(free) > 800
    empty = LocalMap(P).coarser(2)
    assert not empty.occupied().any() and empty.shows_room(np.zeros(2))
