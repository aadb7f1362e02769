"""Where a map knows something: mapped cells, and what is close to a mapped wall."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.sensing.known_area import KnownArea
from glass_nav.world.grid_map import UNKNOWN, GridMap

CELL_M = 0.05
PLACED = np.array([2.0, -1.0, 0.6])  # of the grid in the map


def half_mapped() -> GridMap:
    """5 m by 4 m; the left 3 m are mapped, with a wall at x = 1 m from y = 0 to 2 m; at x = 4 m stands a post."""
    occupancy = np.zeros((80, 100), np.int8)
    occupancy[:, 60:] = UNKNOWN
    occupancy[:40, 20] = 100
    occupancy[40, 80] = 100
    return GridMap(occupancy, CELL_M, PLACED)


@pytest.mark.parametrize(
    "x_m, y_m, known",
    [
        pytest.param(1.5, 3.0, True, id="free"),
        pytest.param(1.02, 1.0, True, id="a wall"),
        pytest.param(3.5, 1.0, False, id="unknown"),
        pytest.param(2.88, 3.0, False, id="beside what is unknown"),
        pytest.param(2.78, 3.0, True, id="four cells away from it"),
        pytest.param(-0.3, 3.0, False, id="outside of the grid"),
        pytest.param(300.0, -200.0, False, id="far outside of the grid"),
        pytest.param(0.1, 3.0, False, id="beside the edge of the grid"),
        pytest.param(4.4, 2.02, True, id="near a wall that stands alone"),
        pytest.param(4.6, 2.02, False, id="half a metre away from it"),
        pytest.param(1.02, 0.03, True, id="a wall at the edge of the grid"),
        pytest.param(1.02, -0.03, True, id="near a wall, outside of the grid"),
    ],
)
def test_a_place_is_known_where_the_mapper_saw_it_or_a_wall_near_it(x_m, y_m, known):
    place = se2.transform_points(PLACED, np.array([x_m, y_m]))
    assert KnownArea(half_mapped()).contains(place) == known


@pytest.mark.parametrize(
    "x_m, y_m, free, beside",
    [
        pytest.param(1.5, 3.0, True, False, id="free"),
        pytest.param(1.02, 1.0, False, False, id="a wall"),
        pytest.param(3.5, 1.0, False, True, id="unknown"),
        pytest.param(2.88, 3.0, True, True, id="beside what is unknown"),
        pytest.param(2.78, 3.0, True, False, id="four cells away from it"),
        pytest.param(-0.3, 3.0, False, True, id="outside of the grid"),
    ],
)
def test_a_robot_may_stand_where_the_mapper_saw_no_wall(x_m, y_m, free, beside):
    area, place = KnownArea(half_mapped()), se2.transform_points(PLACED, np.array([x_m, y_m]))
    assert (area.is_free(place), area.is_beside_unmapped(place)) == (free, beside)


def test_the_ends_of_a_scan_are_judged_from_every_pose():
    area = KnownArea(half_mapped())
    points_m = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 0.0]])
    in_grid = np.array([[2.5, 3.0, 0.0], [2.5, 3.0, np.pi], [3.5, 3.0, 0.0]])
    ends = area.ends(points_m, se2.compose(PLACED, in_grid))
    assert ends.tolist() == [[False, True, True], [True, False, True], [False, True, False]]
    assert area.ends(points_m, np.zeros((0, 3))).shape == (0, 3)


def test_a_map_that_knows_everything_knows_all_but_its_edge():
    area = KnownArea(GridMap(np.zeros((40, 30), np.int8), CELL_M, np.zeros(3)))
    rows, columns = np.indices((40, 30))
    known = area.contains(np.stack([(columns + 0.5) * CELL_M, (rows + 0.5) * CELL_M], axis=-1))
    assert known[3:-3, 3:-3].all()
    assert np.count_nonzero(known) == 34 * 24
