"""Pictures of a run, by matplotlib without a display."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics.pose_errors import LOST_M
from glass_nav.evaluation.metrics.replay_result import BeamExample, ReplayResult
from glass_nav.geometry import se2

MARGIN_M = 3.0  # of map around the way of the robot
SCALE_FLOOR_M = 0.2  # errors below it shall not look like large ones
UNKNOWN_GREY, FREE_WHITE, WALL_BLACK = 0.88, 1.0, 0.15
REFERENCE_COLOUR, ESTIMATE_COLOUR, YAW_COLOUR = "#1f77b4", "#d62728", "#8a8a8a"
ERROR_COLOURS = ("#1b3a8a", "#8a2d9c", "#e0264f", "#ff8c00")  # small to large, all dark enough on white
RIBBON = 0.08  # share of the error axis below 0, for the states
STATE_COLOURS = {
    "LOCALIZED": "#2ca02c",
    "UNCERTAIN": "#ffbf00",
    "LOST": "#d62728",
    "GLOBAL_SEARCH": "#9467bd",
    "UNKNOWN": "#7f7f7f",
}

CASE_NAMES = ("0 uncertain", "1 diffuse", "2 specular", "3 behind one pane", "4 behind two panes")
CASE_COLOURS = ("#969696", "#009e73", "#cc79a7", "#56b4e9", "#0072b2")  # as in rviz: Okabe and Ito's


@dataclass(frozen=True)
class MapImage:
    """An occupancy grid as GridMap has it; row 0 at the bottom."""

    occupancy: np.ndarray  # (H, W) int8: 0..100 percent, -1 unknown
    resolution_m: float
    map_from_grid: np.ndarray  # (3,) pose of the outer corner of cell [0, 0]


def draw_trajectory(path: Path, grid: MapImage, result: ReplayResult, title: str) -> None:
    """Above: map, reference and estimate, coloured by its error. Below: errors and states over time.

    Without a reference the estimate has one colour and the curve shows what the filter claims.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    low, high = _bounds(result)
    width, height = high - low
    map_height = float(np.clip(10.0 * height / width, 3.0, 9.0))
    figure = Figure(figsize=(11.0, map_height + 3.4), dpi=110, constrained_layout=True)
    FigureCanvasAgg(figure)
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


