"""Picture of a robot that woke up somewhere: its path over the map, the candidates at each depth, where it ended.

By matplotlib without a display. Poses (3,) x [m], y [m], yaw [rad] in the frame map.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, List, Optional

import numpy as np

from glass_nav.evaluation.plots.canvas import frame, new_figure
from glass_nav.evaluation.plots.labels import Labels
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.world.grid_map import GridMap

MARGIN_M = 1.5
MAX_PANELS = 8  # of depths; the first and the last ones
COLUMNS = 2
SEARCH_COLOUR, TOUR_COLOUR, CANDIDATE_COLOUR, TRUE_COLOUR = "#c98c00", "#0072b2", "#55104a", "#14dcab"


@dataclass(frozen=True)
class Depth:
    """One meetpoint of a search."""

    candidates: np.ndarray  # (K, 3) poses of the robot that fit
    truth: Optional[np.ndarray]  # (3,) where it was; None: not known
    text: str  # what followed, in a few words


@dataclass(frozen=True)
class WakeUpStory:
    """What happened."""

    depths: List[Depth]
    search_m: np.ndarray  # (N, 2) true path until the place was known, or the end
    tour_m: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))  # (M, 2) true path after that
    handed_over: Optional[np.ndarray] = None  # (3,) pose that the search found
    final: Optional[np.ndarray] = None  # (3,) pose that the localization says at the end
    truth: Optional[np.ndarray] = None  # (3,) true pose then


def draw(path: Path, grid: GridMap, story: WakeUpStory, title: str) -> None:
    """Above the whole path, below a small map for each depth."""
    low, high = _bounds(grid, story)
    shown = _shown(len(story.depths))
    rows = math.ceil(len(shown) / COLUMNS)
    shape = float(np.clip((high[1] - low[1]) / (high[0] - low[0]), 0.2, 1.5))
    heights = [11.0 * shape, *[11.0 * shape / COLUMNS] * rows]
    figure = new_figure(11.5, sum(heights) + 0.9 + 0.35 * rows)
    layout = figure.add_gridspec(1 + rows, COLUMNS, height_ratios=heights)
    above = figure.add_subplot(layout[0, :])
    _draw_way(above, grid, story, low, high)
    above.set_title(title, fontsize=11)
    for place, number in enumerate(shown):
        axes = figure.add_subplot(layout[1 + place // COLUMNS, place % COLUMNS])
        _draw_depth(axes, grid, story.depths[number], number, low, high)
    figure.savefig(path)


def _shown(count: int) -> List[int]:
    """Depths with a panel."""
    if count <= MAX_PANELS:
        return list(range(count))
    return [*range(MAX_PANELS // 2), *range(count - MAX_PANELS // 2, count)]


def _bounds(grid: GridMap, story: WakeUpStory) -> "tuple[np.ndarray, np.ndarray]":
    """All that is drawn, and at least the path."""
    parts = [story.search_m, story.tour_m, *(depth.candidates[:, :2] for depth in story.depths)]
    points = np.concatenate([part.reshape(-1, 2) for part in parts])
    if not len(points):
        height, width = grid.occupancy.shape
        points = grid.map_from_grid[:2] + np.array([[0.0, 0.0], [width, height]]) * grid.resolution_m
    low, high = points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 3.0)
    return middle - half, middle + half


def _ground(axes: Any, grid: GridMap, low: np.ndarray, high: np.ndarray) -> None:
    draw_map(axes, grid, low, high)
    frame(axes, low, high)


def _draw_way(axes: Any, grid: GridMap, story: WakeUpStory, low: np.ndarray, high: np.ndarray) -> None:
    _ground(axes, grid, low, high)
    for way, colour, style, width, label in (
        (story.tour_m, TOUR_COLOUR, "-", 3.2, "true path of the tour"),
        (story.search_m, SEARCH_COLOUR, "--", 1.8, "true path of the search"),
    ):
        if len(way):
            axes.plot(way[:, 0], way[:, 1], color=colour, linestyle=style, linewidth=width, label=label, zorder=3)
            axes.plot(*way[0], "o", color=colour, markersize=5, zorder=4)
    labels = Labels(axes)
    for number, depth in enumerate(story.depths):
        if depth.truth is not None:
            labels.add(depth.truth[:2], str(number), fontsize=8, zorder=6)
    for pose, colour, label in (
        (story.handed_over, CANDIDATE_COLOUR, "pose handed over"),
        (story.truth, TRUE_COLOUR, "true pose at the end"),
        (story.final, "#000000", "localization at the end"),
    ):
        if pose is not None:
            _arrows(axes, pose[None], colour, label)
    axes.legend(loc="best", fontsize=8, framealpha=0.9)


def _draw_depth(axes: Any, grid: GridMap, depth: Depth, number: int, low: np.ndarray, high: np.ndarray) -> None:
    _ground(axes, grid, low, high)
    if len(depth.candidates):
        _arrows(axes, depth.candidates, CANDIDATE_COLOUR, "")
    if depth.truth is not None:
        axes.plot(
            depth.truth[0],
            depth.truth[1],
            "o",
            markersize=9,
            markerfacecolor="none",
            markeredgecolor=TRUE_COLOUR,
            markeredgewidth=1.8,
            zorder=5,
        )
    count = len(depth.candidates)
    axes.set_title(f"depth {number}: {count} candidate{'s' * (count != 1)}; {depth.text}", fontsize=8)


def _arrows(axes: Any, poses: np.ndarray, colour: str, label: str) -> None:
    axes.quiver(
        poses[:, 0],
        poses[:, 1],
        np.cos(poses[:, 2]),
        np.sin(poses[:, 2]),
        color=colour,
        angles="xy",
        scale_units="xy",
        scale=0.9,
        width=0.004,
        zorder=5,
        label=label or None,
    )
