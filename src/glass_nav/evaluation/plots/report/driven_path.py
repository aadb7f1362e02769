"""The path over the map, coloured by state."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.metrics.run_story import SEARCHING
from glass_nav.evaluation.plots.canvas import Picture, frame, legend_below, new_figure, save
from glass_nav.evaluation.plots.labels import Labels
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.evaluation.plots.report import states
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.vocabulary import TRUTH_COLOUR, state_colour, state_mark, states_in_order

MARGIN_M = 3.0
MARKED = 40  # scans of a path have the mark of their state
_JUMP_M = 2.0  # poses farther apart are not joined by a line: the robot did not drive there


def draw(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    low, high = bounds(result)
    width, height = high - low
    figure = new_figure(8.0, float(np.clip(8.0 * height / width + 0.4, 3.0, 5.4)))
    axes = figure.subplots()
    draw_map(axes, ground.grid, low, high)
    errors = result.errors
    if errors.matched.any():
        assert result.reference is not None
        true = result.reference.at(result.stamps_ns)[errors.matched]
        axes.plot(
            true[:, 0],
            true[:, 1],
            color=TRUTH_COLOUR,
            linewidth=0.8,
            linestyle=(0, (2, 1)),
            label="ground truth",
            zorder=3,
        )
    _draw_states(axes, result)
    frame(axes, low, high)
    labels = Labels(axes)
    for number, kept in enumerate(result.worst, 1):  # of scans at one place only the worst is numbered
        spot = result.map_from_base[kept.row, :2]
        if np.all(np.isfinite(spot)) and np.all(spot >= low) and np.all(spot <= high):
            labels.add(
                spot,
                str(number),
                fontsize=7,
                centred=True,
                zorder=6,
                color="white",
                bbox={"boxstyle": "circle,pad=0.25", "facecolor": "#333333", "edgecolor": "white"},
            )
    axes.plot(
        *result.map_from_base[-1, :2],
        "s",
        color=TRUTH_COLOUR,
        markersize=7,
        markeredgecolor="white",
        label="last scan",
        zorder=7,
    )
    legend_below(axes, 6)
    shares = states.shares(result)
    return save(
        folder,
        figure,
        "way",
        "Where it drove",
        f"The robot's path over the map, coloured by the state that the filter reported: {shares}.",
        "Coloured: the reported poses, by the reported state. "
        + ("Dashed: the ground truth. " if errors.matched.any() else "")
        + "Numbers: the worst scans, pictured below.",
    )


def _draw_states(axes: Any, result: ReplayResult) -> None:
    from matplotlib.collections import LineCollection

    way, reported = result.map_from_base[:, :2], np.array(result.states)
    apart = np.hypot(*(way[1:] - way[:-1]).T) if len(way) > 1 else np.zeros(0)
    drove = np.hypot(*np.diff(result.odom_from_base[:, :2], axis=0).T) if len(way) > 1 else np.zeros(0)
    with np.errstate(invalid="ignore"):  # a pose that is NaN is joined to none
        joined = apart <= drove + _JUMP_M
    for state in states_in_order(result.states):
        colour, mark = state_colour(state), state_mark(state)
        here = reported == state
        if state in SEARCHING:  # the best candidate jumps about: dots
            axes.scatter(*way[here].T, s=8, color=colour, marker=mark, alpha=0.5, linewidths=0, zorder=4)
            axes.plot([], [], mark, color=colour, markersize=5, label=state)
            continue
        segments = joined & here[1:]
        lines = np.stack([way[:-1][segments], way[1:][segments]], axis=1)
        axes.add_collection(LineCollection(lines, colors=colour, linewidths=2.2, zorder=5, capstyle="round"))
        axes.scatter(*way[here].T, s=3, color=colour, linewidths=0, zorder=5)
        if mark:
            marked = np.nonzero(here)[0][:: max(1, len(way) // MARKED)]
            axes.scatter(
                *way[marked].T, s=30, color=colour, marker=mark, edgecolors="#333333", linewidths=0.5, zorder=5.5
            )
        axes.plot(
            [], [], color=colour, marker=mark or None, markeredgecolor="#333333", markersize=6, linewidth=3, label=state
        )


def bounds(result: ReplayResult) -> "Tuple[np.ndarray, np.ndarray]":
    """Lower left and upper right corner (2,) [m] of the path, without mere candidates."""
    trusted = ~np.isin(result.states, SEARCHING)
    errors = result.errors
    points = [result.map_from_base[trusted if trusted.any() else slice(None), :2]]
    if errors.matched.any():
        assert result.reference is not None
        points.append(result.reference.at(result.stamps_ns)[errors.matched, :2])
    return bounds_of(np.concatenate(points))


def bounds_of(points: np.ndarray) -> "Tuple[np.ndarray, np.ndarray]":
    """Lower left and upper right corner (2,) [m] of what shows points (N, 2) with some space around them."""
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        points = np.zeros((1, 2))
    low, high = points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M
    width, height = high - low
    size = np.array([max(width, 1.6 * height), max(height, width / 3.0)])  # fits the first screen of a report
    centre = (low + high) / 2.0
    return centre - size / 2.0, centre + size / 2.0