def draw_cases(path: Path, grid: MapImage, result: ReplayResult, title: str) -> None:
    """Left: what beams of each true case were told to be. Right: the beams of a few scans, true above, told below.

    Needs result.case_scores.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    assert result.case_scores is not None
    figures = result.case_scores.metrics()
    columns = len(result.examples)
    figure = Figure(figsize=(5.5 + 4.2 * columns, 8.4 if columns else 6.0), dpi=100, constrained_layout=True)
    FigureCanvasAgg(figure)
    parts = figure.add_gridspec(2, columns + 1, width_ratios=[5.5] + [4.2] * columns)
    draw_confusion(figure.add_subplot(parts[:, 0]), result.case_scores.confusion)
    for column, example in enumerate(result.examples, 1):
        for row, (name, case) in enumerate((("true", example.true_case), ("told", example.told_case))):
            axes = figure.add_subplot(parts[row, column])
            _draw_beams(axes, grid, example, case)
            seconds = (example.stamp_ns - result.stamps_ns[0]) * 1e-9
            axes.set_title(f"{name}, {seconds:.1f} s", fontsize=10)
    accuracy, f1 = (
        f"{value:.3f}" if value is not None else "-" for value in (figures["accuracy"], figures["macro_f1"])
    )
    figure.suptitle(f"{title}\n{figures['beams']} beams, accuracy {accuracy}, macro F1 {f1}", fontsize=11)
    figure.savefig(path)


def draw_confusion(axes: Any, confusion: np.ndarray) -> None:
    share = confusion / np.maximum(confusion.sum(axis=1, keepdims=True), 1)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0)
    for true, row in enumerate(confusion):
        for told, count in enumerate(row):
            axes.text(
                told,
                true,
                f"{100 * share[true, told]:.1f} %\n{count}" if row.any() else "-",
                ha="center",
                va="center",
                fontsize=8,
                color="white" if share[true, told] > 0.6 else "black",
            )
    axes.set_xticks(range(len(CASE_NAMES)))
    axes.set_xticklabels(CASE_NAMES, rotation=30, ha="right", fontsize=8)
    axes.set_yticks(range(len(CASE_NAMES)))
    axes.set_yticklabels(CASE_NAMES, fontsize=8)
    axes.set_xlabel("told")
    axes.set_ylabel("true")


def _draw_beams(axes: Any, grid: MapImage, example: BeamExample, case: np.ndarray) -> None:
    from matplotlib.collections import LineCollection

    answered = np.isfinite(example.points_m).all(axis=1)
    shown = np.concatenate([example.points_m[answered], example.laser_m[None]])
    low, high = shown.min(axis=0) - 1.0, shown.max(axis=0) + 1.0
    draw_map(axes, grid, low, high)
    ends = example.points_m[answered]
    rays = np.stack([np.broadcast_to(example.laser_m, ends.shape), ends], axis=1)
    colours = np.array(CASE_COLOURS)[case[answered]]
    axes.add_collection(LineCollection(rays, colors=colours, linewidths=0.4, alpha=0.5))
    axes.scatter(ends[:, 0], ends[:, 1], c=colours, s=5, zorder=3)
    axes.plot(*example.laser_m, "o", color="#111111", markersize=4)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7)


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


def draw_map(axes: Any, grid: MapImage, low: np.ndarray, high: np.ndarray) -> None:
    """The part of a map between two corners (2,) [m], behind everything else."""
    from matplotlib.transforms import Affine2D

    corners = np.array([[x, y] for x in (low[0], high[0]) for y in (low[1], high[1])])
    cells = se2.transform_points(se2.inverse(grid.map_from_grid), corners) / grid.resolution_m
    rows, columns = grid.occupancy.shape
    left, bottom = np.maximum(np.floor(cells.min(axis=0)), 0).astype(int)
    right, top = np.minimum(np.ceil(cells.max(axis=0)), [columns, rows]).astype(int)
    axes.set_facecolor(str(UNKNOWN_GREY))
    if right <= left or top <= bottom:  # the robot never came near the map
        return
    part = grid.occupancy[bottom:top, left:right].astype(float)
    grey = np.where(part < 0, UNKNOWN_GREY, FREE_WHITE - (FREE_WHITE - WALL_BLACK) * part / 100.0)
    x, y, yaw = grid.map_from_grid
    place = Affine2D().rotate(yaw).translate(x, y) + axes.transData
    extent = np.array([left, right, bottom, top]) * grid.resolution_m
    axes.imshow(
        grey,
        cmap="gray",
        vmin=0.0,
        vmax=1.0,
        origin="lower",
        interpolation="nearest",
        extent=extent.tolist(),
        transform=place,
    )


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
    axes.plot(*way[0], "o", color="#2ca02c", markersize=8, markeredgecolor="white", label="first scan", zorder=5)
    axes.plot(*way[-1], "s", color="#111111", markersize=7, markeredgecolor="white", label="last scan", zorder=5)
    axes.legend(loc="best", fontsize=9, framealpha=0.9)


def draw_errors(axes: Any, result: ReplayResult) -> None:
    from matplotlib.patches import Patch

    seconds = (result.stamps_ns - result.stamps_ns[0]) * 1e-9
    errors = result.errors
    position: Optional[np.ndarray] = None
    if errors.matched.any():
        position, yaw, what = errors.position_m, np.degrees(errors.yaw_rad), "error"
    else:
        position = np.hypot(result.deviation[:, 0], result.deviation[:, 1])
        yaw, what = np.degrees(result.deviation[:, 2]), "claimed deviation"
    finite = position[np.isfinite(position)]
    top = 1.1 * max(SCALE_FLOOR_M, float(finite.max()) if len(finite) else SCALE_FLOOR_M)
    turned = axes.twinx()
    turned.plot(seconds, yaw, color=YAW_COLOUR, linewidth=0.8)
    finite = yaw[np.isfinite(yaw)]
    top_yaw = 1.3 * max(2.0, float(finite.max()) if len(finite) else 2.0)
    turned.set_ylim(-RIBBON * top_yaw, top_yaw)
    turned.set_ylabel(f"yaw {what} [deg]", color=YAW_COLOUR)
    turned.tick_params(axis="y", colors=YAW_COLOUR)
    axes.set_zorder(turned.get_zorder() + 1)  # the position is the main thing: in front
    axes.patch.set_visible(False)
    axes.plot(seconds, position, color=ESTIMATE_COLOUR, linewidth=1.2)
    if top > LOST_M:
        axes.axhline(LOST_M, color=ESTIMATE_COLOUR, linewidth=0.8, linestyle="--")
        axes.annotate(
            f"lost: {LOST_M} m",
            (seconds[0], LOST_M),
            textcoords="offset points",
            xytext=(3, 3),
            fontsize=8,
            color=ESTIMATE_COLOUR,
        )
    axes.set_xlim(seconds[0], max(seconds[-1], seconds[0] + 1e-3))
    axes.set_ylim(-RIBBON * top, top)
    axes.set_xlabel("time since the first scan [s]")
    axes.set_ylabel(f"position {what} [m]", color=ESTIMATE_COLOUR)
    axes.tick_params(axis="y", colors=ESTIMATE_COLOUR)
    axes.grid(True, axis="y", linewidth=0.4, alpha=0.6)
    present = sorted(
        set(result.states),
        key=lambda state: list(STATE_COLOURS).index(state) if state in STATE_COLOURS else len(STATE_COLOURS),
    )
    states = np.array(result.states)
    for state in present:  # a ribbon along the time axis; each scan's state holds until the next scan
        holds = states == state
        holds[1:] |= states[:-1] == state
        axes.fill_between(
            seconds,
            -RIBBON * top,
            -0.25 * RIBBON * top,
            where=holds,
            step="post",
            color=STATE_COLOURS.get(state, "#000000"),
            linewidth=0,
        )
    axes.legend(
        handles=[Patch(color=STATE_COLOURS.get(state, "#000000"), label=state) for state in present],
        loc="upper right",
        fontsize=8,
        ncol=len(present),
        framealpha=0.9,
    )


def _figures(result: ReplayResult) -> str:
    """The line under the title."""
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
