"""One of the worst scans, over the map."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Sequence

import numpy as np

from glass_nav.evaluation.metrics import run_story
from glass_nav.evaluation.metrics.replay_result import KeptScan, ReplayResult
from glass_nav.evaluation.metrics.run_story import metres
from glass_nav.evaluation.plots import beam_layer
from glass_nav.evaluation.plots.canvas import Picture, frame, new_figure, save
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.geometry import se2
from glass_nav.vocabulary import CASES_IN_ORDER, TRUTH_COLOUR, BeamCase
from glass_nav.world.grid_map import GridMap


def draw(folder: Path, result: ReplayResult, ground: Ground, number: int, kept: KeptScan) -> Picture:
    errors, row = result.errors, kept.row
    reported = result.map_from_base[row]
    poses = [("estimated pose", reported)]
    if errors.matched[row]:
        assert result.reference is not None
        poses.append(("true pose", result.reference.at(result.stamps_ns[row])))
    figure = new_figure(4.6 * len(poses), 5.4)
    cases = result.cases[row, : len(kept.points_m)]
    answered = np.isfinite(kept.points_m).all(axis=1) & (cases < len(BeamCase))
    for axes, (name, pose) in zip(figure.subplots(1, len(poses), squeeze=False)[0], poses):
        _draw_scan(axes, ground.grid, pose, kept, cases, answered, [other for _, other in poses])
        axes.set_title(name, fontsize=9)
    if len(poses) > 1:
        _overlay(figure.axes[0], se2.transform_points(poses[1][1], kept.points_m[answered]))
    handles = beam_layer.handles(cases[answered])
    if handles:
        figure.axes[-1].legend(
            handles=handles,
            loc="upper center",
            bbox_to_anchor=(0.5, 0.0),
            borderaxespad=4.0,
            ncol=3,
            fontsize=7,
            frameon=False,
        )
    seconds = float(run_story.seconds_of(result)[row])
    off = (
        f"{metres(float(errors.position_m[row]))} and {np.degrees(errors.yaw_rad[row]):.1f}° off"
        if errors.matched[row]
        else f"reliability {result.reliability[row]:.2f}"
    )
    counts = np.bincount(cases[answered], minlength=len(BeamCase))
    words = ", ".join(f"{counts[case]} {case.words}" for case in CASES_IN_ORDER if counts[case]) or "none"
    return save(
        folder,
        figure,
        f"worst_{number:02d}",
        f"{number}. At {seconds:.1f} s: {off}",
        f"Scan at {seconds:.1f} s over the map; beams that came back: {words}.",
        f"{result.states[row]}: {result.reasons[row]}."
        + (" Left, in black: where the same beams end at the true pose." if len(poses) > 1 else ""),
    )


def _overlay(axes: Any, ends_m: np.ndarray) -> None:
    """Draw where the beams (B, 2) end at the true pose [m]."""
    axes.scatter(*ends_m.T, s=9, c=TRUTH_COLOUR, marker="1", linewidths=0.7, zorder=3.5, label="at the true pose")
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=4.0, fontsize=7, frameon=False, markerscale=2.0
    )


def _draw_scan(
    axes: Any,
    grid: GridMap,
    pose: np.ndarray,
    kept: KeptScan,
    cases: np.ndarray,
    answered: np.ndarray,
    shown: Sequence[np.ndarray],
) -> None:
    """Draw a scan at a pose on the map; the window contains it at all poses shown."""
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
        beam_layer.draw_beams(axes, laser[:2], points, cases[answered])
        heading = pose[:2] + 0.06 * (high - low)[0] * np.array([np.cos(pose[2]), np.sin(pose[2])])
        axes.plot(*pose[:2], "o", color=TRUTH_COLOUR, markersize=5, zorder=4)
        axes.plot([pose[0], heading[0]], [pose[1], heading[1]], color=TRUTH_COLOUR, linewidth=2.0, zorder=4)
    frame(axes, low, high)
