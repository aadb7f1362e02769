"""The compiled glass map against the same formulas in numpy, on a map of walls of all directions."""

from __future__ import annotations

import numpy as np
import pytest
from slow_glass_map import SlowGlassMap

from glass_nav.localization.beam_classification.glass_map import GlassEvidence, GlassMap
from glass_nav.world.grid_map import GridMap

ROWS, COLUMNS = 60, 90


def drawn(seed):
    """A map, and scans of crossings (cell, incidence [rad], passed), most of them at walls."""
    rng = np.random.default_rng(seed)
    occupancy = np.zeros((ROWS, COLUMNS), np.int8)
    occupancy[:, [0, 40, 41, 89]] = occupancy[[0, 30, 59]] = 100
    occupancy[np.arange(50), np.arange(50) + 20] = 100
    walls = np.flatnonzero(occupancy)
    leaky = rng.uniform(size=len(walls)) < 0.5
    scans = []
    for _ in range(30):
        at = rng.integers(len(walls), size=200)
        cell = np.where(rng.uniform(size=200) < 0.1, rng.integers(ROWS * COLUMNS, size=200), walls[at])
        incidence = np.where(rng.uniform(size=200) < 0.1, np.nan, rng.uniform(0.0, 1.3, 200))
        scans.append((cell, incidence, rng.uniform(size=200) < np.where(leaky[at], 0.9, 0.05)))
    return GridMap(occupancy, 0.05, np.array([3.0, -2.0, 0.3])), scans


@pytest.mark.parametrize("seed", range(3))
def test_the_compiled_glass_map_is_that_of_numpy(seed):
    grid_map, scans = drawn(seed)
    fast, slow = GlassMap(grid_map, GlassEvidence()), SlowGlassMap(grid_map, GlassEvidence())
    for crossings in scans:
        fast.learn(*crossings)
        slow.learn(*crossings)
    cell = np.append(np.arange(ROWS * COLUMNS), -1)
    np.testing.assert_allclose(fast.chances(cell), slow.chances(cell), atol=1e-5)
    np.testing.assert_array_equal(fast.occupancy(), slow.occupancy())
    rng = np.random.default_rng(seed)
    axis_rad = np.where(rng.uniform(size=len(cell)) < 0.1, np.nan, rng.uniform(-1.6, 1.6, len(cell)))
    opaque = rng.uniform(size=len(cell)) < 0.3
    opaque[-1] = False
    gone = slow.is_gone(cell, axis_rad, opaque)
    assert 20 < np.count_nonzero(gone) < 0.5 * len(gone)
    np.testing.assert_array_equal(fast.is_gone(cell, axis_rad, opaque), gone)
