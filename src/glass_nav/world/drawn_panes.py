"""Draws panes into a copy of a map; every other cell stays as it is."""

from __future__ import annotations

from dataclasses import replace
from typing import Sequence

import numpy as np

from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

_OCCUPIED = 100
_STEPS_PER_CELL = 10
_MIN_SHARE = 0.35  # of a cell's width that a pane crosses; where it only cuts a corner, its neighbours hold it


class PaneError(ValueError):
    """A pane that cannot be drawn; one line."""


def drawn(grid_map: GridMap, panes: Sequence[Pane]) -> GridMap:
    """The map with the cells of the panes occupied; the map itself is left as it is.

    Raises:
        PaneError: a pane that lies outside the map.
    """
    occupancy = grid_map.occupancy.copy()
    for number, pane in enumerate(panes, start=1):
        occupancy.ravel()[cells(grid_map, pane, number)] = _OCCUPIED
    return replace(grid_map, occupancy=occupancy)


def cells(grid_map: GridMap, pane: Pane, number: int = 1) -> np.ndarray:
    """(N,) flat indices of the cells that a pane crosses.

    Args:
        grid_map: the map.
        pane: in its frame.
        number: of the pane, for the error.

    Raises:
        PaneError: the pane lies outside the map.
    """
    if not grid_map.contains(*grid_map.cells(np.stack([pane.start_m, pane.end_m]))).all():
        raise PaneError(f"pane {number}, {_place(pane)}, lies outside the map")
    steps = int(np.ceil(pane.length_m / grid_map.resolution_m * _STEPS_PER_CELL)) + 1
    points = pane.start_m + np.linspace(0.0, 1.0, steps)[:, None] * (np.asarray(pane.end_m) - pane.start_m)
    rows, columns = grid_map.cells(points)
    crossed, count = np.unique(rows * grid_map.occupancy.shape[1] + columns, return_counts=True)
    held = count >= min(_MIN_SHARE * _STEPS_PER_CELL, float(count.max()))
    return crossed[held]


def _place(pane: Pane) -> str:
    (x0, y0), (x1, y1) = pane.start_m, pane.end_m
    return f"from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m"
