"""A map worked by hand for beliefs over poses: where it explains how much of a scan is given as a function."""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np

from glass_nav.geometry import se2
from glass_nav.hypotheses.scan_explanation import BeamsExplained
from glass_nav.sensing.scan import Scan

BEAMS = 80  # each shows a piece of wall of its own


def scan(stamp_ns: int = 0) -> Scan:
    """One of the map's."""
    return Scan(stamp_ns, np.ones(3), np.zeros(3), 0.1, 10.0, np.zeros(3))


class Places:
    """A search that is complete at once."""

    def __init__(self, poses: np.ndarray) -> None:
        self._poses = poses

    def advance(self) -> bool:
        return True

    def places(self, odom_from_base: np.ndarray) -> np.ndarray:
        return se2.compose(self._poses, odom_from_base)


class MadeScans:
    """Of each scan the map explains a share that depends on the pose; poses do not slide."""

    def __init__(self, share: Callable[[np.ndarray], np.ndarray], proposed: np.ndarray) -> None:
        """
        Args:
            share: poses (K, 3) -> (K,) share of the beams that the map explains.
            proposed: (N, 3) where the robot began, as a search finds it.
        """
        self.share, self.proposed = share, np.asarray(proposed, float)
        self.judged = 0  # poses
        self.free: Callable[[np.ndarray], np.ndarray] = lambda points_m: np.ones(points_m.shape[:-1], bool)

    def search(self, scan: Scan, odom_from_base: np.ndarray) -> Optional[Places]:
        return Places(self.proposed) if scan.answered.any() else None

    def beams(self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float) -> Optional[BeamsExplained]:
        if not scan.answered.any():
            return None
        self.judged += len(map_from_base)
        side = np.array([1.0, -1.0])[np.arange(BEAMS) % 2]  # two walls, 3 m beside the robot, of pieces 1 m long
        ends_m = np.column_stack([np.arange(BEAMS) // 2 - 0.25 * BEAMS, 3.0 * side])
        order = (np.arange(BEAMS) * 7) % BEAMS  # what is explained is spread over the walls
        explained = order < np.rint(self.share(map_from_base) * BEAMS)[:, None]
        contradicted_at = np.where(explained, np.nan, 1.0)
        return BeamsExplained(np.array(map_from_base), ends_m, explained, np.ones_like(explained), contradicted_at)

    def is_free(self, points_m: np.ndarray) -> np.ndarray:
        return self.free(points_m)

    def seen_from(self, map_from_base: np.ndarray) -> Scan:
        return scan()
