"""The integrity diagram: each scan's error against its 99.9 % protection level, as in satellite navigation."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

import numpy as np

from glass_nav.evaluation.metrics import integrity_scores
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.metrics.run_story import percent
from glass_nav.evaluation.plots.canvas import Picture, new_figure, save
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.vocabulary import LocalizationState, state_colour, state_mark, states_in_order

_AXES = (("along the heading", "m", 1.0), ("across the heading", "m", 1.0), ("of the heading", "deg", 180.0 / np.pi))
_LEAST, _MOST = (1e-3, 1e-3, 1e-2), (100.0, 100.0, 180.0)  # values beyond are drawn there, on logarithmic axes


def draw(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
    claims = result.integrity
    used = claims.part(claims.matched & np.isfinite(claims.level_999).all(axis=1))
    if not len(used.stamps_ns):
        return None
    figure = new_figure(10.0, 3.9)
    for column, axes in enumerate(figure.subplots(1, 3)):
        name, unit, scale = _AXES[column]
        low, high = _LEAST[column], _MOST[column]
        error, level = (
            np.clip(scale * np.abs(values[:, column]), low, high) for values in (used.error, used.level_999)
        )
        for state in states_in_order(used.states.tolist()):
            here = used.states == state
            axes.scatter(
                level[here],
                error[here],
                s=12,
                alpha=0.5,
                linewidths=0,
                marker=state_mark(state) or ".",
                color=state_colour(state),
                label=state,
            )
        over = used.localized & (np.abs(used.error[:, column]) > used.level_999[:, column])
        if over.any():
            axes.scatter(
                level[over], error[over], s=45, marker="x", color="black", linewidths=1.4, label="misleading", zorder=4
            )
        ends = [low, high]
        axes.plot(ends, ends, color="#555555", linewidth=0.8, linestyle="--")
        axes.fill_between(ends, ends, [high, high], color=LocalizationState.LOST.colour, alpha=0.08, linewidth=0)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(0.8 * low, 1.2 * max(error.max(), level.max()))
        axes.set_ylim(0.8 * low, 1.2 * max(error.max(), level.max()))
        axes.set_xlabel(f"99.9 % protection level [{unit}]")
        axes.set_ylabel(f"error {name} [{unit}]")
        axes.grid(True, linewidth=0.4, alpha=0.6)
        axes.legend(loc="upper left", fontsize=8, markerscale=2.0)
    figures = integrity_scores.summary(claims)
    share = percent(figures["misleading_share"] or 0.0)
    return save(
        folder,
        figure,
        "integrity",
        "Errors against protection levels",
        f"Integrity diagram: error of each scan against its 99.9 % protection level, along and across the heading and "
        f"of the heading. {share} of the scans are misleading: LOCALIZED and above the diagonal.",
        "Each dot is a scan. Below the dashed line the error is within its protection level. Above it (shaded) a pose "
        "that was reported as LOCALIZED is misleading information, marked with a cross: "
        f"{share} of the scans, at most {figures['misleading_max_s'] or 0.0:.1f} s and "
        f"{figures['misleading_max_m'] or 0.0:.2f} m in a row.",
    )
