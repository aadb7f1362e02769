"""Picture of one scan at a rough pose and at the corrected one, by matplotlib without a display."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from glass_nav.evaluation.plots import beam_layer
from glass_nav.evaluation.plots.canvas import frame, new_figure
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.geometry import se2
from glass_nav.vocabulary import LEFT_OUT_RGB, SERIES_COLOURS, hex_colour
from glass_nav.world.grid_map import GridMap

MARGIN_M = 1.0
ARROW_SHARE = 0.05  # of the picture's width
SEGMENT_COLOUR, ROBOT_COLOUR = SERIES_COLOURS[1], hex_colour(LEFT_OUT_RGB)


@dataclass(frozen=True)
class LocatedScan:
    """The contents of the picture; B beams, S segments."""

    points_m: np.ndarray  # (B, 2) end points in the robot's frame, NaN: no answer
    case: np.ndarray  # (B,) 0..4
    segments_m: np.ndarray  # (S, 4) of the map
    rough: np.ndarray  # (3,) pose in map
    corrected: np.ndarray  # (3,)


def draw(path: Path, grid: GridMap, scan: LocatedScan, title: str, before: str, after: str) -> None:
    """Beside each other: the scan where it was said to be, and where it belongs, each with a line about it."""
    from matplotlib.lines import Line2D

    shown = np.concatenate(
        [_ends(scan, pose) for pose in (scan.rough, scan.corrected)] + [scan.rough[None, :2], scan.corrected[None, :2]]
    )
    low, high = shown.min(axis=0) - MARGIN_M, shown.max(axis=0) + MARGIN_M
    height = float(np.clip(5.2 * (high[1] - low[1]) / (high[0] - low[0]), 2.6, 8.0))
    figure = new_figure(11.0, height + 0.9, dpi=85)
    figure.suptitle(title, fontsize=11)
    for axes, pose, text in zip(figure.subplots(1, 2), (scan.rough, scan.corrected), (before, after)):
        _draw_scan(axes, grid, scan, pose, low, high)
        axes.set_title(text, fontsize=9)
    handles = beam_layer.handles(scan.case[_answered(scan)]) + [Line2D([], [], color=SEGMENT_COLOUR, label="segments")]
    figure.axes[1].legend(handles=handles, loc="best", fontsize=7, framealpha=0.9)
    figure.savefig(path)


def _answered(scan: LocatedScan) -> np.ndarray:
    return np.isfinite(scan.points_m).all(axis=1)


def _ends(scan: LocatedScan, pose: np.ndarray) -> np.ndarray:
    return se2.transform_points(pose, scan.points_m[_answered(scan)])


def _draw_scan(
    axes: Any, grid: GridMap, scan: LocatedScan, pose: np.ndarray, low: np.ndarray, high: np.ndarray
) -> None:
    from matplotlib.collections import LineCollection

    draw_map(axes, grid, low, high)
    axes.add_collection(LineCollection(scan.segments_m.reshape(-1, 2, 2), colors=SEGMENT_COLOUR, linewidths=1.2))
    beam_layer.draw_beams(axes, pose[:2], _ends(scan, pose), scan.case[_answered(scan)], rays=False)
    ahead = ARROW_SHARE * (high[0] - low[0]) * np.array([np.cos(pose[2]), np.sin(pose[2])])
    axes.annotate(
        "",
        xy=pose[:2] + ahead,
        xytext=pose[:2],
        zorder=4,
        arrowprops={"arrowstyle": "-|>", "color": ROBOT_COLOUR, "linewidth": 2.0, "shrinkA": 0.0},
    )
    axes.plot(*pose[:2], "o", color=ROBOT_COLOUR, markersize=5, zorder=4)
    frame(axes, low, high)
