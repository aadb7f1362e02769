"""Places short texts beside points of a map without overlap; a text without space is left out."""

from __future__ import annotations

from typing import Any, List, Sequence, Tuple

import numpy as np

_SIDES = ((1, 1), (-1, 1), (1, -1), (-1, -1))  # of its point, tried in this order
_GAP_PT = 3.0  # from the point
_LETTER = 0.72  # width of a digit, of the size of the font; with some room
_LINE = 1.5  # height of a line
_ROOM = 1.15  # a layout may shrink the axes after the texts were placed

Box = Tuple[float, float, float, float]  # left, bottom, right, top [pt]


class Labels:
    """Places texts one after the other: the important ones first."""

    def __init__(self, axes: Any) -> None:
        """
        Args:
            axes: of a map, its limits set.
        """
        self._axes = axes
        box = axes.get_window_extent()
        size_pt = 72.0 / axes.figure.dpi * np.array([box.width, box.height])
        spans_m = np.abs([np.diff(axes.get_xlim())[0], np.diff(axes.get_ylim())[0]])
        self._pt_per_m = float((size_pt / np.maximum(spans_m, 1e-9)).min()) / _ROOM  # one scale for both axes
        self._taken: List[Box] = []

    def add(self, point: np.ndarray, text: str, fontsize: float, centred: bool = False, **style: Any) -> bool:
        """A text at a point (2,) [m], centred on it or beside it; False if there was no room.

        Args:
            point: in the map [m].
            text: of one line.
            fontsize: [pt].
            centred: on the point; else beside it.
            style: of matplotlib's text.
        """
        size = fontsize * np.array([_LETTER * len(text), _LINE])
        for sides in ((0, 0),) if centred else _SIDES:
            offset = np.array(sides) * (0.5 * size + _GAP_PT)
            middle = np.asarray(point) * self._pt_per_m + offset
            box = (*(middle - 0.5 * size), *(middle + 0.5 * size))
            if any(_overlap(box, other) for other in self._taken):
                continue
            self._taken.append(box)
            self._axes.annotate(
                text,
                tuple(point),
                textcoords="offset points",
                xytext=tuple(offset),
                fontsize=fontsize,
                ha="center",
                va="center",
                annotation_clip=True,
                clip_on=True,
                **style,
            )
            return True
        return False


def add_all(labels: Labels, points: Sequence[np.ndarray], texts: Sequence[str], fontsize: float, **style: Any) -> None:
    """Several of one kind."""
    for point, text in zip(points, texts):
        labels.add(point, text, fontsize, **style)


def _overlap(one: Sequence[float], other: Sequence[float]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
