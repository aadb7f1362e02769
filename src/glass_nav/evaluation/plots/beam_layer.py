"""The beams of one scan over a map: rays, an end mark for each case, and a legend."""

from __future__ import annotations

from typing import Any, Iterable, List

import numpy as np

from glass_nav.vocabulary import CASES_IN_ORDER, BeamCase

MARK_SIZE = 11.0  # [points^2]
_LINE_MARKS = ("+", "x")  # these have no area and take their colour from the line


def draw_beams(
    axes: Any, origin_m: np.ndarray, ends_m: np.ndarray, cases: np.ndarray, size: float = MARK_SIZE, rays: bool = True
) -> None:
    """Beams from an origin (2,) to their ends (B, 2) [m], each in the colour and with the mark of its case (B,)."""
    from matplotlib.collections import LineCollection

    for case in CASES_IN_ORDER:
        ends = ends_m[cases == case]
        if not len(ends):
            continue
        if rays:
            lines = np.stack([np.broadcast_to(origin_m, ends.shape), ends], axis=1)
            axes.add_collection(LineCollection(lines, colors=case.colour, linewidths=0.4, alpha=0.45))
        axes.scatter(*ends.T, c=case.colour, marker=case.mark, s=size, zorder=3, linewidths=_width(case))


def handles(cases: Iterable[int]) -> List[Any]:
    """An entry of a legend for each of these cases, in the order of the vocabulary."""
    from matplotlib.lines import Line2D

    present = set(np.unique(np.asarray(list(cases), int)).tolist())
    return [
        Line2D([], [], color=case.colour, marker=case.mark, markersize=5, linestyle="", label=case.label)
        for case in CASES_IN_ORDER
        if case in present
    ]


def _width(case: BeamCase) -> float:
    return 0.9 if case.mark in _LINE_MARKS else 0.0
