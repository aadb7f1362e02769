"""Follows many poses by odometry and scans: duplicates are merged, the best comes first.

Common to GlobalSearch and PoseBelief, whose scores are log likelihoods. K poses.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from glass_nav.geometry import angles, se2

_SAME_CELL = np.array([0.3, 0.3, 0.15])  # poses in one cell are one [m, m, rad]
_SAME_PLACE_M, _SAME_PLACE_RAD = 0.7, 0.25  # poses nearer than this are no rivals


class PoseTracker:
    """Carries poses by odometry and keeps the best of those that have become one; what a pose scored is its owner's."""

    def __init__(self, max_behind: float, max_poses: int) -> None:
        """
        Args:
            max_behind: a pose whose score is further behind the best is dropped.
            max_poses: that are kept.
        """
        self.poses = np.zeros((0, 3))  # (K, 3) map_from_base
        self._max_behind, self._max_poses = max_behind, max_poses
        self._odom_from_base: Optional[np.ndarray] = None

    def __len__(self) -> int:
        return len(self.poses)

    def carry(self, odom_from_base: np.ndarray) -> Optional[np.ndarray]:
        """Move all poses by odometry since the last call.

        Returns:
            (3,) the step, in the robot's frame before it; None at the first call, which moves nothing.
        """
        before, self._odom_from_base = self._odom_from_base, np.array(odom_from_base, float)
        if before is None:
            return None
        step = se2.compose(se2.inverse(before), odom_from_base)
        self.poses = se2.compose(self.poses, step)
        return step

    def add(self, poses: np.ndarray) -> None:
        """Add poses (N, 3) after those that are followed."""
        self.poses = np.concatenate([self.poses, poses])

    def keep_distinct(self, score: np.ndarray, has_chance: Optional[np.ndarray] = None) -> np.ndarray:
        """Merge poses that have become one, and keep those that have a chance, best first.

        Args:
            score: (K,) of the poses, more is better.
            has_chance: (K,) bool: poses that are kept however far their score is behind; None: there are none.

        Returns:
            Indices of the poses that are kept, in their new order.
        """
        order = np.argsort(-score, kind="stable")
        kept = score >= score.max(initial=-np.inf) - self._max_behind
        order = order[(kept if has_chance is None else kept | has_chance)[order]]
        chosen = order[first_of_each_cell(self.poses[order])][: self._max_poses]
        self.poses = self.poses[chosen]
        return chosen


def same_place(poses: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """(K,) bool: poses (K, 3) so near to a pose (3,) that they are no rivals of it."""
    return (np.hypot(*(poses[:, :2] - pose[:2]).T) < _SAME_PLACE_M) & (
        np.abs(angles.wrap(poses[:, 2] - pose[2])) < _SAME_PLACE_RAD
    )


def lead(pose: np.ndarray, score: float, poses: np.ndarray, scores: np.ndarray) -> float:
    """Score of a pose (3,) minus that of its best rival among poses (K, 3) with scores (K,); inf without a rival."""
    return float(score - scores[~same_place(poses, pose)].max(initial=-np.inf))


def first_of_each_cell(poses: np.ndarray) -> np.ndarray:
    """Ascending indices of the poses (K, 3) that are the first in their cell, yaw wrapped."""
    cells = np.round(np.column_stack([poses[:, :2], angles.wrap(poses[:, 2])]) / _SAME_CELL).astype(np.int64)
    # One number for each cell: unique rows take ten times as long.
    return np.sort(np.unique(cells @ [2**32, 2**8, 1], return_index=True)[1])
