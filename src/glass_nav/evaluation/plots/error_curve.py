"""Errors and states over time: the curve under a trajectory and in a report."""

from __future__ import annotations

from typing import Any

import numpy as np

from glass_nav.evaluation.metrics import run_story
from glass_nav.evaluation.metrics.pose_errors import LOST_M
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.vocabulary import SERIES_COLOURS, state_colour, state_hatch, states_in_order

SCALE_FLOOR_M = 0.2  # errors below it shall not look like large ones
ESTIMATE_COLOUR, YAW_COLOUR = SERIES_COLOURS[0], "#8a8a8a"
HATCH_COLOUR = "#00000050"
MAX_SPIKES = 3  # of the heading that get a mark
RIBBON = 0.08  # share of the error axis below 0, for the states


def draw_errors(axes: Any, result: ReplayResult) -> None:
    top_m = _draw_curves(axes, result)
    _draw_ribbon(axes, result, -RIBBON * top_m, -0.25 * RIBBON * top_m)


def _draw_curves(axes: Any, result: ReplayResult) -> float:
    """Position and heading over time: errors, or deviations without a ground truth; returns the top of the axis [m]."""
    seconds = (result.stamps_ns - result.stamps_ns[0]) * 1e-9
    errors = result.errors
    if errors.matched.any():
        position, yaw, what = errors.position_m, np.degrees(errors.yaw_rad), "error"
    else:
        position = np.hypot(result.deviation[:, 0], result.deviation[:, 1])
        yaw, what = np.degrees(result.deviation[:, 2]), "reported deviation"
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
    for spike in run_story.yaw_spikes(result, MAX_SPIKES):
        turned.plot(seconds[spike.row], np.degrees(spike.yaw_rad), "v", color=YAW_COLOUR, markersize=5)
    axes.set_xlim(seconds[0], max(seconds[-1], seconds[0] + 1e-3))
    axes.set_ylim(-RIBBON * top, top)
    axes.set_xlabel("time since the first scan [s]")
    axes.set_ylabel(f"position {what} [m]", color=ESTIMATE_COLOUR)
    axes.tick_params(axis="y", colors=ESTIMATE_COLOUR)
    axes.grid(True, axis="y", linewidth=0.4, alpha=0.6)
    return top


def _draw_ribbon(axes: Any, result: ReplayResult, low_m: float, high_m: float) -> None:
    """The states along the time axis; each scan's state holds until the next scan."""
    from matplotlib.patches import Patch

    seconds = (result.stamps_ns - result.stamps_ns[0]) * 1e-9
    present = states_in_order(result.states)
    states = np.array(result.states)
    for state in present:
        holds = states == state
        holds[1:] |= states[:-1] == state
        axes.fill_between(
            seconds,
            low_m,
            high_m,
            where=holds,
            step="post",
            facecolor=state_colour(state),
            hatch=state_hatch(state),
            edgecolor=HATCH_COLOUR,
            linewidth=0,
        )
    axes.legend(
        handles=[
            Patch(facecolor=state_colour(state), hatch=state_hatch(state), edgecolor=HATCH_COLOUR, label=state)
            for state in present
        ],
        loc="upper right",
        fontsize=8,
        ncol=len(present),
        framealpha=0.9,
    )
