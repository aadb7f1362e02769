"""Counts the walls through which the robot would have driven, for each of many poses.

A robot drives only through free space. A pose from which odometry would have led through walls or unmapped space is
probably wrong, whatever its scans show. The path is judged in pieces, since one moved object, or a door that was closed
when the map was made, blocks several points of it. It counts once, however often the robot drives there. N points, K
poses.
"""

from __future__ import annotations

from typing import Callable, List

import numpy as np

from glass_nav.geometry import se2

PIECE_M = 0.5  # of the path: one piece of evidence
_STEP_M = 0.1  # between points: less than walls are thick
_SAME_M, _DRIFT_SHARE = 0.3, 0.02  # a point nearer to an earlier one is the same; more per metre driven since

IsFree = Callable[[np.ndarray], np.ndarray]  # points (..., 2) of the map -> (...) bool: a robot may stand there


class DrivenPath:
    """The path by odometry: add() the odometry of each scan."""

    def __init__(self) -> None:
        self._points: List[np.ndarray] = []  # (2,) in the frame of odometry
        self._piece: List[int] = []  # of each

    def add(self, odom_from_base: np.ndarray, driven_m: float) -> None:
        """The robot is at odometry (3,), after that distance."""
        if self._points and np.hypot(*(odom_from_base[:2] - self._points[-1])) < _STEP_M:
            return
        piece = int(driven_m / PIECE_M)
        earlier = int(np.searchsorted(self._piece, piece - 1))  # points that the robot has left behind
        if earlier:
            near_m = _SAME_M + _DRIFT_SHARE * PIECE_M * (piece - np.array(self._piece[:earlier]))
            off_m = np.hypot(*(np.array(self._points[:earlier]) - odom_from_base[:2]).T)
            if (off_m < near_m).any():
                return
        self._points.append(np.array(odom_from_base[:2], float))
        self._piece.append(piece)

    @property
    def complete(self) -> int:
        """Pieces that the robot has driven to their end."""
        return self._piece[-1] if self._piece else 0

    def blocked(
        self, is_free: IsFree, poses: np.ndarray, odom_from_base: np.ndarray, first: int, last: int
    ) -> np.ndarray:
        """(K,) how many pieces, from first to before last, are blocked for robots whose poses (K, 3) hold at odometry (3,)."""
        begin, end = np.searchsorted(self._piece, [first, last])
        if begin >= end or not len(poses):
            return np.zeros(len(poses))
        map_from_odom = se2.compose(poses, se2.inverse(odom_from_base))
        points = se2.transform_points(map_from_odom[:, None], np.array(self._points[begin:end]))
        starts = np.flatnonzero(np.diff(self._piece[begin:end], prepend=-1))
        return np.logical_or.reduceat(~is_free(points), starts, axis=1).sum(axis=1).astype(float)
