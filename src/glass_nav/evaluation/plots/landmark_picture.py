"""Picture of the expected position error over a map for a set of landmarks. M points, N landmarks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Tuple

import numpy as np

from glass_nav.evaluation.plots.canvas import frame, new_figure
from glass_nav.evaluation.plots.labels import Labels
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.vocabulary import LEFT_OUT_RGB, TAG_RGB, hex_colour
from glass_nav.world.grid_map import GridMap

MARGIN_M = 1.0
LARGEST_M = 0.5  # of the colour scale; the seed document asks for 0.3 m
TAG_COLOUR, NEW_COLOUR, NO_FIX_COLOUR = hex_colour(TAG_RGB), hex_colour(LEFT_OUT_RGB), "#f0c4b4"
ARROW_M = 0.9


@dataclass(frozen=True)
class Tags:
    """Landmarks to draw."""

    names: Tuple[str, ...]
    positions_m: np.ndarray  # (N, 2)
    facing_rad: np.ndarray  # (N,) NaN: to all sides


@dataclass(frozen=True)
class Panel:
    """A set of landmarks and the errors that it gives."""

    title: str
    tags: Tags
    new: Tags
    sigma_m: np.ndarray  # (M,) expected standard deviation, inf: no position


def draw(path: Path, grid: GridMap, points_m: np.ndarray, spacing_m: float, panels: "list[Panel]", title: str) -> None:
    """Points (M, 2) coloured by expected error, one panel below the other."""
    shown = np.concatenate([points_m, *(part.positions_m for panel in panels for part in (panel.tags, panel.new))])
    low, high = shown.min(axis=0) - MARGIN_M, shown.max(axis=0) + MARGIN_M
    width, height = high - low
    tall = float(np.clip(12.0 * height / width, 2.5, 11.0))
    figure = new_figure(13.5, 0.6 + len(panels) * (tall + 0.7), dpi=100)
    all_axes = figure.subplots(len(panels), 1, squeeze=False)[:, 0]
    for axes, panel in zip(all_axes, panels):
        drawn = _draw_panel(axes, grid, points_m, spacing_m, panel, low, high)
    bar = figure.colorbar(drawn, ax=list(all_axes), pad=0.01, fraction=0.03, extend="max")
    bar.set_label("expected position error, sigma [m]; pink: no position")
    figure.suptitle(title, fontsize=11)
    figure.savefig(path)


def _draw_panel(
    axes: Any, grid: GridMap, points_m: np.ndarray, spacing_m: float, panel: Panel, low: np.ndarray, high: np.ndarray
) -> Any:
    from matplotlib.collections import PolyCollection
    from matplotlib.patheffects import withStroke

    draw_map(axes, grid, low, high)
    frame(axes, low, high)
    labels = Labels(axes)
    corners = points_m[:, None] + 0.5 * spacing_m * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    known = np.isfinite(panel.sigma_m)
    axes.add_collection(PolyCollection(corners[~known], facecolors=NO_FIX_COLOUR, edgecolors="none", alpha=0.8))
    squares = PolyCollection(corners[known], cmap="viridis", edgecolors="none", alpha=0.9)
    squares.set_array(panel.sigma_m[known])
    squares.set_clim(0.0, LARGEST_M)
    axes.add_collection(squares)
    for tags, colour, mark in ((panel.tags, TAG_COLOUR, "o"), (panel.new, NEW_COLOUR, "D")):
        for name, (x, y), facing in zip(tags.names, tags.positions_m, tags.facing_rad):
            axes.plot(x, y, mark, color=colour, markersize=7, markeredgecolor="white", zorder=4)
            if np.isfinite(facing):
                axes.annotate(
                    "",
                    (x + ARROW_M * np.cos(facing), y + ARROW_M * np.sin(facing)),
                    (x, y),
                    zorder=4,
                    arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.6},
                )
            labels.add(
                np.array([x, y]),
                name,
                fontsize=9,
                color=colour,
                fontweight="bold",
                zorder=5,
                path_effects=[withStroke(linewidth=2.5, foreground="white")],
            )
    axes.set_title(panel.title, fontsize=10)
    return squares
