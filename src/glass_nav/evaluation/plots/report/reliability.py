"""The reported probability of a right pose, against the ground truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics import pose_errors, run_story
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.plots.canvas import Picture, new_figure, save
from glass_nav.evaluation.plots.report.errors import MIN_M
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.vocabulary import SERIES_COLOURS, state_colour, state_mark, states_in_order


def draw(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    return _draw_against_truth(folder, result) if result.errors.matched.any() else _draw_over_time(folder, result)


def _draw_over_time(folder: Path, result: ReplayResult) -> Optional[Picture]:
    figure = new_figure(10.0, 2.6)
    axes = figure.subplots()
    axes.plot(run_story.seconds_of(result), result.reliability, color=SERIES_COLOURS[0], linewidth=1.0)
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel("time since the first scan [s]")
    axes.set_ylabel("reliability [1]")
    axes.grid(True, axis="y", linewidth=0.4, alpha=0.6)
    return save(
        folder,
        figure,
        "reliability",
        "Reported reliability",
        f"The probability of a correct pose that the filter reports, over time; median "
        f"{np.median(result.reliability):.2f}.",
        "It cannot be checked without a ground truth.",
    )


def _draw_against_truth(folder: Path, result: ReplayResult) -> Optional[Picture]:
    errors = result.errors
    reported, off = result.reliability[errors.matched], errors.position_m[errors.matched]
    state_of, right = np.array(result.states)[errors.matched], run_story.right(errors)[errors.matched]
    figure = new_figure(10.0, 3.4)
    left, right_axes = figure.subplots(1, 2, gridspec_kw={"width_ratios": [1.6, 1.0]})
    for state in states_in_order(state_of.tolist()):
        here = state_of == state
        left.scatter(
            reported[here],
            np.clip(off[here], MIN_M, 1e3),
            s=12,
            alpha=0.6,
            linewidths=0,
            marker=state_mark(state) or ".",
            color=state_colour(state),
            label=state,
        )
    left.set_yscale("log")
    left.axhline(pose_errors.RIGHT_M, color="#555555", linewidth=0.8, linestyle="--")
    left.set_xlim(-0.02, 1.02)
    left.set_xlabel("reported reliability [1]")
    left.set_ylabel("true position error [m]")
    left.legend(loc="lower left", fontsize=8, frameon=True, markerscale=2.0)
    centres, share, counts = calibration(reported, right)
    _draw_calibration(right_axes, centres, share, counts)
    return save(
        folder,
        figure,
        "reliability",
        "Reported reliability against the truth",
        "Reported reliability against the true error of each scan, and the share of right poses for each class of "
        "reliability: "
        + ", ".join(f"{centre:.2f}: {height:.2f} of {count}" for centre, height, count in zip(centres, share, counts))
        + ".",
        f"Left: each dot is a scan; above the dashed line ({pose_errors.RIGHT_M:g} m) the pose was wrong. "
        "Right: bars on the dashed line would be a reliability that is exactly true; numbers are scans. "
        "Right is "
        f"within {pose_errors.RIGHT_M:g} m and {np.degrees(pose_errors.RIGHT_RAD):.0f}°.",
    )


def _draw_calibration(axes: Any, centres: np.ndarray, share: np.ndarray, counts: np.ndarray) -> None:
    axes.plot([0.0, 1.0], [0.0, 1.0], color="#888888", linewidth=0.8, linestyle="--")
    axes.bar(centres, share, width=0.085, color=SERIES_COLOURS[0])
    for centre, height, count in zip(centres, share, counts):
        axes.annotate(str(count), (centre, height), ha="center", va="bottom", fontsize=7)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.1)
    axes.set_xlabel("reported reliability [1]")
    axes.set_ylabel("share that was right [1]")


def calibration(reported: np.ndarray, right: np.ndarray) -> "Tuple[np.ndarray, np.ndarray, np.ndarray]":
    """Of ten classes of reported probability, the N that are not empty: centre, share that was right, count."""
    number = np.minimum((np.asarray(reported) * 10.0).astype(int), 9)
    counts = np.bincount(number, minlength=10)
    hits = np.bincount(number, np.asarray(right, float), minlength=10)
    held = counts > 0
    return (np.arange(10)[held] + 0.5) / 10.0, hits[held] / counts[held], counts[held]
