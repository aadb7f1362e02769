"""CPU time of each scan."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

import numpy as np

from glass_nav.evaluation.metrics import run_story
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.plots.canvas import Picture, new_figure, save
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.vocabulary import SERIES_COLOURS


def draw(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    seconds = run_story.seconds_of(result)
    period_s = run_story.scan_period_s(result)
    figure = new_figure(10.0, 2.8)
    axes = figure.subplots()
    for rows, name, colour, mark in (
        (~result.updated, "scan that moved nothing", SERIES_COLOURS[5], "o"),
        (result.updated, "update of the particles", SERIES_COLOURS[0], "^"),
    ):
        axes.scatter(
            seconds[rows],
            np.maximum(result.cpu_ms[rows], 0.05),
            s=8,
            color=colour,
            marker=mark,
            linewidths=0,
            label=name,
        )
    axes.set_yscale("log")
    words, caption = "", "One dot is one scan, CPU time of all threads."
    if period_s is not None:
        axes.axhline(
            1e3 * period_s, color=SERIES_COLOURS[3], linestyle="--", linewidth=1.2, label="scan period (median)"
        )
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
