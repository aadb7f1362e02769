"""The pictures of a replay: trajectory.png and cases.png."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Tuple

import numpy as np

from glass_nav.evaluation.metrics.replay_result import BeamExample, ReplayResult
from glass_nav.evaluation.plots import beam_layer
from glass_nav.evaluation.plots.canvas import frame, new_figure
from glass_nav.evaluation.plots.confusion_matrix import draw_confusion
from glass_nav.evaluation.plots.error_curve import ESTIMATE_COLOUR, SCALE_FLOOR_M, draw_errors
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.vocabulary import SERIES_COLOURS, USED_RGB, BeamCase, hex_colour
from glass_nav.world.grid_map import GridMap

MARGIN_M = 3.0  # of map around the path
REFERENCE_COLOUR = SERIES_COLOURS[5]
ERROR_COLOURS = ("#1b3a8a", "#8a2d9c", "#e0264f", "#ff8c00")  # small to large, all dark enough on white


def draw_trajectory(path: Path, grid: GridMap, result: ReplayResult, title: str) -> None:
    """Above: map, reference and estimate, coloured by its error. Below: errors and states over time.

    Without a reference the estimate has one colour and the curve shows the reported deviation.
    """
    low, high = _bounds(result)
    width, height = high - low
    map_height = float(np.clip(10.0 * height / width, 3.0, 9.0))
    figure = new_figure(11.0, map_height + 3.4)
    above, below = figure.subplots(2, 1, gridspec_kw={"height_ratios": [map_height, 2.4]})
    draw_map(above, grid, low, high)
    _draw_ways(figure, above, result)
    above.set_xlim(low[0], high[0])
    above.set_ylim(low[1], high[1])
    above.set_aspect("equal")
    above.set_xlabel("x [m]")
    above.set_ylabel("y [m]")
    above.set_title(f"{title}\n{_figures(result)}", fontsize=11)
    draw_errors(below, result)
    figure.savefig(path)


def draw_cases(path: Path, grid: GridMap, result: ReplayResult, title: str) -> None:
    """Left: reported case of the beams of each true case. Right: the beams of a few scans, true above, reported below.

    Needs result.case_scores.
    """
    assert result.case_scores is not None
    figures = result.case_scores.metrics()
    columns = len(result.examples)
    figure = new_figure(5.5 + 4.2 * columns, 9.0 if columns else 6.0, dpi=100)
    parts = figure.add_gridspec(2, columns + 1, width_ratios=[5.5] + [4.2] * columns)
    draw_confusion(figure.add_subplot(parts[:, 0]), result.case_scores.confusion)
    half_m = max((_square(example)[1] for example in result.examples), default=0.0)  # one scale for all
    for column, example in enumerate(result.examples, 1):
        for row, (name, case) in enumerate((("true", example.true_case), ("reported", example.told_case))):
            axes = figure.add_subplot(parts[row, column])
            _draw_beams(axes, grid, example, case, half_m)
            seconds = (example.stamp_ns - result.stamps_ns[0]) * 1e-9
            axes.set_title(f"{name}, {seconds:.1f} s", fontsize=10)
    accuracy, f1 = (
        f"{value:.3f}" if value is not None else "-" for value in (figures["accuracy"], figures["macro_f1"])
    )
    if columns:
        drawn = np.concatenate([part for each in result.examples for part in (each.true_case, each.told_case)])
        figure.axes[0].legend(
            handles=beam_layer.handles(drawn[drawn < len(BeamCase)]),
            title="beams on the right",
            loc="upper center",
            bbox_to_anchor=(0.5, 0.0),
            borderaxespad=9.0,
            fontsize=9,
            frameon=False,
        )
    figure.suptitle(f"{title}\n{figures['beams']} beams, accuracy {accuracy}, macro F1 {f1}", fontsize=11)
    figure.savefig(path)


def _square(example: BeamExample) -> Tuple[np.ndarray, float]:
    """Centre (2,) and half the side [m] of the square that holds the beams of a scan."""
    ends = example.points_m[np.isfinite(example.points_m).all(axis=1)]
    shown = np.concatenate([ends, example.laser_m[None]])
    low, high = shown.min(axis=0) - 1.0, shown.max(axis=0) + 1.0
    return (low + high) / 2.0, float((high - low).max()) / 2.0


def _draw_beams(axes: Any, grid: GridMap, example: BeamExample, case: np.ndarray, half_m: float) -> None:
    """The beams of one scan in a square of `half_m` to each side."""
    answered = np.isfinite(example.points_m).all(axis=1)
    centre, _ = _square(example)
    low, high = centre - half_m, centre + half_m
    draw_map(axes, grid, low, high)
    beam_layer.draw_beams(axes, example.laser_m, example.points_m[answered], case[answered])
    axes.plot(*example.laser_m, "o", color="#111111", markersize=4)
    frame(axes, low, high)


def _bounds(result: ReplayResult) -> Tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner (2,) [m] of what is shown."""
    points = result.map_from_base[:, :2]
    if result.reference is not None and result.errors.matched.any():
        points = np.concatenate([points, result.reference.at(result.stamps_ns)[result.errors.matched, :2]])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        points = np.zeros((1, 2))
    low, high = points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M
    # A corridor is not to become a ribbon, nor a tower that leaves the page empty beside it.
    width, height = high - low
    size = np.array([max(width, 1.15 * height), max(height, width / 3.0)])
    centre = (low + high) / 2.0
    return centre - size / 2.0, centre + size / 2.0


