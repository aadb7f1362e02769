"""Pictures of an atlas over its map, by matplotlib without a display."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional, Sequence

import numpy as np

from glass_nav.evaluation.plots.canvas import frame, new_figure
from glass_nav.evaluation.plots.labels import Labels
from glass_nav.evaluation.plots.map_layer import UNKNOWN_GREY, draw_map
from glass_nav.vocabulary import SERIES_COLOURS
from glass_nav.world.grid_map import GridMap

MARGIN_M = 1.0
MAX_NUMBERS = 250  # nodes; more numbers are unreadable
MIN_NUMBERED_M = 0.8
EDGE_COLOUR, CHOSEN_COLOUR, WALL_COLOUR = SERIES_COLOURS[0], SERIES_COLOURS[1], SERIES_COLOURS[2]
NODE_COLOURS = {1: "#ffd21a", 2: "#8a2fd0", 3: "#c04a00", 4: "#14c08c", 5: "#111111"}  # 5 and more
NODE_MARKS = {1: "v", 2: "s", 3: "o", 4: "D", 5: "P"}
NODE_NAMES = {1: "degree 1 (dead end)", 2: "degree 2 (ring)", 3: "degree 3", 4: "degree 4", 5: "degree 5 or more"}


@dataclass(frozen=True)
class AtlasDrawing:
    """The parts of an atlas to draw, in the frame map [m]. N nodes, E edges."""

    position_m: np.ndarray  # (N, 2)
    r_m: np.ndarray  # (N,)
    degree: np.ndarray  # (N,)
    lines_m: Sequence[np.ndarray]  # (E) arrays (n, 2)
    seen_there_m: Sequence[np.ndarray]  # (E) arrays (k, 4): wall segments seen along the line
    seen_back_m: Sequence[np.ndarray]  # (E) arrays (k, 4): and along its return


def draw_atlas(path: Path, grid: Optional[GridMap], atlas: AtlasDrawing, title: str) -> None:
    """One above the other: nodes and edges with their numbers; the segments seen on each edge there; and back."""
    low, high = _bounds(atlas, range(len(atlas.lines_m)))
    figure, panels = _panels(low, high, 3)
    figure.suptitle(f"{title}\n{_counts(atlas)}", fontsize=11)
    for axes in panels:
        _draw_ground(axes, grid, low, high)
    _draw_graph(panels[0], atlas)
    panels[0].legend(loc="best", fontsize=8, framealpha=0.9)
    for axes, seen, which in zip(panels[1:], (atlas.seen_there_m, atlas.seen_back_m), ("there", "back")):
        _draw_views(axes, atlas, seen, which)
    figure.savefig(path)


def draw_edge(path: Path, grid: Optional[GridMap], atlas: AtlasDrawing, edge: int, title: str) -> None:
    """One edge with the segments seen on it, there and back."""
    low, high = _bounds(atlas, [edge])
    figure, panels = _panels(low, high, 2)
    figure.suptitle(f"{title}: edge {edge}", fontsize=11)
    for axes, seen, way in zip(panels, (atlas.seen_there_m, atlas.seen_back_m), (1, -1)):
        _draw_ground(axes, grid, low, high)
        _draw_graph(axes, atlas)
        _draw_segments(axes, seen[edge], WALL_COLOUR, 3.0)
        line = atlas.lines_m[edge][::way]
        axes.plot(line[:, 0], line[:, 1], color=CHOSEN_COLOUR, linewidth=2.0)
        _draw_arrow(axes, line, CHOSEN_COLOUR)
        axes.set_title(f"{'there' if way == 1 else 'back'}: {len(seen[edge])} segments", fontsize=10)
    figure.savefig(path)


def _panels(low: np.ndarray, high: np.ndarray, count: int) -> Any:
    """A figure with `count` axes: one below the other for a wide floor, else side by side."""
    width, height = high - low
    column = width > 1.4 * height
    side = 13.0 if column else 8.0
    size = (side, side * float(np.clip(height / width, 0.1, 3.0)) + 0.4)
    figure = new_figure(*(size[0], count * size[1] + 0.8) if column else (count * size[0], size[1] + 0.8))
    axes = figure.subplots(count, 1) if column else figure.subplots(1, count)
    for each in axes:
        frame(each, low, high)
    return figure, axes


def _bounds(atlas: AtlasDrawing, edges: Sequence[int]) -> "tuple[np.ndarray, np.ndarray]":
    parts = [atlas.position_m] if len(edges) == len(atlas.lines_m) else []
    for edge in edges:
        parts += [atlas.lines_m[edge], atlas.seen_there_m[edge].reshape(-1, 2), atlas.seen_back_m[edge].reshape(-1, 2)]
    points = np.concatenate(parts)
    return points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M


def _draw_ground(axes: Any, grid: Optional[GridMap], low: np.ndarray, high: np.ndarray) -> None:
    if grid is not None:
        draw_map(axes, grid, low, high)
    else:
        axes.set_facecolor(str(UNKNOWN_GREY))


def _draw_graph(axes: Any, atlas: AtlasDrawing) -> None:
    """Edges and nodes with numbers; where two would overlap, the node's is drawn."""
    labels = Labels(axes)
    _draw_nodes(axes, atlas, labels)
    _draw_edges(axes, atlas, labels)


