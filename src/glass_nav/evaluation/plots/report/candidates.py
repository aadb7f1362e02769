"""The number of possible places during a global search."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

import numpy as np

from glass_nav.evaluation.metrics import run_story
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.metrics.run_story import SEARCHING
from glass_nav.evaluation.plots.canvas import Picture, new_figure, save
from glass_nav.evaluation.plots.error_curve import ESTIMATE_COLOUR
from glass_nav.evaluation.plots.report.errors import MIN_M
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.vocabulary import LocalizationState


def draw(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    if LocalizationState.GLOBAL_SEARCH not in result.states:
        return None
    first = result.states.index(LocalizationState.GLOBAL_SEARCH)
    after = next((row for row in range(first, len(result)) if result.states[row] not in SEARCHING), None)
    end = len(result) if after is None else min(len(result), after + 1 + max(3, (after - first) // 10))
    rows = np.arange(first, end)
    seconds = run_story.seconds_of(result)[rows]
    errors = result.errors
    known = bool(errors.matched[rows].any())
    figure = new_figure(10.0, 3.6 if known else 2.6)
    panels = figure.subplots(2 if known else 1, 1, sharex=True, squeeze=False)[:, 0]
    panels[0].step(
        seconds,
        np.maximum(result.places[rows], 0.8),
        where="post",
        color=LocalizationState.GLOBAL_SEARCH.colour,
        linewidth=1.6,
    )
    panels[0].set_yscale("log")
    panels[0].set_ylabel("places possible [1]")
    if known:
        panels[1].step(
            seconds,
            np.maximum(errors.position_m[rows], MIN_M),
            where="post",
            color=ESTIMATE_COLOUR,
            linestyle="--",
            linewidth=1.6,
        )
        panels[1].set_yscale("log")
        panels[1].set_ylabel("error of\nthe best [m]")
    for axes in panels:
        axes.grid(True, axis="y", linewidth=0.4, alpha=0.6)
        if after is not None:
            axes.axvline(run_story.seconds_of(result)[after], color=LocalizationState.LOCALIZED.colour, linewidth=1.6)
    panels[-1].set_xlabel("time since the first scan [s]")
    most = int(result.places[rows].max())
    ending = (
        "and none was found"
        if after is None
        else (f"found after {run_story.duration(float(run_story.seconds_of(result)[after] - seconds[0]))}")
    )
    return save(
        folder,
        figure,
        "candidates",
        "Global search",
        f"Number of places that were possible over time: up to {most}, {ending}.",
        "The upright line is where the search ended."
        if after is not None
        else "The search went on until the log ended.",
    )
