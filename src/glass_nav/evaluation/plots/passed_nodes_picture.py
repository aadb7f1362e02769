"""Picture of a drive over map and atlas: nodes seen (discs), missed (crosses), false positives (diamonds). By matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Sequence

import numpy as np

from glass_nav.evaluation.metrics.passed_nodes import INVENTED, MISSED, SEEN, TopologyScore
from glass_nav.evaluation.plots.canvas import frame, new_figure
from glass_nav.evaluation.plots.labels import Labels
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.vocabulary import SERIES_COLOURS
from glass_nav.world.grid_map import GridMap

MARGIN_M = 2.0
COLOURS = {SEEN: SERIES_COLOURS[5], MISSED: "#8f0000", INVENTED: SERIES_COLOURS[4]}
_MARKS = {SEEN: "o", MISSED: "X", INVENTED: "D"}
_SIZES = {SEEN: 9.0, MISSED: 5.0, INVENTED: 5.0}  # a node seen once and missed once shows both
_WAY_COLOUR, _EDGE_COLOUR, _NODE_COLOUR = SERIES_COLOURS[0], "#b9b9b9", "#8a8a8a"


def draw(
    path: Path, grid: GridMap, lines_m: Sequence[np.ndarray], way_m: np.ndarray, score: TopologyScore, title: str
) -> None:
    """Draws one map.

    Args:
        path: of the PNG.
        grid: the map.
        lines_m: (E) arrays (n, 2): edges of the atlas.
        way_m: (S, 2) of the robot, NaN where it is not known.
        score: what it saw.
        title: first line above it.
    """
    from matplotlib.collections import LineCollection

    known_way = way_m[np.isfinite(way_m).all(axis=1)]
    shown = known_way if len(known_way) else score.known.position_m
    low, high = shown.min(axis=0) - MARGIN_M, shown.max(axis=0) + MARGIN_M
    size = np.maximum(high - low, 0.7 * float((high - low).max()))  # a corridor is not to become a ribbon
    low, high = 0.5 * (low + high - size), 0.5 * (low + high + size)
    width, height = 12.0 * size / size.max()
    figure = new_figure(width, height + 1.0)
    axes = figure.subplots()
    draw_map(axes, grid, low, high)
    axes.add_collection(LineCollection(list(lines_m), colors=_EDGE_COLOUR, linewidths=0.8, zorder=2))
    axes.plot(*score.known.position_m.T, ".", color=_NODE_COLOUR, markersize=3.0, zorder=2.5)
    axes.plot(*way_m.T, color=_WAY_COLOUR, linewidth=0.9, alpha=0.8, zorder=3, label="path of the robot")
    frame(axes, low, high)
    labels = Labels(axes)
    for verdict in COLOURS:
        _draw_meetings(axes, score, verdict, labels)
    axes.legend(loc="best", fontsize=8, framealpha=0.9)
    figures = score.metrics()
    axes.set_title(
        f"{title}\n{figures['passed']} nodes passed: {figures['seen']} seen, {figures['missed']} missed; "
        f"{figures['invented']} false positives",
        fontsize=11,
    )
    figure.savefig(path)


def _draw_meetings(axes: Any, score: TopologyScore, verdict: str, labels: Labels) -> None:
    """Mark seen and missed meetpoints at their places in the atlas; a line leads to where each was seen."""
    meetings = score.of_kind(verdict)
    if not meetings:
        return
    places = np.array(
        [
            score.known.position_m[each.visit.node] if each.visit is not None else score.seen[each.seen].position_m  # type: ignore[index]
            for each in meetings
        ]
    )
    axes.plot(
        *places.T,
        _MARKS[verdict],
        color=COLOURS[verdict],
        markersize=_SIZES[verdict],
        markeredgecolor="white",
        markeredgewidth=0.5,
        linestyle="none",
        zorder=4 + (verdict != SEEN),
        label=f"{len(meetings)} {verdict}",
    )
    for place, each in zip(places, meetings):
        if each.visit is None or each.seen is None:
            continue
        seen = score.seen[each.seen]
        axes.plot(
            [place[0], seen.position_m[0]],
            [place[1], seen.position_m[1]],
            color=COLOURS[verdict],
            linewidth=1.0,
            zorder=4,
        )
        degree = int(score.known.degree[each.visit.node])
        if seen.degree != degree:
            labels.add(place, f"{seen.degree} of {degree}", fontsize=6, color="#333333", zorder=6)
