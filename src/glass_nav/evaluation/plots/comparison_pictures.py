"""The pictures of a comparison: figures with their intervals, and errors and paths of each log."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional

import numpy as np

from glass_nav.evaluation.metrics import comparison
from glass_nav.evaluation.metrics.comparison import Comparison, Figure, Run
from glass_nav.evaluation.plots.canvas import Picture, frame, legend_below, new_figure, save
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.evaluation.plots.report.driven_path import bounds_of
from glass_nav.vocabulary import SERIES_COLOURS, SERIES_LINES, SERIES_MARKS, TRUTH_COLOUR
from glass_nav.world.grid_map import GridMap

MAX_LOGS = 6  # have pictures of their own; a sweep over hundreds has its figures
_COLUMNS = 3  # of the panels
_MIN_M = 1e-3  # errors below are drawn there, on a logarithmic axis
_WIDE = 20.0  # times between the least and the largest value: then on a logarithmic axis
_SPREAD = 0.22  # of the dots of one contestant, in rows


def draw_all(folder: Path, compared: Comparison, grids: Mapping[str, GridMap]) -> List[Picture]:
    """The figures of all logs first, then each of the first MAX_LOGS logs; paths where its map exists."""
    found = [_figures(folder, compared)]
    for number, log in enumerate(compared.logs[:MAX_LOGS], 1):
        errors = _errors(folder, compared, log, number)
        if errors is not None:
            found.append(errors)
        if log in grids:
            found.append(_ways(folder, compared, log, number, grids[log]))
    return found


def colour(compared: Comparison, contestant: str) -> str:
    return SERIES_COLOURS[compared.contestants.index(contestant) % len(SERIES_COLOURS)]


def line(compared: Comparison, contestant: str) -> Any:
    """The line style, for matplotlib."""
    return SERIES_LINES[compared.contestants.index(contestant) % len(SERIES_LINES)]


def mark(compared: Comparison, contestant: str) -> str:
    """The marker, for matplotlib."""
    return SERIES_MARKS[compared.contestants.index(contestant) % len(SERIES_MARKS)]


def _figures(folder: Path, compared: Comparison) -> Picture:
    shown = compared.figures
    rows = -(-len(shown) // _COLUMNS)
    figure = new_figure(11.0, rows * (1.05 + 0.33 * len(compared.contestants)))
    panels = np.atleast_1d(figure.subplots(rows, min(_COLUMNS, len(shown)), squeeze=False).ravel())
    for axes in panels[len(shown) :]:
        axes.set_visible(False)
    for index, (axes, each) in enumerate(zip(panels, shown)):
        _panel(axes, compared, each, named=index % _COLUMNS == 0)
    words = "; ".join(
        f"{name} {comparison.text(shown[0], compared.interval(name, shown[0]))} {shown[0].unit}"
        for name in compared.contestants
    )
    return save(
        folder,
        figure,
        "compare",
        "Figures with their 95 % intervals",
        f"Each figure by contestant. {shown[0].title}: {words}.",
        "Dots: the runs. Square and bar: the mean over seeds, all logs with the same weight, and its 95 % interval.",
    )


def _panel(axes: Any, compared: Comparison, each: Figure, named: bool) -> None:
    count = len(compared.contestants)
    for row, name in enumerate(compared.contestants):
        values = np.concatenate([compared.values(name, each, log) for log in compared.logs]) * each.scale
        values = values[np.isfinite(values)]
        if len(values):
            offsets = np.linspace(-_SPREAD, _SPREAD, len(values)) if len(values) > 1 else np.zeros(1)
            axes.plot(
                values, row + offsets, "o", color=colour(compared, name), alpha=0.35, markersize=4, markeredgewidth=0
            )
        interval = compared.interval(name, each)
        if interval is None or not math.isfinite(interval.mean):
            word = "infinite" if interval is not None else "is the first" if each.better == 0 else "not known"
            axes.annotate(word, (0.02, row), xycoords=("axes fraction", "data"), va="center", fontsize=8)
            continue
        axes.errorbar(
            each.scale * interval.mean,
            row,
            xerr=each.scale * (interval.half_width or 0.0),
            fmt=mark(compared, name),
            color=colour(compared, name),
            capsize=4,
            markersize=6,
            linewidth=2,
        )
    shown = np.concatenate([compared.values(name, each, log) for name in compared.contestants for log in compared.logs])
    shown = shown[np.isfinite(shown)] * each.scale
    if each.unit in ("m", "deg") and len(shown) and shown.max() > _WIDE * max(shown.min(), _MIN_M):
        axes.set_xscale("symlog", linthresh=_MIN_M, linscale=0.3)  # from zero on, as poses of the truth have it
        axes.set_xlim(left=0.0)
    else:
        axes.locator_params(axis="x", nbins=5)
    axes.set_ylim(count - 0.5, -0.5)
    axes.set_yticks(range(count))
    axes.set_yticklabels(compared.contestants if named else [""] * count, fontsize=9)
    axes.set_title(f"{each.title} [{each.unit}]", fontsize=9)
    axes.tick_params(axis="x", labelsize=8)
    axes.grid(axis="x", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)


def _errors(folder: Path, compared: Comparison, log: str, number: int) -> Optional[Picture]:
    runs = [run for run in compared.runs if run.log == log and run.errors.matched.any()]
    if not runs:
        return None
    first_ns = min(int(run.stamps_ns[0]) for run in runs)
    figure = new_figure(11.0, 3.4)
    axes = figure.subplots()
    for name in compared.contestants:
        of_name = [run for run in runs if run.contestant == name]
        if not of_name:
            continue
        stamps_ns, errors = _by_scan(of_name)
        seconds = (stamps_ns - first_ns) * 1e-9
        low, middle, high = (
            np.maximum(values, _MIN_M) for values in (errors.min(axis=0), np.median(errors, axis=0), errors.max(axis=0))
        )
        axes.fill_between(seconds, low, high, color=colour(compared, name), alpha=0.2, linewidth=0)
        axes.plot(
            seconds, middle, color=colour(compared, name), linestyle=line(compared, name), linewidth=1.1, label=name
        )
    axes.set_yscale("log")
    axes.set_ylabel("position error [m]")
    axes.set_xlabel("time since the first scan [s]")
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.18), ncol=6, fontsize=9, frameon=False)
    return save(
        folder,
        figure,
        f"errors_{number:02d}",
        f"Errors over time: {log}",
        f"Position error of each contestant over the time of {log}.",
        "Line: the median over seeds. Band: from the best to the worst seed.",
    )


def _by_scan(runs: List[Run]) -> "tuple[np.ndarray, np.ndarray]":
    """Stamps (S,) at which every run has an error, and these errors (R, S) [m]."""
    known = [np.unique(run.stamps_ns[run.errors.matched], return_index=True) for run in runs]
    stamps_ns = known[0][0]
    for other, _ in known[1:]:
        stamps_ns = np.intersect1d(stamps_ns, other)
    errors = [
        run.errors.position_m[run.errors.matched][first[np.searchsorted(unique, stamps_ns)]]
        for run, (unique, first) in zip(runs, known)
    ]
    return stamps_ns, np.array(errors).reshape(len(runs), -1)


def _ways(folder: Path, compared: Comparison, log: str, number: int, grid: GridMap) -> Picture:
    runs: Dict[str, Run] = {}
    for run in compared.runs:
        if run.log == log:
            runs.setdefault(run.contestant, run)  # the lowest seed
    low, high = bounds_of(np.concatenate([run.map_from_base[:, :2] for run in runs.values()]))
    figure = new_figure(11.0, float(np.clip(11.0 * (high - low)[1] / (high - low)[0] + 0.5, 3.5, 8.0)))
    axes = figure.subplots()
    draw_map(axes, grid, low, high)
    referenced = next((run for run in runs.values() if run.reference is not None and run.errors.matched.any()), None)
    if referenced is not None and referenced.reference is not None:
        true = referenced.reference.at(referenced.stamps_ns[referenced.errors.matched])
        axes.plot(
            true[:, 0],
            true[:, 1],
            color=TRUTH_COLOUR,
            linewidth=0.9,
            linestyle=(0, (2, 1)),
            zorder=3,
            label="ground truth",
        )
    for width, (name, run) in zip(np.linspace(3.0, 1.0, len(runs)), runs.items()):
        axes.plot(
            *run.map_from_base[:, :2].T,
            color=colour(compared, name),
            linestyle=line(compared, name),
            linewidth=width,
            alpha=0.85,
            zorder=4,
            label=name if run.seed is None else f"{name}, seed {run.seed}",
        )
    frame(axes, low, high)
    legend_below(axes, 5)
    return save(
        folder,
        figure,
        f"ways_{number:02d}",
        f"Ways: {log}",
        f"The path over the map of {log} by each contestant.",
        "One run of each, that of the lowest seed.",
    )