def _draw_edges(axes: Any, atlas: AtlasDrawing, labels: Labels) -> None:
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(atlas.lines_m), colors=EDGE_COLOUR, linewidths=1.3, zorder=2))
    if len(atlas.lines_m) <= MAX_NUMBERS:
        for edge, line in enumerate(atlas.lines_m):
            if np.hypot(*np.ptp(line, axis=0)) < MIN_NUMBERED_M:
                continue  # its number would hide it
            labels.add(
                line[len(line) // 2],
                str(edge),
                fontsize=5.5,
                centred=True,
                color=EDGE_COLOUR,
                zorder=4,
                bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7},
            )


def _draw_nodes(axes: Any, atlas: AtlasDrawing, labels: Labels) -> None:
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle

    if len(atlas.r_m) <= MAX_NUMBERS:
        circles = [Circle(tuple(point), r_m) for point, r_m in zip(atlas.position_m, atlas.r_m)]
        axes.add_collection(
            PatchCollection(circles, facecolors="none", edgecolors="#bbbbbb", linewidths=0.4, zorder=1.5)
        )
    shown = np.minimum(atlas.degree, max(NODE_COLOURS))
    for degree, colour in NODE_COLOURS.items():
        chosen = shown == degree
        if chosen.any():
            axes.plot(
                atlas.position_m[chosen, 0],
                atlas.position_m[chosen, 1],
                NODE_MARKS[degree],
                color=colour,
                markeredgecolor="#333333",
                markeredgewidth=0.4,
                markersize=4.5,
                label=f"{NODE_NAMES[degree]}: {chosen.sum()}",
                zorder=3,
            )
    if len(atlas.r_m) <= MAX_NUMBERS:
        for node, point in enumerate(atlas.position_m):
            labels.add(point, str(node), fontsize=6, zorder=4)


def _draw_views(axes: Any, atlas: AtlasDrawing, seen: Sequence[np.ndarray], which: str) -> None:
    for edge, (line, segments) in enumerate(zip(atlas.lines_m, seen)):
        colour = SERIES_COLOURS[edge % len(SERIES_COLOURS)]
        _draw_segments(axes, segments, colour, 1.6)
        line = line if which == "there" else line[::-1]
        axes.plot(line[:, 0], line[:, 1], color=colour, linewidth=1.0)
        _draw_arrow(axes, line, colour)
    axes.set_title(f"segments seen {which}: {sum(map(len, seen))}, in the colour of the edge last drawn", fontsize=10)


def _draw_segments(axes: Any, segments: np.ndarray, colour: Any, width: float) -> None:
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(segments.reshape(-1, 2, 2), colors=[colour], linewidths=width, zorder=2.5))


def _draw_arrow(axes: Any, line: np.ndarray, colour: Any) -> None:
    """An arrow along the line, at its middle."""
    middle = len(line) // 2
    axes.annotate(
        "",
        line[middle],
        line[middle - 1],
        annotation_clip=True,
        arrowprops={"arrowstyle": "-|>", "color": colour, "mutation_scale": 9, "shrinkA": 0, "shrinkB": 0},
    )


def _counts(atlas: AtlasDrawing) -> str:
    way_m = sum(float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in atlas.lines_m)
    return f"{len(atlas.r_m)} nodes, {len(atlas.lines_m)} edges, {way_m:.0f} m of paths"
