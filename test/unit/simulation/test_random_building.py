from __future__ import annotations

import numpy as np
import pytest

from glass_nav.simulation import building_map, random_building
from glass_nav.simulation.building import OPAQUE, PANE
from glass_nav.simulation.random_building import FloorParams
from glass_nav.topology.atlas import voronoi_graph


def test_a_seed_gives_the_same_floor_again_and_another_seed_another():
    first, again, other = (random_building.build(seed).surfaces for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.from_m, again.from_m)
    assert first.from_m.shape != other.from_m.shape or not np.allclose(first.from_m, other.from_m)


@pytest.mark.parametrize("seed", range(6))
def test_corridors_and_rooms_of_a_floor_hang_together_and_nothing_of_it_is_open_to_the_outside(seed):
    building = random_building.build(seed)
    grid = building_map.draw(building)
    assert not grid.free[[0, -1]].any() and not grid.free[:, [0, -1]].any()
    graph = voronoi_graph.build(grid)
    row, column = grid.cells(building.start[:2])
    assert grid.free[row, column]
    assert len(graph.r_m) >= 10, "hardly a floor"
    assert (graph.degree >= 3).sum() > (graph.degree == 1).sum() / 3.0


def test_glass_is_as_frequent_as_asked_for():
    none, all_of_it = (random_building.build(1, FloorParams(glass=share)) for share in (0.0, 1.0))
    assert not none.panes and len(all_of_it.panes) > 10
    assert set(np.unique(all_of_it.surfaces.kind)) == {OPAQUE, PANE}
    filmed = building_map.draw(all_of_it.opaque())
    np.testing.assert_array_equal(building_map.draw(all_of_it).occupancy, filmed.occupancy)


def test_a_floor_of_other_blocks_has_another_size():
    small, large = (
        np.ptp(random_building.build(2, FloorParams(blocks=blocks)).surfaces.from_m, axis=0).max()
        for blocks in ((2, 2), (5, 4))
    )
    assert large > 1.4 * small


@pytest.mark.parametrize(
    "values, text",
    [
        ({"blocks": (1, 3)}, "a random floor needs at least 2 x 2 blocks, got 1 x 3"),
        ({"glass": 1.5}, "the share of glass must be 0 to 1, got 1.5"),
    ],
)
def test_what_makes_no_floor_is_refused(values, text):
    with pytest.raises(ValueError, match=text):
        FloorParams(**values)
