"""Picture of a robot that woke up somewhere: its path over the whole map, the candidates at each depth, where it ended.

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
from glass_nav.evaluation.plots.map_layer import UNKNOWN_GREY, WALL_BLACK, draw_map
from glass_nav.geometry import se2
from glass_nav.world.grid_map import GridMap

MARGIN_M = 0.5
MAX_PANELS = 8  # of depths; the first and the last ones
COLUMNS = 2
LEGEND_IN = 0.8  # height of the legend
SEARCH_COLOUR, TOUR_COLOUR, CANDIDATE_COLOUR, TRUE_COLOUR = "#c98c00", "#0072b2", "#55104a", "#14dcab"
FINAL_COLOUR = "#000000"


@dataclass(frozen=True)
class Depth:
    """One meetpoint of a search."""

    candidates: np.ndarray  # (K, 3) poses of the robot that fit
    truth: Optional[np.ndarray]  # (3,) where it was; None: not known
    text: str  # what followed, in a few words


@dataclass(frozen=True)
class WakeUpStory:
    """A wake-up, from the start to the end of the tour."""

    depths: List[Depth]
    search_m: np.ndarray  # (N, 2) true path until the place was known, or the end
    tour_m: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))  # (M, 2) true path after that
    handed_over: Optional[np.ndarray] = None  # (3,) pose that the search found
    final: Optional[np.ndarray] = None  # (3,) pose that the localization says at the end
    truth: Optional[np.ndarray] = None  # (3,) true pose then


def draw(path: Path, grid: GridMap, story: WakeUpStory, title: str) -> None:
    """Above the whole path, below a small map for each depth, at the foot what each mark means."""
    low, high = _bounds(grid, story)
    shown = _shown(len(story.depths))
    rows = math.ceil(len(shown) / COLUMNS)
    shape = float(np.clip((high[1] - low[1]) / (high[0] - low[0]), 0.2, 1.5))
    heights = [11.0 * shape, *[11.0 * shape / COLUMNS] * rows]
    figure = new_figure(11.5, sum(heights) + 1.0 + LEGEND_IN + 0.55 * rows)
    layout = figure.add_gridspec(2 + rows, COLUMNS, height_ratios=[*heights, LEGEND_IN])
    above = figure.add_subplot(layout[0, :])
    _draw_way(above, grid, story, low, high)
    above.set_title(title, fontsize=11)
    for place, number in enumerate(shown):
        axes = figure.add_subplot(layout[1 + place // COLUMNS, place % COLUMNS])
        _draw_depth(axes, grid, story.depths[number], number, low, high)
    foot = figure.add_subplot(layout[-1, :])
    foot.axis("off")
    legend = foot.legend(handles=_marks(story), loc="center", ncol=4, fontsize=8, frameon=False)
    legend.set_in_layout(False)  # its place is LEGEND_IN high; matplotlib before 3.5 would squeeze the maps for it
    figure.savefig(path)


def _shown(count: int) -> List[int]:
    """Depths of the search that get a panel."""
    if count <= MAX_PANELS:
        return list(range(count))
    return [*range(MAX_PANELS // 2), *range(count - MAX_PANELS // 2, count)]


def _bounds(grid: GridMap, story: WakeUpStory) -> "tuple[np.ndarray, np.ndarray]":
    """Corners of the box around the known map and the path."""
    rows, columns = np.nonzero(grid.occupancy >= 0)
    if len(rows):
        corners = [[x, y] for x in (columns.min(), columns.max() + 1) for y in (rows.min(), rows.max() + 1)]
    else:
        corners = [[0, 0], list(grid.occupancy.shape[::-1])]
    known = se2.transform_points(grid.map_from_grid, np.array(corners, float) * grid.resolution_m)
    points = np.concatenate([known, story.search_m.reshape(-1, 2), story.tour_m.reshape(-1, 2)])
    return points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M


def _ground(axes: Any, grid: GridMap, low: np.ndarray, high: np.ndarray) -> None:
    draw_map(axes, grid, low, high)
    frame(axes, low, high)


def _draw_way(axes: Any, grid: GridMap, story: WakeUpStory, low: np.ndarray, high: np.ndarray) -> None:
    _ground(axes, grid, low, high)
    for way, colour, style, width in (
        (story.tour_m, TOUR_COLOUR, "-", 3.2),
        (story.search_m, SEARCH_COLOUR, "--", 1.8),
    ):
        if len(way):
            axes.plot(way[:, 0], way[:, 1], color=colour, linestyle=style, linewidth=width, zorder=3)
    if len(story.search_m):
        axes.plot(*story.search_m[0], **_START, zorder=4)
    for pose, colour in ((story.handed_over, CANDIDATE_COLOUR), (story.final, FINAL_COLOUR)):
        if pose is not None:
            _arrows(axes, pose[None], colour)
    if story.truth is not None:
        axes.plot(*story.truth[:2], **_TRUTH, zorder=6)
    axes.figure.canvas.draw()  # the layout, which says how much room a label has
    labels = Labels(axes)
    for number, depth in reversed(list(enumerate(story.depths))):  # where there is no room for all, the last ones
        if depth.truth is not None:
            axes.plot(*depth.truth[:2], **_MEETPOINT, zorder=4)
            labels.add(depth.truth[:2], str(number), fontsize=8, zorder=7, bbox=_PAPER)


def _draw_depth(axes: Any, grid: GridMap, depth: Depth, number: int, low: np.ndarray, high: np.ndarray) -> None:
    _ground(axes, grid, low, high)
    if len(depth.candidates):
        _arrows(axes, depth.candidates, CANDIDATE_COLOUR)
    if depth.truth is not None:
        axes.plot(*depth.truth[:2], **_TRUTH, zorder=6)
    count = len(depth.candidates)
    axes.set_title(f"depth {number}: {count} candidate{'s' * (count != 1)}; {depth.text}", fontsize=8)


def _arrows(axes: Any, poses: np.ndarray, colour: str) -> None:
    """Draw arrows at poses, equally long on paper for every building."""
    axes.quiver(
        poses[:, 0],
        poses[:, 1],
        np.cos(poses[:, 2]),
        np.sin(poses[:, 2]),
        color=colour,
        angles="xy",
        units="inches",
        scale_units="inches",
        scale=4.0,
        width=0.03,
        zorder=5,
    )


_RING = {"linestyle": "none", "marker": "o", "markerfacecolor": "none"}
_START = {"linestyle": "none", "marker": "o", "color": SEARCH_COLOUR, "markersize": 7}
_MEETPOINT = {"linestyle": "none", "marker": "s", "color": SEARCH_COLOUR, "markersize": 4}
_TRUTH = {**_RING, "markersize": 11, "markeredgecolor": TRUE_COLOUR, "markeredgewidth": 2.0}
_PAPER = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}


def _marks(story: WakeUpStory) -> List[Any]:
    """Handles of the legend, for all marks drawn."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def arrow(colour: str, label: str) -> Any:
        return Line2D([], [], linestyle="none", marker=r"$\rightarrow$", markersize=14, color=colour, label=label)

    path = {"color": SEARCH_COLOUR, "linestyle": "--", "linewidth": 1.8}
    marks = [
        (bool(len(story.search_m)), Line2D([], [], label="true path during the search", **path)),
        (bool(len(story.search_m)), Line2D([], [], label="where it woke up", **_START)),
        (
            any(depth.truth is not None for depth in story.depths),
            Line2D([], [], label="meetpoint, with its search depth", **_MEETPOINT),
        ),
        (bool(len(story.tour_m)), Line2D([], [], color=TOUR_COLOUR, linewidth=3.2, label="true path of the tour")),
        (
            bool(story.depths) or story.handed_over is not None,
            arrow(CANDIDATE_COLOUR, "candidate; above: the pose handed over"),
        ),
        (story.final is not None, arrow(FINAL_COLOUR, "pose by the localization at the end")),
        (True, Line2D([], [], label="true place; above: at the end", **_TRUTH)),
        (True, Patch(facecolor=str(WALL_BLACK), label="wall or glass on the map")),
        (True, Patch(facecolor=str(UNKNOWN_GREY), edgecolor="0.6", label="unknown on the map")),
    ]
    return [mark for drawn, mark in marks if drawn]
