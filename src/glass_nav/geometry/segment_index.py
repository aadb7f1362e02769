"""The nearest segment of each point, without testing all segments.

Nearest as the seed document segment_localization.txt defines it, "Classification of Data Points": by the distance to
the segment itself, which is that to its line where the foot of the perpendicular lies on it, else that to the nearer
end. The plane around the segments is cut into squares; each stores the few segments that can be the nearest to a point
in it: if the nearest to its centre is d away, the nearest to any of its points is within d + 2 h of the centre, h being
half of the diagonal. The search goes from large squares to small ones. N points, S segments; one unit of length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav.geometry.segments import NO_SEGMENT

_HALVINGS = 5  # of the first squares
_MAX_PAIRS = 4_000_000  # of points and segments at once
_SLACK = 1e-9


@dataclass(frozen=True)
class Nearest:
    """The nearest segment of each point."""

    segment: np.ndarray  # (N,) int: the nearest segment, the first of equals; NO_SEGMENT: none
    distance: np.ndarray  # (N,) to it; inf: none


class SegmentIndex:
    """Segments, prepared for many queries."""

    def __init__(self, segments: np.ndarray, square: float = 0.25, margin: float = 2.0) -> None:
        """
        Args:
            segments: (S, 4) x1 y1 x2 y2; S = 0 is allowed.
            square: edge length of the squares.
            margin: how far the squares reach beyond the segments; points further out are looked up slowly.

        Raises:
            ValueError: wrong shape, an end that is not finite, a segment without length.
        """
        segments = np.array(segments, float)
        if segments.ndim != 2 or segments.shape[1] != 4:
            raise ValueError(f"segments must have shape (S, 4), got {segments.shape}")
        length = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
        bad = ~(np.isfinite(length) & (length > 0.0))
        if bad.any():
            at = int(np.argmax(bad))
            raise ValueError(f"segment {at} must have finite ends and a length > 0, got {segments[at].tolist()}")
        self.segments = segments
        along = (segments[:, 2:] - segments[:, :2]) / length[:, None]
        offset = segments[:, 1] * along[:, 0] - segments[:, 0] * along[:, 1]
        self.lines = np.column_stack([-along[:, 1], along[:, 0], offset])  # (S, 3) normal x, y, offset: n . p = offset
        self._rows = np.column_stack([segments[:, :2], along, length])
        self._square = square
        if len(segments):
            self._build(margin)

    def __len__(self) -> int:
        return len(self.segments)

    def nearest(self, points: np.ndarray) -> Nearest:
        """The nearest segment of each point (N, 2), all finite."""
        if not len(self.segments) or not len(points):
            return Nearest(np.full(len(points), NO_SEGMENT), np.full(len(points), np.inf))
        square = np.floor((points - self._origin) / self._square)
        inside = (square >= 0.0) & (square < self._shape)
        inside = inside[:, 0] & inside[:, 1]
        if inside.all():
            return self._among_candidates(points, square)
        segment, distance = nearest_of_all(points[~inside], self.segments)
        found, away = np.empty(len(points), np.int64), np.empty(len(points))
        found[~inside], away[~inside] = segment, distance
        if inside.any():
            near = self._among_candidates(points[inside], square[inside])
            found[inside], away[inside] = near.segment, near.distance
        return Nearest(found, away)

    def _among_candidates(self, points: np.ndarray, square: np.ndarray) -> Nearest:
        number = square[:, 1].astype(np.int64) * int(self._shape[0]) + square[:, 0].astype(np.int64)
        first = self._first[number]
        count = self._first[number + 1] - first
        begin = np.cumsum(count) - count
        of = np.repeat(np.arange(len(points)), count)
        candidate = self._candidates[np.arange(len(of)) + (first - begin)[of]]
        squared = _squared(points[of], self._rows[candidate])
        least = np.minimum.reduceat(squared, begin)
        is_least = np.flatnonzero(squared == least[of])
        best = is_least[np.searchsorted(is_least, begin)]  # the first of each point
        return Nearest(candidate[best], np.sqrt(least))

    def _build(self, margin: float) -> None:
        ends = self.segments.reshape(-1, 2)
        large = self._square * 2**_HALVINGS
        self._origin = ends.min(axis=0) - margin
        shape = np.ceil((ends.max(axis=0) + margin - self._origin) / large).astype(np.int64)
        number = np.arange(int(shape.prod()))
        corner = np.column_stack([number % shape[0], number // shape[0]])
        of, candidate = self._first_candidates(corner, large)
        edge = large
        for _ in range(_HALVINGS):
            edge /= 2.0
            child = np.arange(4)
            corner = (2 * corner[:, None] + np.column_stack([child % 2, child // 2])).reshape(-1, 2)
            of, candidate = (4 * of[:, None] + child).ravel(), np.repeat(candidate, 4)
            kept = self._may_be_nearest(corner, edge, of, candidate)
            of, candidate = of[kept], candidate[kept]
        self._shape = (shape * 2**_HALVINGS).astype(float)  # columns, rows
        place = corner[of, 1] * int(self._shape[0]) + corner[of, 0]
        order = np.lexsort((candidate, place))
        self._candidates = candidate[order]
        self._first = np.searchsorted(place[order], np.arange(int(self._shape.prod()) + 1))

    def _first_candidates(self, corner: np.ndarray, edge: float) -> Tuple[np.ndarray, np.ndarray]:
        """Pairs of a square (K,) and a segment (K,) that may be nearest to some point of the square."""
        each = max(1, _MAX_PAIRS // len(self.segments))
        of, candidate = [], []
        for begin in range(0, len(corner), each):
            count = len(corner[begin : begin + each])
            square = np.repeat(np.arange(count), len(self.segments))
            segment = np.tile(np.arange(len(self.segments)), count)
            kept = self._may_be_nearest(corner[begin : begin + each], edge, square, segment)
            of.append(square[kept] + begin)
            candidate.append(segment[kept])
        return np.concatenate(of), np.concatenate(candidate)

    def _may_be_nearest(self, corner: np.ndarray, edge: float, of: np.ndarray, candidate: np.ndarray) -> np.ndarray:
        """(K,) bool of pairs of a square and a segment; each square has at least one, and its pairs are adjacent."""
        distance = np.empty(len(of))
        for begin in range(0, len(of), _MAX_PAIRS):
            part = slice(begin, begin + _MAX_PAIRS)
            centre = self._origin + (corner[of[part]] + 0.5) * edge
            distance[part] = np.sqrt(_squared(centre, self._rows[candidate[part]]))
        order = np.argsort(of, kind="stable")
        begins = np.searchsorted(of[order], np.arange(len(corner)))
        least = np.minimum.reduceat(distance[order], begins)
        return distance <= least[of] + np.sqrt(2.0) * edge + _SLACK


def nearest_of_all(points: np.ndarray, segments: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """(N,) the segment nearest to each point (N, 2), the first of equals, and (N,) its distance, by testing all."""
    length = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
    rows = np.column_stack([segments[:, :2], (segments[:, 2:] - segments[:, :2]) / length[:, None], length])
    found, away = np.empty(len(points), np.int64), np.empty(len(points))
    each = max(1, _MAX_PAIRS // len(segments))
    for begin in range(0, len(points), each):
        part = slice(begin, begin + each)
        squared = _squared(points[part, None], rows)
        found[part] = np.argmin(squared, axis=1)
        away[part] = np.sqrt(squared.min(axis=1))
    return found, away


def _squared(points: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(...) squared distance of points (..., 2) from segments; rows (..., 5): start, direction, length."""
    x, y = points[..., 0] - rows[..., 0], points[..., 1] - rows[..., 1]
    along = x * rows[..., 2] + y * rows[..., 3]
    across = y * rows[..., 2] - x * rows[..., 3]
    beyond = along - np.minimum(np.maximum(along, 0.0), rows[..., 4])
    return across * across + beyond * beyond
