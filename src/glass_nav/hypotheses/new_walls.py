"""The pieces of wall that a scan shows for the first time.

The same observation is not new evidence in later scans: one cupboard that was moved contradicts the true pose in
every scan, and two parallel walls support a wrong pose in every scan. So each piece of wall counts once, however
often it is seen. B beams, S pieces.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np

from glass_nav.geometry import se2

PIECE_M = 0.5  # of a wall: one piece of evidence
_SAME_M, _DRIFT_SHARE = 0.4, 0.03  # a piece nearer to one that was seen is the same; more per metre driven since


def pieces(ends_m: np.ndarray) -> np.ndarray:
    """(B,) pieces of wall that beams with these ends (B, 2) show: those that end on one piece share it."""
    if not len(ends_m):  # numpy 1.17 cannot take unique rows of none
        return np.zeros(0)
    cells = np.round(ends_m / PIECE_M).astype(np.int64)
    _, piece, beams = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    return 1.0 / beams[piece.reshape(-1)]  # numpy 2.0 gives the inverse another shape


class NewWalls:
    """Remembers what was seen, in the frame of odometry."""

    def __init__(self) -> None:
        self._seen = np.zeros((0, 3))  # (S, 3) x, y, distance driven when it was seen

    def of(self, ends_m: np.ndarray, odom_from_base: np.ndarray, driven_m: float) -> np.ndarray:
        """How many pieces of wall each beam is the first to show.

        Args:
            ends_m: (B, 2) of the beams, in the robot's frame.
            odom_from_base: (3,) odometry at the scan.
            driven_m: distance driven until then.

        Returns:
            (B,) the beams that end on one new piece share it: their weights have the sum 1; 0 on a piece seen before.
        """
        at, new = self._new(ends_m, odom_from_base, driven_m)
        count = np.zeros(len(at))
        count[new] = pieces(at[new])
        return count

    def add(self, ends_m: np.ndarray, odom_from_base: np.ndarray, driven_m: float) -> None:
        """Mark the pieces of wall of a scan as seen."""
        at, new = self._new(ends_m, odom_from_base, driven_m)
        self._seen = np.concatenate([self._seen, np.column_stack([at[new], np.full(len(new), driven_m)])])

    def _new(self, ends_m: np.ndarray, odom_from_base: np.ndarray, driven_m: float) -> Tuple[np.ndarray, np.ndarray]:
        """(B, 2) where the beams end, and the indices of those that end where no beam ended before."""
        at = se2.transform_points(odom_from_base, ends_m)
        off_m = np.hypot(at[:, None, 0] - self._seen[:, 0], at[:, None, 1] - self._seen[:, 1])
        near_m = _SAME_M + _DRIFT_SHARE * (driven_m - self._seen[:, 2])
        return at, np.flatnonzero(~(off_m < near_m).any(axis=1))
