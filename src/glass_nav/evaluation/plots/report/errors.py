"""Errors over time, and their cumulative distribution."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

import numpy as np

from glass_nav.evaluation.metrics import run_story
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.metrics.run_story import metres
from glass_nav.evaluation.plots.canvas import Picture, new_figure, save
from glass_nav.evaluation.plots.error_curve import ESTIMATE_COLOUR, MAX_SPIKES, draw_errors
from glass_nav.evaluation.plots.report.ground import Ground

MIN_M = 1e-3  # errors below are drawn there, on a logarithmic axis


def draw(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    errors = result.errors
    known = bool(errors.matched.any())
    figure = new_figure(10.0, 3.4)
    if not known:
        draw_errors(figure.subplots(), result)
        return save(
            folder,
            figure,
            "errors",
            "Reported uncertainty",
            "The reported standard deviations of position and heading over time.",
            "There is no ground truth to compare with.",
        )
    left, beside = figure.subplots(1, 2, gridspec_kw={"width_ratios": [2.4, 1.0]})
    draw_errors(left, result)
    off = np.sort(errors.position_m[errors.matched])
    finite = np.maximum(off[np.isfinite(off)], MIN_M)
    beside.plot(finite, 100.0 * np.arange(1, len(finite) + 1) / len(off), color=ESTIMATE_COLOUR, linewidth=1.6)
    beside.set_xscale("log")
    beside.set_ylim(0.0, 100.0)
    beside.set_xlabel("position error below [m]")
    beside.set_ylabel("scans [%]")
    beside.grid(True, linewidth=0.4, alpha=0.6)
    return save(
        folder,
        figure,
        "errors",
        "Errors",
        f"Position and heading error over time; median {metres(float(np.median(off)))}, at most "
        f"{metres(float(off.max()))}.",
        "Left: errors against the ground truth over time, and the state. Right: for how many scans the error "
        "was below a distance." + _spikes(result),
    )


def _spikes(result: ReplayResult) -> str:
    """One sentence on what causes isolated spikes of the heading error."""
    spikes = run_story.yaw_spikes(result, MAX_SPIKES)
    if not spikes:
        return ""
    seconds = run_story.seconds_of(result)
    words = "; ".join(f"{np.degrees(each.yaw_rad):.1f}° at {seconds[each.row]:.1f} s ({each.why})" for each in spikes)
    return f" Lone spikes of the heading, marked by triangles: {words}."
