"""The probability of glass of each wall."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

import numpy as np

from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.plots.canvas import Picture, frame, new_figure, save
from glass_nav.evaluation.plots.map_layer import draw_map
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.geometry import se2
from glass_nav.vocabulary import GLASS_FROM, SOLID_BELOW, WallKind

WALL_MARKS = {WallKind.SOLID: "s", WallKind.UNDECIDED: "^", WallKind.GLASS: "o"}


def draw(folder: Path, result: ReplayResult, ground: Ground) -> Optional[Picture]:
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
    for kind, name, count in zip(kinds, WallKind, counts):
        axes.scatter(
            *at[kind].T,
            s=dot if name != WallKind.GLASS else max(dot, 5.0),
            marker=WALL_MARKS[name],
            color=name.colour,
            linewidths=0,
            label=f"{name}: {count} cells",
            zorder=3,
        )
    axes.plot(*result.map_from_base[:, :2].T, color="#888888", linewidth=0.5, zorder=2)
    frame(axes, low, high)
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.1),
        ncol=3,
        fontsize=9,
        frameon=False,
        markerscale=3 / np.sqrt(dot) + 1,
    )
    return save(
        folder,
        figure,
        "glass",
        "Probability of glass, by wall",
        f"The walls that beams tested: {counts[0]} cells are solid, {counts[1]} undecided, {counts[2]} glass.",
        f"Glass: at least {GLASS_FROM} % sure. Solid: at most {SOLID_BELOW} %. Walls left as they are on the "
        "map were not tested by any beam.",
    )