def _draw_ways(figure: Any, axes: Any, result: ReplayResult) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    errors = result.errors
    way = result.map_from_base[:, :2]
    matched = errors.matched
    if matched.any() and result.reference is not None:
        true = result.reference.at(result.stamps_ns[matched])
        axes.plot(true[:, 0], true[:, 1], color=REFERENCE_COLOUR, linewidth=3.5, alpha=0.35, label="reference")
        axes.plot([], [], color=ERROR_COLOURS[0], linewidth=1.4, label="estimate")
        finite = errors.position_m[np.isfinite(errors.position_m)]
        largest = max(SCALE_FLOOR_M, float(np.percentile(finite, 99)) if len(finite) else SCALE_FLOOR_M)
        segments = np.stack([way[:-1], way[1:]], axis=1)
        worse = np.fmax(errors.position_m[:-1], errors.position_m[1:])
        colours = LinearSegmentedColormap.from_list("error", ERROR_COLOURS)
        lines = LineCollection(segments, cmap=colours, norm=Normalize(0.0, largest), linewidths=1.4)
        lines.set_array(np.ma.masked_invalid(worse))
        axes.add_collection(lines)
        bar = figure.colorbar(lines, ax=axes, pad=0.01, fraction=0.03, extend="max")
        bar.set_label("position error of the estimate [m]")
    else:
        axes.plot(way[:, 0], way[:, 1], color=ESTIMATE_COLOUR, linewidth=1.4, label="estimate")
    axes.plot(
        *way[0], "o", color=hex_colour(USED_RGB), markersize=8, markeredgecolor="white", label="first scan", zorder=5
    )
    axes.plot(*way[-1], "s", color="#111111", markersize=7, markeredgecolor="white", label="last scan", zorder=5)
    axes.legend(loc="best", fontsize=9, framealpha=0.9)


def _figures(result: ReplayResult) -> str:
    """Text of the line below the title."""
    figures = result.metrics()
    if not result.errors.matched.any():
        return f"{figures['scans']} scans, no ground truth"
    names = ("median", "rmse", "p95", "max")
    values = [figures[f"position_{name}_m"] for name in names]
    shown = ", ".join(
        f"{name} {'infinite' if value is None else f'{value:.3f} m'}" for name, value in zip(names, values)
    )
    return (
        f"{figures['scans']} scans; position error {shown}; yaw {figures['yaw_mean_deg']:.2f} deg; "
        f"{100 * figures['lost_share']:.1f} % lost"
    )
