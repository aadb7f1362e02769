"""Fits line segments to points in order along walls: split and merge with total least squares.

Split: Ramer (1972), Douglas and Peucker (1973). Merge and fit: Pavlidis and Horowitz (1974). A segment is a row
x1 y1 x2 y2 in the direction of its points. N points, S segments; one unit of length throughout.
"""

from __future__ import annotations

from typing import List, Tuple

import numpy as np

NO_SEGMENT = -1


def corners(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Indices (K,) of the points (N, 2) of a line within the tolerance of all others; first and last included."""
    kept = [0, len(points) - 1]
    pieces = [(0, len(points) - 1)]
    while pieces:
        first, last = pieces.pop()
        if last - first < 2:
            continue
        away = _away_from_chord(points[first : last + 1])
        furthest = int(away.argmax())
        if away[furthest] > tolerance:
            kept.append(first + furthest)
            pieces += [(first, first + furthest), (first + furthest, last)]
    return np.unique(kept)


def split_and_merge(points: np.ndarray, tolerance: float, least_length: float) -> Tuple[np.ndarray, np.ndarray]:
    """Line segments along a chain of points.

    Args:
        points: (N, 2) in order along the wall.
        tolerance: largest distance of a point from the line of its segment.
        least_length: shorter segments are left out.

    Returns:
        segments (S, 4) in the order of the points, and (N,) the segment of each point, NO_SEGMENT for none.
    """
    label = np.full(len(points), NO_SEGMENT)
    if len(points) < 2:
        return np.zeros((0, 4)), label
    ends = corners(points, tolerance).tolist()
    runs: List[Tuple[int, int]] = []
    for first, last in zip(ends[:-1], ends[1:]):
        if runs and _away_from_line(points[runs[-1][0] : last + 1]).max() <= tolerance:
            first = runs.pop()[0]
        runs.append((first, last))
    segments: List[np.ndarray] = []
    for first, last in runs:
        segment = fit(points[first : last + 1])
        if np.hypot(*(segment[2:] - segment[:2])) >= least_length:
            label[first : last + 1] = len(segments)
            segments.append(segment)
    return np.array(segments).reshape(-1, 4), label


def fit(points: np.ndarray) -> np.ndarray:
    """(4,) the segment along points (N, 2): on their total least-squares line, from end to end."""
    centre, direction = _line(points)
    along = (points - centre) @ direction
    return np.concatenate([centre + along.min() * direction, centre + along.max() * direction])


def weighted_fit(points: np.ndarray, variance: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """As fit(), with the variance (N,) of each point's distance from the line.

    Returns:
        (4,) the segment, and the covariance (2, 2) of its line's heading [rad] and offset, the offset being the
        coordinate of the line along its normal to the left: errors of the points are independent, and the line turns
        about their weighted centre.
    """
    weight = 1.0 / variance
    total = float(weight.sum())
    centre = weight @ points / total
    x, y = (points - centre).T
    angle = 0.5 * np.arctan2(2.0 * (weight @ (x * y)), weight @ (x * x - y * y))
    direction = np.array([np.cos(angle), np.sin(angle)])
    if (points[-1] - points[0]) @ direction < 0.0:
        direction = -direction
    along = (points - centre) @ direction
    turn = np.array([1.0, -(direction @ centre)])  # change of heading and offset by a turn about the centre
    spread = max(float(weight @ along**2), 1e-300)
    covariance = np.outer(turn, turn) / spread + np.diag([0.0, 1.0 / total])
    return np.concatenate([centre + along.min() * direction, centre + along.max() * direction]), covariance


def _line(points: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Line through the points: a point (2,) on it, and its direction (2,) from the first to the last."""
    centre = points.mean(axis=0)
    x, y = (points - centre).T
    angle = 0.5 * np.arctan2(2.0 * (x @ y), x @ x - y @ y)
    direction = np.array([np.cos(angle), np.sin(angle)])
    return centre, direction if (points[-1] - points[0]) @ direction >= 0.0 else -direction


def _away_from_line(points: np.ndarray) -> np.ndarray:
    centre, direction = _line(points)
    x, y = (points - centre).T
    return np.abs(x * direction[1] - y * direction[0])


def _away_from_chord(points: np.ndarray) -> np.ndarray:
    """(N,) distances of the points from the segment between the first and the last."""
    chord = points[-1] - points[0]
    offset = points - points[0]
    length_squared = float(chord @ chord)
    if length_squared == 0.0:
        return np.hypot(offset[:, 0], offset[:, 1])
    share = np.maximum(np.minimum(offset @ chord / length_squared, 1.0), 0.0)  # np.clip is slow on the many short ones
    return np.hypot(offset[:, 0] - share * chord[0], offset[:, 1] - share * chord[1])
