"""The pictures of a report, each a PNG file with a text for those who cannot see it.

S scans, B beams. Drawn by matplotlib without a display; light background, as they are printed.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.evaluation.metrics import run_story
from glass_nav.evaluation.metrics.replay_result import CASES, KeptScan, ReplayResult
from glass_nav.evaluation.metrics.run_story import SEARCHING, metres
from glass_nav.evaluation.plots.run_pictures import (
    CASE_COLOURS,
    CASE_NAMES,
    STATE_COLOURS,
    MapImage,
    draw_confusion,
    draw_errors,
    draw_map,
)
from glass_nav.geometry import se2

DPI = 110
TRUTH_COLOUR = "#111111"
SOLID_BELOW, GLASS_FROM = 25, 75  # [percent] as in rviz
WALL_NAMES = ("solid", "undecided", "glass")
WALL_COLOURS = ("#8c5f3c", "#e6c700", "#00b3b3")
MARGIN_M = 3.0
_COLUMNS = 400  # of the ribbon of cases; more than that is thinner than a line
_JUMP_M = 2.0  # farther apart, two poses are not joined by a line: nobody drove there
_MIN_M = 1e-3  # errors below are drawn there, on a logarithmic axis


@dataclass(frozen=True)
class Picture:
    """One picture of a report."""

    path: Path
    title: str
    alt: str  # what it shows, in words
    caption: str  # how to read it


@dataclass(frozen=True)
class Ground:
    """What is drawn below a run."""

    grid: MapImage
    glass: Optional[np.ndarray]  # (H, W) int8 [percent] how glassy each wall proved, -1 unknown; None: not learnt


def draw_all(
    folder: Path,
    result: ReplayResult,
    ground: Ground,
    confusion: Optional[np.ndarray],
    drawn: Callable[[], None] = lambda: None,
) -> "Tuple[List[Picture], List[Picture]]":
    """All pictures that the run has something for, and those of its worst scans, the worst first.

    Args:
        folder: for the PNG files.
        result: the run, at least one scan.
        ground: the map.
        confusion: (5, 5) beams of each true case (rows) told to be of each case, None without the truth.
        drawn: called after each picture.
    """
    pictures = []
    for draw in (_way, _case_ribbon, _walls, _errors, _reliability, _candidates, _update_time):
        picture = draw(folder, result, ground)
        if picture is not None:
            pictures.append(picture)
        drawn()
    if confusion is not None:
        pictures.append(_confusion(folder, confusion))
        drawn()
    worst = []
    for number, kept in enumerate(result.worst, 1):
        worst.append(_worst(folder, result, ground, number, kept))
        drawn()
    return pictures, worst


def _way(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
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
    for number, kept in reversed(list(enumerate(result.worst, 1))):
        spot = result.map_from_base[kept.row, :2]
        if np.all(np.isfinite(spot)) and np.all(spot >= low) and np.all(spot <= high):
            axes.annotate(
                str(number),
                spot,
                fontsize=7,
                ha="center",
                va="center",
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
    frame(axes, low, high)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.03), ncol=6, fontsize=9, frameon=False)
    shares = _state_shares(result)
    return save(
        folder,
        figure,
        "way",
        "Where it drove",
        f"The robot's way over the map, coloured by the state that the filter told: {shares}.",
        "Coloured: where the filter said the robot was, by what it said of itself. "
        + ("Dashed: the ground truth. " if errors.matched.any() else "")
        + "Numbers: the worst scans, pictured below.",
    )


def _draw_states(axes: Any, result: ReplayResult) -> None:
    from matplotlib.collections import LineCollection

    way, states = result.map_from_base[:, :2], np.array(result.states)
    apart = np.hypot(*(way[1:] - way[:-1]).T) if len(way) > 1 else np.zeros(0)
    drove = np.hypot(*np.diff(result.odom_from_base[:, :2], axis=0).T) if len(way) > 1 else np.zeros(0)
    with np.errstate(invalid="ignore"):  # a pose that is NaN is joined to none
        joined = apart <= drove + _JUMP_M
    for state in _present(states):
        colour = STATE_COLOURS.get(state, "#000000")
        here = states == state
        if state in SEARCHING:  # the best candidate jumps about: dots
            axes.scatter(*way[here].T, s=8, color=colour, alpha=0.5, linewidths=0, zorder=4)
            axes.plot([], [], "o", color=colour, markersize=5, label=state)
            continue
        segments = joined & here[1:]
        lines = np.stack([way[:-1][segments], way[1:][segments]], axis=1)
        axes.add_collection(LineCollection(lines, colors=colour, linewidths=2.2, zorder=5, capstyle="round"))
        axes.scatter(*way[here].T, s=3, color=colour, linewidths=0, zorder=5)
        axes.plot([], [], color=colour, linewidth=3, label=state)


def _case_ribbon(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    edges, share = case_shares(result)
    figure = new_figure(10.0, 3.0)
    axes = figure.subplots()
    below = np.zeros(len(share))
    for case in (1, 3, 4, 2, 0):  # what is understood below, what is not on top
        top = below + share[:, case]
        axes.fill_between(
            edges,
            np.append(below, below[-1]),
            np.append(top, top[-1]),
            step="post",
            linewidth=0,
            color=CASE_COLOURS[case],
            label=CASE_NAMES[case],
        )
        below = top
    _state_ribbon(axes, result, -0.09, -0.02)
    axes.set_ylim(-0.09, 1.0)
    axes.set_xlim(edges[0], edges[-1])
    axes.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0])
    axes.set_yticklabels(["0", "25", "50", "75", "100 %"])
    axes.set_ylabel("of the beams")
    axes.set_xlabel("time since the first scan [s]")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.16), ncol=5, fontsize=8, frameon=False)
    counts = np.bincount(result.cases.ravel(), minlength=256)[list(CASES)]
    total = max(int(counts.sum()), 1)
    words = ", ".join(f"{name[2:]} {100 * count / total:.1f} %" for name, count in zip(CASE_NAMES, counts))
    return save(
        folder,
        figure,
        "cases_over_time",
        "What the beams met",
        f"Share of the beams by case over time. Over the whole run: {words}.",
        "Diffuse: the beam ended at the first mapped wall. Specular: it was mirrored there. Behind panes: it "
        "went through one or two of them. Uncertain: nothing on the map explains it, or no answer came. The "
        "thin band below is the state.",
    )


def case_shares(result: ReplayResult) -> "Tuple[np.ndarray, np.ndarray]":
    """Edges (N + 1,) [s] of N pieces of time, and the share (N, 5) of the beams of each case in them."""
    seconds = run_story.seconds_of(result)
    pieces = min(_COLUMNS, len(result))
    first = np.unique((np.arange(pieces) * len(result)) // pieces)
    counts = np.stack([(result.cases == case).sum(axis=1) for case in CASES], axis=1)
    summed = np.add.reduceat(counts, first, axis=0).astype(float)
    last = seconds[-1] if seconds[-1] > seconds[first[-1]] else seconds[-1] + 1e-3
    return np.append(seconds[first], last), summed / np.maximum(summed.sum(axis=1, keepdims=True), 1.0)


def _walls(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    if ground.glass is None or not (ground.glass >= 0).any():
        return None
    rows, columns = np.nonzero(ground.glass >= 0)
    percent = ground.glass[rows, columns]
    grid = ground.grid
    at = se2.transform_points(grid.map_from_grid, (np.stack([columns, rows], axis=1) + 0.5) * grid.resolution_m)
    low, high = at.min(axis=0) - 1.0, at.max(axis=0) + 1.0
    width, height = high - low
    figure = new_figure(10.0, float(np.clip(10.0 * height / width, 3.2, 8.0)))
    axes = figure.subplots()
    draw_map(axes, grid, low, high)
    kinds = percent < SOLID_BELOW, (percent >= SOLID_BELOW) & (percent < GLASS_FROM), percent >= GLASS_FROM
    counts = [int(kind.sum()) for kind in kinds]
    dot = max(2.0, (72 * 9.0 / width * grid.resolution_m) ** 2)
    for kind, name, colour, count in zip(kinds, WALL_NAMES, WALL_COLOURS, counts):
        axes.scatter(
            *at[kind].T,
            s=dot if name != "glass" else max(dot, 5.0),
            marker="s",
            color=colour,
            linewidths=0,
            label=f"{name}: {count} cells",
            zorder=3,
        )
    axes.plot(*result.map_from_base[:, :2].T, color="#888888", linewidth=0.5, zorder=2)
    frame(axes, low, high)
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.03),
        ncol=3,
        fontsize=9,
        frameon=False,
        markerscale=3 / np.sqrt(dot) + 1,
    )
    return save(
        folder,
        figure,
        "glass",
        "How glassy each wall proved",
        f"The walls that beams tested: {counts[0]} cells proved solid, {counts[1]} are undecided, {counts[2]} "
        "proved to be glass.",
        f"Glass: at least {GLASS_FROM} % sure. Solid: at most {SOLID_BELOW} %. Walls left as they are on the "
        "map were not tested by any beam.",
    )


def _errors(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    errors = result.errors
    known = bool(errors.matched.any())
    figure = new_figure(10.0, 3.4)
    if not known:
        draw_errors(figure.subplots(), result)
        return save(
            folder,
            figure,
            "errors",
            "What the filter claims",
            "The standard deviations of position and heading that the filter claims, over time.",
            "There is no ground truth to compare with.",
        )
    left, beside = figure.subplots(1, 2, gridspec_kw={"width_ratios": [2.4, 1.0]})
    draw_errors(left, result)
    off = np.sort(errors.position_m[errors.matched])
    finite = np.maximum(off[np.isfinite(off)], _MIN_M)
    beside.plot(finite, 100.0 * np.arange(1, len(finite) + 1) / len(off), color="#d62728", linewidth=1.6)
    beside.set_xscale("log")
    beside.set_ylim(0.0, 100.0)
    beside.set_xlabel("position error below [m]")
    beside.set_ylabel("scans [%]")
    beside.grid(True, linewidth=0.4, alpha=0.6)
    return save(
        folder,
        figure,
        "errors",
        "How far off it was",
        f"Position and heading error over time; median {metres(float(np.median(off)))}, at most "
        f"{metres(float(off.max()))}.",
        "Left: errors against the ground truth over time, and the state. Right: for how many scans the error "
        "was below a distance.",
    )


def _reliability(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    errors = result.errors
    if not errors.matched.any():
        figure = new_figure(10.0, 2.6)
        axes = figure.subplots()
        axes.plot(run_story.seconds_of(result), result.reliability, color="#1f77b4", linewidth=1.0)
        axes.set_ylim(0.0, 1.02)
        axes.set_xlabel("time since the first scan [s]")
        axes.set_ylabel("reliability")
        axes.grid(True, axis="y", linewidth=0.4, alpha=0.6)
        return save(
            folder,
            figure,
            "reliability",
            "How reliable it said it was",
            f"The chance that the pose is right, as the filter tells it, over time; median "
            f"{np.median(result.reliability):.2f}.",
            "Without a ground truth nobody can say whether it is so.",
        )
    told, off = result.reliability[errors.matched], errors.position_m[errors.matched]
    states, right = np.array(result.states)[errors.matched], run_story.right(errors)[errors.matched]
    figure = new_figure(10.0, 3.4)
    left, beside = figure.subplots(1, 2, gridspec_kw={"width_ratios": [1.6, 1.0]})
    for state in _present(states):
        here = states == state
        left.scatter(
            told[here],
            np.clip(off[here], _MIN_M, 1e3),
            s=7,
            alpha=0.5,
            linewidths=0,
            color=STATE_COLOURS.get(state, "#000000"),
            label=state,
        )
    left.set_yscale("log")
    left.axhline(run_story.RIGHT_M, color="#555555", linewidth=0.8, linestyle="--")
    left.set_xlim(-0.02, 1.02)
    left.set_xlabel("reliability told")
    left.set_ylabel("true position error [m]")
    left.legend(loc="lower left", fontsize=8, frameon=True, markerscale=2.0)
    centres, share, counts = calibration(told, right)
    beside.plot([0.0, 1.0], [0.0, 1.0], color="#888888", linewidth=0.8, linestyle="--")
    beside.bar(centres, share, width=0.085, color="#1f77b4")
    for centre, height, count in zip(centres, share, counts):
        beside.annotate(str(count), (centre, height), ha="center", va="bottom", fontsize=7)
    beside.set_xlim(0.0, 1.0)
    beside.set_ylim(0.0, 1.1)
    beside.set_xlabel("reliability told")
    beside.set_ylabel("share that was right")
    return save(
        folder,
        figure,
        "reliability",
        "Reliability told, and the truth",
        "Told reliability against the true error of each scan, and the share of right poses for each class of "
        "reliability: "
        + ", ".join(f"{centre:.2f}: {height:.2f} of {count}" for centre, height, count in zip(centres, share, counts))
        + ".",
        f"Left: each dot is a scan; above the dashed line ({run_story.RIGHT_M:g} m) the pose was wrong. "
        "Right: bars on the dashed line would be a reliability that is exactly true; numbers are scans. "
        "Right is "
        f"within {run_story.RIGHT_M:g} m and {np.degrees(run_story.RIGHT_RAD):.0f}°.",
    )


def calibration(told: np.ndarray, right: np.ndarray) -> "Tuple[np.ndarray, np.ndarray, np.ndarray]":
    """Of ten classes of told chance those that hold any: their middle, the share that was right, how many (N,)."""
    number = np.minimum((np.asarray(told) * 10.0).astype(int), 9)
    counts = np.bincount(number, minlength=10)
    hits = np.bincount(number, np.asarray(right, float), minlength=10)
    held = counts > 0
    return (np.arange(10)[held] + 0.5) / 10.0, hits[held] / counts[held], counts[held]


def _candidates(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    if "GLOBAL_SEARCH" not in result.states:
        return None
    first = result.states.index("GLOBAL_SEARCH")
    after = next((row for row in range(first, len(result)) if result.states[row] not in SEARCHING), None)
    end = len(result) if after is None else min(len(result), after + 1 + max(3, (after - first) // 10))
    rows = np.arange(first, end)
    seconds = run_story.seconds_of(result)[rows]
    errors = result.errors
    known = bool(errors.matched[rows].any())
    figure = new_figure(10.0, 3.6 if known else 2.6)
    panels = figure.subplots(2 if known else 1, 1, sharex=True, squeeze=False)[:, 0]
    panels[0].step(
        seconds, np.maximum(result.places[rows], 0.8), where="post", color=STATE_COLOURS["GLOBAL_SEARCH"], linewidth=1.6
    )
    panels[0].set_yscale("log")
    panels[0].set_ylabel("places possible")
    if known:
        panels[1].step(
            seconds, np.maximum(errors.position_m[rows], _MIN_M), where="post", color="#d62728", linewidth=1.6
        )
        panels[1].set_yscale("log")
        panels[1].set_ylabel("error of\nthe best [m]")
    for axes in panels:
        axes.grid(True, axis="y", linewidth=0.4, alpha=0.6)
        if after is not None:
            axes.axvline(run_story.seconds_of(result)[after], color=STATE_COLOURS["LOCALIZED"], linewidth=1.6)
    panels[-1].set_xlabel("time since the first scan [s]")
    most = int(result.places[rows].max())
    ending = (
        "and it was never found"
        if after is None
        else (f"found after {run_story.duration(float(run_story.seconds_of(result)[after] - seconds[0]))}")
    )
    return save(
        folder,
        figure,
        "candidates",
        "From anywhere to one place",
        f"Number of places that were possible over time: up to {most}, {ending}.",
        "The green line is where the search ended." if after is not None else "The search went on until the log ended.",
    )


def _update_time(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    seconds = run_story.seconds_of(result)
    period_s = run_story.scan_period_s(result)
    figure = new_figure(10.0, 2.8)
    axes = figure.subplots()
    for rows, name, colour in (
        (~result.updated, "scan that moved nothing", "#9ecae1"),
        (result.updated, "update of the particles", "#08519c"),
    ):
        axes.scatter(seconds[rows], np.maximum(result.cpu_ms[rows], 0.05), s=6, color=colour, linewidths=0, label=name)
    axes.set_yscale("log")
    words, caption = "", "One dot is one scan, CPU time of all threads."
    if period_s is not None:
        axes.axhline(1e3 * period_s, color="#d62728", linewidth=1.2, label="scan period (median)")
        late = float(np.mean(result.cpu_ms > 1e3 * period_s))
        words = f"; the scan period is {1e3 * period_s:.0f} ms, {run_story.percent(late)} of the scans took longer"
        caption += (
            f" {run_story.percent(late)} of the scans took longer than the period of "
            f"{1e3 * period_s:.0f} ms; in all, the filter used "
            f"{run_story.percent(min(1.0, float(result.cpu_ms.sum()) / max(1e3 * seconds[-1], 1e-9)))} of the "
            "time of one core."
        )
    axes.set_xlabel("time since the first scan [s]")
    axes.set_ylabel("CPU time [ms]")
    axes.grid(True, axis="y", linewidth=0.4, alpha=0.6)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.17), ncol=3, fontsize=8, frameon=False, markerscale=2.0)
    return save(
        folder,
        figure,
        "update_time",
        "Is it fast enough?",
        f"CPU time of each scan: median {np.median(result.cpu_ms):.1f} ms{words}.",
        caption,
    )


def _confusion(folder: Path, confusion: np.ndarray) -> Picture:
    figure = new_figure(5.6, 5.2)
    draw_confusion(figure.subplots(), confusion)
    right = np.trace(confusion) / max(int(confusion.sum()), 1)
    return save(
        folder,
        figure,
        "confusion",
        "Cases told, and the truth",
        f"Confusion matrix of the beam cases: {100 * right:.1f} % of {int(confusion.sum())} beams were told right.",
        "The log knows what each beam truly met. Rows: the truth; columns: what was told.",
    )


def _worst(folder: Path, result: ReplayResult, ground: Ground, number: int, kept: KeptScan) -> Picture:
    errors, row = result.errors, kept.row
    told = result.map_from_base[row]
    poses = [("where it thought it was", told)]
    if errors.matched[row]:
        assert result.reference is not None
        poses.append(("where it was", result.reference.at(result.stamps_ns[row])))
    figure = new_figure(4.6 * len(poses), 4.4)
    cases = result.cases[row, : len(kept.points_m)]
    answered = np.isfinite(kept.points_m).all(axis=1) & (cases < len(CASE_NAMES))
    for axes, (name, pose) in zip(figure.subplots(1, len(poses), squeeze=False)[0], poses):
        _draw_scan(axes, ground.grid, pose, kept, cases, answered, [other for _, other in poses])
        axes.set_title(name, fontsize=9)
    seconds = float(run_story.seconds_of(result)[row])
    off = (
        f"{metres(float(errors.position_m[row]))} and {np.degrees(errors.yaw_rad[row]):.1f}° off"
        if errors.matched[row]
        else f"reliability {result.reliability[row]:.2f}"
    )
    counts = np.bincount(cases[answered], minlength=len(CASE_NAMES))
    words = ", ".join(f"{count} {name[2:]}" for name, count in zip(CASE_NAMES, counts) if count) or "none"
    return save(
        folder,
        figure,
        f"worst_{number:02d}",
        f"{number}. At {seconds:.1f} s: {off}",
        f"Scan at {seconds:.1f} s over the map; beams that came back: {words}.",
        f"{result.states[row]}: {result.reasons[row]}.",
    )


def _draw_scan(
    axes: Any,
    grid: MapImage,
    pose: np.ndarray,
    kept: KeptScan,
    cases: np.ndarray,
    answered: np.ndarray,
    shown: Sequence[np.ndarray],
) -> None:
    """The scan as it lies on the map at a pose; the part of the map holds it at all poses shown."""
    from matplotlib.collections import LineCollection

    ends = kept.points_m[answered]
    corners = np.concatenate([[other[:2] for other in shown], *(se2.transform_points(other, ends) for other in shown)])
    corners = corners[np.isfinite(corners).all(axis=1)]
    if not len(corners):
        corners = np.zeros((1, 2))
    low, high = np.percentile(corners, 1, axis=0) - 1.0, np.percentile(corners, 99, axis=0) + 1.0
    half = (high - low).max() / 2.0
    low, high = (low + high) / 2.0 - half, (low + high) / 2.0 + half
    draw_map(axes, grid, low, high)
    if np.all(np.isfinite(pose)):
        laser = se2.compose(pose, kept.base_from_laser)
        points = se2.transform_points(pose, ends)
        colours = np.array(CASE_COLOURS)[cases[answered]]
        rays = np.stack([np.broadcast_to(laser[:2], points.shape), points], axis=1)
        axes.add_collection(LineCollection(rays, colors=colours, linewidths=0.4, alpha=0.45))
        axes.scatter(*points.T, c=colours, s=6, zorder=3, linewidths=0)
        heading = pose[:2] + 0.06 * (high - low)[0] * np.array([np.cos(pose[2]), np.sin(pose[2])])
        axes.plot(*pose[:2], "o", color=TRUTH_COLOUR, markersize=5, zorder=4)
        axes.plot([pose[0], heading[0]], [pose[1], heading[1]], color=TRUTH_COLOUR, linewidth=2.0, zorder=4)
    frame(axes, low, high)


def bounds(result: ReplayResult) -> "Tuple[np.ndarray, np.ndarray]":
    """Lower left and upper right corner (2,) [m] of the way, without the places that were only candidates."""
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


def _state_ribbon(axes: Any, result: ReplayResult, low: float, high: float) -> None:
    for episode in run_story.episodes(result):
        axes.fill_between(
            [episode.start_s, episode.end_s], low, high, linewidth=0, color=STATE_COLOURS.get(episode.state, "#000000")
        )


def _present(states: np.ndarray) -> List[str]:
    known = [state for state in STATE_COLOURS if state in set(states.tolist())]
    return known + sorted(set(states.tolist()) - set(known))


def _state_shares(result: ReplayResult) -> str:
    states = np.array(result.states)
    return ", ".join(f"{state} {run_story.percent(float(np.mean(states == state)))}" for state in _present(states))


def new_figure(width: float, height: float) -> Any:
    """An empty one [inch], without a display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI, constrained_layout=True)
    FigureCanvasAgg(figure)
    return figure


def frame(axes: Any, low: np.ndarray, high: np.ndarray) -> None:
    """Axes of a map from corner to corner (2,) [m]."""
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7)


def save(folder: Path, figure: Any, name: str, title: str, alt: str, caption: str) -> Picture:
    """The figure as a PNG file."""
    path = folder / f"{name}.png"
    figure.savefig(path)
    return Picture(path, title, alt, caption)
