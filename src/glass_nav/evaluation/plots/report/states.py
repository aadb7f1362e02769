"""The states of the filter: their order and shares, and a thin band of them over time."""

from __future__ import annotations

from typing import Any

import numpy as np

from glass_nav.evaluation.metrics import run_story
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.plots.error_curve import HATCH_COLOUR
from glass_nav.vocabulary import state_colour, state_hatch, states_in_order


def draw_ribbon(axes: Any, result: ReplayResult, low: float, high: float) -> None:
    for episode in run_story.episodes(result):
        axes.fill_between(
            [episode.start_s, episode.end_s],
            low,
            high,
            linewidth=0,
            facecolor=state_colour(episode.state),
            hatch=state_hatch(episode.state),
            edgecolor=HATCH_COLOUR,
        )


def shares(result: ReplayResult) -> str:
    states = np.array(result.states)
    return ", ".join(
        f"{state} {run_story.percent(float(np.mean(states == state)))}" for state in states_in_order(result.states)
    )
