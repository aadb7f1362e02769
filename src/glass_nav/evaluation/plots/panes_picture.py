"""Picture of a map and the panes that it lacks, by matplotlib without a display."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Optional, Sequence

import numpy as np

from glass_nav.evaluation.plots.canvas import frame, new_figure
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.world.grid_map import UNKNOWN, GridMap
from glass_nav.world.pane import Pane

MARGIN_M = 1.0
COLOUR_MAP = "viridis_r"


def draw(path: Path, before: GridMap, panes: Sequence[Pane], title: str, after: Optional[GridMap] = None) -> None:
    """The map, and, if it is given, beside it the map with the panes drawn in; the panes by number and probability."""
    low, high = _extent(before)
    wide = (high[0] - low[0]) > 1.6 * (high[1] - low[1])
    count = 1 if after is None else 2
    rows, columns = (count, 1) if wide else (1, count)
    width = 11.0
    height = float(np.clip(width / columns * (high[1] - low[1]) / (high[0] - low[0]), 2.0, 12.0)) * rows + 0.9
    figure = new_figure(width, height)
    figure.suptitle(title, fontsize=11)
    maps = [(before, "map")] if after is None else [(before, "before"), (after, "after")]
    shown = np.atleast_1d(figure.subplots(rows, columns))
    for axes, (grid_map, name) in zip(shown, maps):
        draw_map(axes, grid_map, low, high)
        frame(axes, low, high)
        axes.set_title(name, fontsize=9)
    if panes:
        _draw_panes(figure, shown[-1], panes, list(shown))
    figure.savefig(path)


def _draw_panes(figure: Any, axes: Any, panes: Sequence[Pane], beside: Sequence[Any]) -> None:
    from matplotlib.collections import LineCollection

    lines = LineCollection([np.array([pane.start_m, pane.end_m]) for pane in panes], linewidths=3.0, cmap=COLOUR_MAP)
    lines.set_array(np.array([pane.probability for pane in panes]))
    lines.set_clim(0.0, 1.0)
    axes.add_collection(lines)
    for number, pane in enumerate(panes, start=1):
        axes.annotate(
            str(number), 0.5 * (pane.start_m + pane.end_m), (4, 4), textcoords="offset points", fontsize=7, color="C3"
        )
    figure.colorbar(lines, ax=list(beside), label="probability of glass", shrink=0.6)


def _extent(grid_map: GridMap) -> "tuple[np.ndarray, np.ndarray]":
    """Lower left and upper right corner (2,) [m] of the known part of the map."""
    rows, columns = np.nonzero(grid_map.occupancy != UNKNOWN)
    if not len(rows):
        rows, columns = np.array([0, grid_map.occupancy.shape[0] - 1]), np.array([0, grid_map.occupancy.shape[1] - 1])
    ends = grid_map.centres(
        np.array([rows.min(), rows.min(), rows.max(), rows.max()]),
        np.array([columns.min(), columns.max(), columns.min(), columns.max()]),
    )
    return ends.min(axis=0) - MARGIN_M, ends.max(axis=0) + MARGIN_M
