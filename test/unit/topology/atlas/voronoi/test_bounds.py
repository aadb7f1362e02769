"""Cells of 1 m in these tests; a point is the middle of its cell."""

from __future__ import annotations

from typing import Set, Tuple

import numpy as np

from glass_nav.topology.atlas.voronoi import bounds
from glass_nav.world.grid_map import UNKNOWN, GridMap

CLEARANCE, SMALLEST = 2.0, 3.0


def found(occupancy: np.ndarray) -> bounds.Bounds:
    return bounds.of(GridMap(occupancy, 1.0, np.zeros(3)), CLEARANCE, SMALLEST)


def room() -> np.ndarray:
    """21 x 21 cells, walls around."""
    occupancy = np.zeros((21, 21), np.int8)
    occupancy[[0, -1]], occupancy[:, [0, -1]] = 100, 100
    return occupancy


def as_set(points: np.ndarray) -> Set[Tuple[float, float]]:
    return set(map(tuple, points.tolist()))


def test_walls_bound_a_room_and_are_beyond_doubt() -> None:
    cells = found(room())
    assert len(cells.points) == 4 * 20 and (cells.doubt == 0.0).all() and not len(cells.posts)
    assert (0.5, 0.5) in as_set(cells.points)


def test_the_frontier_of_what_is_known_is_as_doubtful_as_the_next_wall_is_far() -> None:
    occupancy = room()
    occupancy[1:-1, 15:] = UNKNOWN
    occupancy[:, -1] = UNKNOWN
    cells = found(occupancy)
    frontier = cells.points[:, 0] == 15.5
    assert cells.doubt[frontier].max() == 10.0  # in the middle of 21 rows


def test_a_thing_that_the_robot_can_pass_is_a_post() -> None:
    occupancy = room()
    occupancy[10, 10] = 100
    cells = found(occupancy)
    assert as_set(cells.posts) == {(10.5, 10.5)} and cells.open[11, 11]
    assert (10.5, 10.5) not in as_set(cells.points)


def test_things_that_the_robot_cannot_pass_between_are_one() -> None:
    occupancy = room()
    occupancy[10, [8, 11, 14]] = 100  # 7 cells together, which is not small
    cells = found(occupancy)
    assert not len(cells.posts) and (11.5, 10.5) in as_set(cells.points)


def test_a_thing_beside_a_wall_belongs_to_it() -> None:
    occupancy = room()
    occupancy[10, 3] = 100
    assert not len(found(occupancy).posts)


def test_an_unknown_speck_bounds_nothing() -> None:
    occupancy = room()
    occupancy[10, 10] = UNKNOWN
    cells = found(occupancy)
    assert cells.open[11, 11] and not len(cells.posts) and len(cells.points) == 4 * 20
