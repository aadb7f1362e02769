"""Panes drawn into a map: their cells, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.sensing.raycast import RayCaster
from glass_nav.world.drawn_panes import PaneError, drawn
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane


def floor(seed: int = 0) -> GridMap:
    rng = np.random.default_rng(seed)
    return GridMap(rng.choice(np.array([-1, 0, 0, 0, 30, 100], np.int8), (80, 120)), 0.05, np.array([1.0, -2.0, 0.4]))


@pytest.mark.parametrize("seed", range(5))
def test_only_cells_on_the_pane_change(seed: int) -> None:
    grid_map = floor(seed)
    before = grid_map.occupancy.copy()
    ends = grid_map.centres(np.array([10, 70]), np.array([15, 80 + seed]))
    pane = Pane(ends[0], ends[1])
    changed = np.argwhere(drawn(grid_map, [pane]).occupancy != before)
    np.testing.assert_array_equal(grid_map.occupancy, before)
    from_start = grid_map.centres(changed[:, 0], changed[:, 1]) - pane.start_m
    across = pane.direction[0] * from_start[:, 1] - pane.direction[1] * from_start[:, 0]
    assert len(changed) > 20
    assert np.abs(across).max() < 0.05


@pytest.mark.parametrize("angle_rad", np.linspace(0.0, np.pi, 7))
def test_no_beam_slips_through_a_drawn_pane(angle_rad: float) -> None:
    empty = GridMap(np.zeros((100, 100), np.int8), 0.05, np.array([-2.5, -2.5, 0.0]))
    way = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    caster = RayCaster(drawn(empty, [Pane(-2.0 * way, 2.0 * way)]))
    from_m = 1.0 * np.array([-way[1], way[0]])
    beams = np.arctan2(-from_m[1], -from_m[0]) + np.linspace(-0.9, 0.9, 200)
    assert np.isfinite(caster.cast(np.array([[*from_m, 0.0]]), beams, 2.5)).all()


@pytest.mark.parametrize("end_m, text", [(51.0, "51"), (1e12, r"1e\+12")])
def test_a_pane_outside_the_map_is_refused_by_its_number(end_m: float, text: str) -> None:
    grid_map = floor()
    inside = Pane(*grid_map.centres(np.array([5, 9]), np.array([5, 9])))
    with pytest.raises(PaneError, match=rf"pane 2, from \(50, 50\) to \({text}, 50\) m, lies outside the map"):
        drawn(grid_map, [inside, Pane(np.array([50.0, 50.0]), np.array([end_m, 50.0]))])


@pytest.mark.parametrize(
    "arguments, message",
    [
        (([0.0, 0.0], [0.0, 0.0]), r"length > 0 m, got one from \(0, 0\) to \(0, 0\) m"),
        (([0.0, np.nan], [1.0, 0.0]), "all finite, got"),
        (([0.0], [1.0, 0.0]), "all finite, got"),
        (([0.0, 0.0], [1.0, 0.0], 1.5), "probability of a pane must be in"),
    ],
)
def test_an_impossible_pane_is_refused(arguments: "tuple[object, ...]", message: str) -> None:
    start, end, *rest = arguments
    with pytest.raises(ValueError, match=message):
        Pane(np.array(start, float), np.array(end, float), *rest)  # type: ignore[arg-type]
