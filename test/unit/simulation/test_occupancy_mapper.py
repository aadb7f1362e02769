"""A mapper counts hits and passes: walls stay, panes mostly vanish. Counts worked by hand; a room with a pane."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.simulation import building_map, lidar, occupancy_mapper
from glass_nav.simulation.building import Building, Door, Pane, Person, Thing, Wall, box
from glass_nav.simulation.occupancy_mapper import OccupancyMapper
from glass_nav.world.grid_map import GridMap

ROOM = Wall(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 6.0], [0.0, 6.0], [0.0, 0.0]]), 0.2)
PATH = np.array([[1.0, 1.5], [7.0, 1.5]])
FREE, WALL, UNKNOWN = 0, 100, -1


def row_after(*ranges_m):
    """The map of one row of 6 cells of 1 m after beams along it from its first cell."""
    mapper = OccupancyMapper(GridMap(np.zeros((1, 6), np.int8), 1.0, np.zeros(3)))
    for range_m in ranges_m:
        mapper.add(np.array([0.5, 0.5, 0.0]), np.zeros(1), np.array([range_m]))
    return mapper.grid_map().occupancy[0].tolist()


@pytest.mark.parametrize(
    "ranges_m, cells",
    [
        pytest.param([3.0], [FREE, FREE, FREE, WALL, UNKNOWN, UNKNOWN], id="passes, then ends"),
        pytest.param([3.0, 4.0, 4.0, 4.0], [FREE, FREE, FREE, WALL, WALL, UNKNOWN], id="a quarter ended"),
        pytest.param([3.0, 4.0, 4.0, 4.0, 4.0], [FREE, FREE, FREE, FREE, WALL, UNKNOWN], id="a fifth ended"),
        pytest.param([9.0], [FREE] * 6, id="ends outside the map"),
        pytest.param([np.inf], [UNKNOWN] * 6, id="no return"),
    ],
)
def test_a_cell_is_occupied_where_a_quarter_of_its_beams_end(ranges_m, cells):
    assert row_after(*ranges_m) == cells


def mapped(building, preset="sensitive"):
    rng = np.random.default_rng(3)
    return occupancy_mapper.draw(building, lidar.preset(preset), PATH, 0.05, rng)


def test_walls_stay_and_of_a_pane_specks_remain():
    pane = Pane(np.array([[0.5, 3.0], [7.5, 3.0]]))
    building = Building((ROOM,), (pane,), start=np.array([1.0, 1.5, 0.0]), seen_m=np.array([[4.0, 5.0]]))
    true, drawn = building_map.draw(building), mapped(building)
    assert drawn.place == true.place

    def kept(y_m):
        """Share of the line along x at y that is drawn, in its row or one beside."""
        x_m = np.arange(1.0, 7.0, 0.05)
        rows, columns = drawn.cells(np.column_stack([x_m, np.full(len(x_m), y_m)]))
        return (
            drawn.occupied[rows - 1, columns] | drawn.occupied[rows, columns] | drawn.occupied[rows + 1, columns]
        ).mean()

    assert kept(0.1) > 0.95  # the wall
    assert 0.02 < kept(3.0) < 0.6
    assert drawn.free[drawn.cells(np.array([4.0, 5.0]))]  # behind the pane


def test_the_mapping_drive_was_before_anything_changed():
    building = Building(
        (ROOM,),
        doors=(Door(np.array([[3.0, 3.0], [4.0, 3.0]]), mapped="closed", now="open"),),
        things=(Thing(box(1.5, 4.0, 0.6, 0.6), present=False), Thing(box(6.0, 4.0, 0.6, 0.6), mapped=False)),
        people=(Person(np.array([[5.0, 2.5], [5.1, 2.5]])),),
        start=np.array([1.0, 1.5, 0.0]),
    )
    drawn = mapped(building)

    def occupied_near(x_m, y_m):
        row, column = drawn.cells(np.array([x_m, y_m]))
        return drawn.occupied[row - 3 : row + 4, column - 3 : column + 4].any()

    assert occupied_near(3.5, 3.0) and occupied_near(1.5, 3.7)
    assert not occupied_near(6.0, 3.7) and not occupied_near(5.0, 2.5)
