"""Finds all places of the map where a scan fits, in slices over several scans.

Matching a scan against every pose of a large map takes longer than a robot may wait for its pose. So the search
continues a little with each later scan, and odometry moves the places found to the present. A slice is a number of
look-ups in the map, not a time, so that a replay gives the same result; it is smaller if scans follow each other
quickly. K places, B beams.
"""

from __future__ import annotations

from typing import List, Optional

import numpy as np

from glass_nav.geometry import se2
from glass_nav.hypotheses import pose_tracker, scan_alignment
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.sensing.distance_field import DistanceField

_STARTS = 4000  # poses that the matcher proposes
_SLIDE_M = 0.6  # that an alignment may move one; farther away it is another place
_SLICE = 20_000_000  # look-ups of the matcher: about 40 ms
_PERIOD_S = 0.1  # from scan to scan, for which that is; where there is less time, the slice is smaller
_LEAST_SHARE = 0.05  # of a slice: two lidars may have one stamp
_CACHED_CELLS = 1_000_000  # a look-up in a larger map takes about three times as long
_LOOK_UPS_PER_BEAM = 30  # that the alignment of one beam costs as much as


class PlaceSearch:
    """advance() with every scan until it is complete; then there are places()."""

    def __init__(
        self,
        matcher: ScanMatcher,
        field: DistanceField,
        points_m: np.ndarray,
        odom_from_base: np.ndarray,
        max_behind: float = 1.0,
    ) -> None:
        """
        Args:
            matcher: of the whole map or a part.
            field: of the map.
            points_m: (B, 2) finite end points of the scan's beams in the robot's frame.
            odom_from_base: (3,) odometry at the scan.
            max_behind: how far the matcher's score of a place, 0..1, may be behind that of the best.
        """
        self._field, self._points_m = field, points_m
        self._odom_from_base = np.array(odom_from_base, float)
        self._slice = _SLICE if matcher.cell_count <= _CACHED_CELLS else _SLICE // 3
        self._matching = matcher.begin(points_m, _STARTS, max_behind)
        self._matched = False
        self._starts = np.zeros((0, 3))  # still to be aligned
        self._aligned: List[np.ndarray] = []  # (N, 3) poses
        self._fits: List[np.ndarray] = []  # (N,) of them

    def advance(self, period_s: Optional[float] = None) -> bool:
        """Search one slice; returns whether the search is complete.

        Args:
            period_s: from the scan before to this one; None: not known.
        """
        share = 1.0 if period_s is None else min(max(period_s / _PERIOD_S, _LEAST_SHARE), 1.0)
        left = int(share * self._slice)
        if not self._matched:
            before = self._matching.look_ups
            self._matched = self._matching.advance(left)
            left -= self._matching.look_ups - before
            if not self._matched:
                return False
            starts = self._matching.places.poses
            self._starts = starts[pose_tracker.first_of_each_cell(starts)]
        count = max(1, left // (_LOOK_UPS_PER_BEAM * len(self._points_m)))
        self._align(self._starts[:count])
        self._starts = self._starts[count:]
        return not len(self._starts)

    def places(self, odom_from_base: np.ndarray) -> np.ndarray:
        """(K, 3) poses of the robot now, at that odometry (3,): the best first, each place once."""
        poses = np.concatenate(self._aligned)[np.argsort(-np.concatenate(self._fits), kind="stable")]
        poses = poses[pose_tracker.first_of_each_cell(poses)]
        return se2.compose(poses, se2.compose(se2.inverse(self._odom_from_base), odom_from_base))

    def _align(self, starts: np.ndarray) -> None:
        found = scan_alignment.align(self._field, self._points_m, starts)
        near = np.hypot(*(found.poses[:, :2] - starts[:, :2]).T) < _SLIDE_M
        self._aligned.append(found.poses[near])
        self._fits.append(found.fit[near])
