"""Bridges of glass from seeds."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.simulation import building_map, lidar, random_bridge
from glass_nav.simulation.lidar import LidarModel


def test_a_seed_gives_the_same_bridge_again_and_another_seed_another():
    first, again, other = (random_bridge.build(seed).surfaces.from_m for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert first.shape != other.shape


@pytest.mark.parametrize("seed", range(3))
def test_the_path_is_free_and_the_surroundings_are_on_no_map(seed):
    building = random_bridge.build(seed)
    grid_map = building_map.draw(building)
    path_m = building.paths["across"]
    along = np.concatenate([np.linspace(a, b, 40) for a, b in zip(path_m[:-1], path_m[1:])])
    assert grid_map.is_free(along).all()
    assert not grid_map.free[[0, -1]].any() and not grid_map.free[:, [0, -1]].any()
    assert any(not thing.mapped for thing in building.things)


def test_on_the_bridge_many_beams_pass_panes_and_end_where_the_map_knows_nothing():
    building = random_bridge.build(0)
    middle = np.append(building.paths["across"][2], building.start[2])
    seen = lidar.scan(LidarModel(beams=181), building, middle, 0.0, np.random.default_rng(0))
    assert np.mean(np.isfinite(seen.crossing_m)) > 0.3
    assert np.mean(seen.case == 0) > 0.2
