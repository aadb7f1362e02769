from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from glass_nav.geometry import se2
from glass_nav.simulation import building_map, mapped_building, random_building
from glass_nav.simulation.building import distances
from glass_nav.world.grid_map import UNKNOWN, GridMap

CELL_M = 0.1
PLACE = np.array([3.0, -2.0, 0.4])


def map_of(occupancy):
    return GridMap(occupancy.astype(np.int8), CELL_M, PLACE)


def room():
    """6 x 4 m of free cells, unknown beyond without a wall; a closet of 0.4 m behind one."""
    occupancy = np.full((48, 70), UNKNOWN)
    occupancy[4:44, 5:65] = 0
    occupancy[4:44, 60] = 100
    return occupancy


def away_m(building, points):
    """(N,) from the nearest surface of a building, points (N, 2) in the frame of the grid [m]."""
    surfaces = building.surfaces
    return distances(se2.transform_points(PLACE, np.asarray(points)), surfaces.from_m, surfaces.to_m).min(axis=1)


def test_what_bounds_free_space_stands_unknown_or_not_and_where_the_map_is():
    building = mapped_building.build(map_of(room()), "room")
    on_bounds = [[0.5, 2.0], [3.0, 0.4], [3.0, 4.4], [6.0, 2.0]]  # the last one is the wall before the closet
    np.testing.assert_allclose(away_m(building, on_bounds), 0.0, atol=0.75 * CELL_M)
    np.testing.assert_allclose(away_m(building, [[3.25, 2.4], [6.2, 2.0]]), [2.0, 0.2], atol=0.75 * CELL_M)
    there = se2.transform_points(se2.inverse(PLACE), building.start[None, :2])
    assert away_m(building, there) > 1.9  # it stands in the middle of the room


def test_an_unknown_speck_is_nothing_but_one_with_something_in_it_stands():
    occupancy = room()
    occupancy[20:22, 20:22] = UNKNOWN
    occupancy[30, 30] = 100
    building = mapped_building.build(map_of(occupancy), "room")
    assert away_m(building, [[2.1, 2.1]]) > 0.9
    np.testing.assert_allclose(away_m(building, [[3.05, 3.0], [3.1, 3.05]]), 0.0, atol=1e-9)


def test_a_wall_at_an_angle_has_no_steps():
    rows, columns = np.mgrid[:80, :80]
    occupancy = np.where(rows + 0.5 > 10.0 + 0.37 * columns, 0, 100)
    surfaces = mapped_building.build(map_of(occupancy), "slope").surfaces
    steps = np.hypot(*(surfaces.to_m - surfaces.from_m).T)
    assert (steps > 30 * CELL_M).sum() >= 3  # the slope in few pieces, and the straight bounds
    assert len(steps) < 12


def test_the_map_drawn_of_it_is_the_largest_part_of_the_map():
    grid = building_map.draw(random_building.build(1))
    again = building_map.draw(mapped_building.build(grid, "again"))
    parts, _ = ndimage.label(grid.free)
    rows, columns = np.nonzero(parts == np.bincount(parts[parts > 0]).argmax())
    assert again.is_free(grid.centres(rows, columns)).mean() > 0.95
    assert grid.is_free(again.centres(*np.nonzero(again.free))).mean() > 0.999


def test_a_map_without_room_for_a_robot_is_refused():
    occupancy = np.full((20, 20), 100)
    occupancy[8:12, 2:18] = 0
    with pytest.raises(ValueError, match="tight: no free place in the map has 0.3 m of room around it"):
        mapped_building.build(map_of(occupancy), "tight")
