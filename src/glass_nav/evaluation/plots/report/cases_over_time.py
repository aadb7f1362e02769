"""Share of the beams by case over time."""

from __future__ import annotations

from pathlib import Path
from typing import Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics import run_story
from glass_nav.evaluation.metrics.replay_result import NO_BEAM, ReplayResult
from glass_nav.evaluation.plots.canvas import Picture, new_figure, save
from glass_nav.evaluation.plots.error_curve import HATCH_COLOUR
from glass_nav.evaluation.plots.report import states
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.vocabulary import CASES_IN_ORDER, BeamCase

_COLUMNS = 400  # of the ribbon of cases; more than that is thinner than a line


def draw(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    edges, share = case_shares(result)
    figure = new_figure(10.0, 3.0)
    axes = figure.subplots()
    below = np.zeros(len(share))
    for case in CASES_IN_ORDER:  # what is understood below, what is not on top
        top = below + share[:, case]
        axes.fill_between(
            edges,
            np.append(below, below[-1]),
            np.append(top, top[-1]),
            step="post",
            linewidth=0,
            facecolor=case.colour,
            hatch=case.hatch,
            edgecolor=HATCH_COLOUR,
            label=case.label,
        )
        below = top
    states.draw_ribbon(axes, result, -0.09, -0.02)
    axes.set_ylim(-0.09, 1.0)
    axes.set_xlim(edges[0], edges[-1])
    axes.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0])
    axes.set_yticklabels(["0", "25", "50", "75", "100"])
    axes.set_ylabel("share of the beams [%]")
    axes.set_xlabel("time since the first scan [s]")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.16), ncol=5, fontsize=8, frameon=False)
    counts = np.bincount(result.cases.ravel(), minlength=NO_BEAM + 1)[: len(BeamCase)]
    total = max(int(counts.sum()), 1)
    words = ", ".join(f"{case.words} {100 * counts[case] / total:.1f} %" for case in CASES_IN_ORDER)
    return save(
        folder,
        figure,
        "cases_over_time",
        "What the beams met",
        f"Share of the beams by case over time. Over the whole run: {words}.",
        "First surface (diffuse): the beam ended at the first mapped wall. Mirrored (specular): it was mirrored there. "
        "Behind panes: it went through one (first penetration) or two (second penetration). Uncertain: nothing on the "
        "map explains it, or no answer came. The thin band below is the state.",
    )


def case_shares(result: ReplayResult) -> "Tuple[np.ndarray, np.ndarray]":
    """Edges (N + 1,) [s] of N pieces of time, and the share (N, 5) of the beams of each case in them."""
    seconds = run_story.seconds_of(result)
    pieces = min(_COLUMNS, len(result))
    first = np.unique((np.arange(pieces) * len(result)) // pieces)
    counts = np.stack([(result.cases == case).sum(axis=1) for case in BeamCase], axis=1)
    summed = np.add.reduceat(counts, first, axis=0).astype(float)
    last = seconds[-1] if seconds[-1] > seconds[first[-1]] else seconds[-1] + 1e-3
    return np.append(seconds[first], last), summed / np.maximum(summed.sum(axis=1, keepdims=True), 1.0)
