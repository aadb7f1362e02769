"""A line through points, parametrized by the distance along it. W points (W, 2), one unit of length throughout."""

from __future__ import annotations

import numpy as np


class Polyline:
    """Straight pieces from point to point."""

    def __init__(self, points: np.ndarray) -> None:
        """
        Args:
            points: (W, 2), at least two, consecutive ones different; see distinct().
        """
        self.points = points
        self._lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        self._directions = np.diff(points, axis=0) / self._lengths[:, None]
        self._starts = np.concatenate([[0.0], np.cumsum(self._lengths)])  # distance from the first point to each
        self.length = float(self._starts[-1])

    def at(self, way: float) -> np.ndarray:
        """(2,) the point at that distance; before the start and beyond the end the line continues straight."""
        index = self._piece(way)
        return self.points[index] + (way - self._starts[index]) * self._directions[index]

    def direction(self, way: float) -> np.ndarray:
        """(2,) unit vector of the line there."""
        return self._directions[self._piece(way)]

    def nearest(self, point: np.ndarray, from_way: float = 0.0, window: float = np.inf) -> float:
        """Distance along the line to its point nearest to a point (2,), neither before from_way nor on a piece that
        begins more than the window after it: a line may cross itself.
        """
        first, last = self._piece(from_way), self._piece(from_way + window)
        parts = slice(first, last + 1)
        along = ((point - self.points[:-1][parts]) * self._directions[parts]).sum(axis=1)
        low = np.maximum(from_way - self._starts[:-1][parts], 0.0)
        along = np.minimum(np.maximum(along, low), np.maximum(self._lengths[parts], low))
        nearest = self.points[:-1][parts] + along[:, None] * self._directions[parts]
        best = int(np.argmin(((nearest - point) ** 2).sum(axis=1)))
        return min(float(self._starts[first + best] + along[best]), self.length)

    def part(self, from_way: float, to_way: float) -> np.ndarray:
        """(n, 2) the points from one distance to another, both ends included; backwards if the second is less."""
        low, high = sorted((from_way, to_way))
        between = self.points[(self._starts > low) & (self._starts < high)]
        points = np.concatenate([self.at(low)[None], between, self.at(high)[None]])
        return points if from_way <= to_way else points[::-1]

    def _piece(self, way: float) -> int:
        return min(max(int(np.searchsorted(self._starts, way, side="right")) - 1, 0), len(self._lengths) - 1)


def distinct(points: np.ndarray, least_step: float = 1e-6) -> np.ndarray:
    """(n, 2) the points (W, 2) without consecutive duplicates."""
    keep = np.ones(len(points), bool)
    keep[1:] = np.linalg.norm(np.diff(points, axis=0), axis=1) > least_step
    return points[keep]


def distances_along(points: np.ndarray) -> np.ndarray:
    """(W,) distance along the line from the first point to each of the points (W, 2)."""
    steps = np.diff(points, axis=0)
    along = np.zeros(len(points))
    along[1:] = np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))
    return along


def length(points: np.ndarray) -> float:
    """Length of the line through the points (W, 2)."""
    return float(np.hypot(*np.diff(points, axis=0).T).sum())
