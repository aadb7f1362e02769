"""A scan, poses that it may come from -> how much of it the map explains from each, glass and all.

A beam is explained if it ended at one of the ranges that the five cases offer: the first surface on its way, the next
ones behind it if the walls before are thin enough for glass, or the mirrored one (seed document
glass_localization.txt). So a candidate in a building of glass is not ruled out by beams that went through panes, nor
believed because a wall is somewhere. A beam that ended where the map knows nothing, with nothing of the map on its
way, is no evidence: who drew the map did not look there. Each pose may slide to where the scan fits best first, for it
is known to a decimetre or so.
"""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np
from scipy import ndimage

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import scan_alignment
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import UNKNOWN, GridMap

_BEAMS = 120  # of a scan that are asked
_NEAR_CELLS = 3.0  # a beam that ends so near to a range that the map offers is explained
_MAX_THICK_M = 0.3  # a thicker wall is no glass
_SLIDES_M, _SLIDES_RAD = 0.5, np.radians(15.0)  # a pose that would slide further stays where it was said to be
_AT_ONCE = 64  # poses
_MIN_BEAMS = 10
_MIN_TOLD = 0.25  # of the beams that came back; where the map knows less of them it cannot judge


class ScanExplanation:
    """For one map."""

    def __init__(self, grid_map: GridMap) -> None:
        self._grid_map = grid_map
        self._caster = RayCaster(grid_map)
        self._field = DistanceField(grid_map)
        self._matcher: Optional[ScanMatcher] = None  # made when it is first asked: it takes some time on a large map
        self._near_m = _NEAR_CELLS * grid_map.resolution_m
        around = np.ones((2 * int(_NEAR_CELLS) + 1,) * 2, bool)
        self._near_unknown = ndimage.binary_dilation(grid_map.occupancy == UNKNOWN, around)  # (H, W)

    def shares(self, scan: Scan, map_from_base: np.ndarray) -> np.ndarray:
        """Of the beams that came back from where the map knows something, those that it explains.

        Args:
            scan: as it was measured.
            map_from_base: (C, 3) poses.

        Returns:
            (C,) shares in [0, 1]; NaN if too few did.
        """
        return self.fitted(scan, map_from_base, _SLIDES_M, _SLIDES_RAD)[1]

    def fitted(
        self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float
    ) -> Tuple[np.ndarray, np.ndarray]:
        """The poses where the scan fits best, and how much of it the map explains there.

        Args:
            scan: as it was measured.
            map_from_base: (C, 3) poses.
            most_m, most_rad: a pose that would slide further stays where it was said to be.

        Returns:
            (C, 3) poses, and (C,) shares in [0, 1] as of shares(); poses as given and NaN if hardly any beam came back.
        """
        beams = _telling(scan)
        if beams is None:
            return np.array(map_from_base, float), np.full(len(map_from_base), np.nan)
        points = scan.points_in_base()[beams]
        poses, shares = [np.zeros((0, 3))], [np.zeros(0)]
        for first in range(0, len(map_from_base), _AT_ONCE):
            slid = self._slid(points, map_from_base[first : first + _AT_ONCE], most_m, most_rad)
            poses.append(slid)
            shares.append(self._explained(scan, beams, points, slid))
        return np.concatenate(poses), np.concatenate(shares)

    def places(self, scan: Scan, most: int) -> np.ndarray:
        """(K, 3) poses from all over the map where the beams end near walls, K <= most, the best first; none if hardly
        any beam came back. Neighbouring ones may belong to one and the same place.
        """
        beams = _telling(scan)
        if beams is None:
            return np.zeros((0, 3))
        if self._matcher is None:
            self._matcher = ScanMatcher(self._grid_map, self._field)
        return self._matcher.search(scan.points_in_base()[beams], most).poses

    def _slid(self, points_m: np.ndarray, poses: np.ndarray, most_m: float, most_rad: float) -> np.ndarray:
        slid = scan_alignment.align(self._field, points_m, poses, last_scale_m=0.1).poses
        off = slid - poses
        kept = (np.hypot(off[:, 0], off[:, 1]) < most_m) & (np.abs(angles.wrap(off[:, 2])) < most_rad)
        return np.where(kept[:, None], slid, poses)

    def _explained(self, scan: Scan, beams: np.ndarray, points_m: np.ndarray, poses: np.ndarray) -> np.ndarray:
        hits = self._caster.cast_surfaces(
            se2.compose(poses, scan.base_from_laser),
            scan.angles_rad[beams],
            scan.range_max_m,
            max_thickness_m=_MAX_THICK_M,
        )
        measured = scan.ranges_m[beams]
        offered = np.stack([hits.first_m, hits.second_m, hits.third_m, hits.mirrored_m])  # (4, P, B)
        explained = (np.abs(offered - measured) <= self._near_m).any(axis=0)
        ends_m = np.stack([se2.transform_points(pose, points_m) for pose in poses])
        counted = explained | (hits.first_m < measured) | ~self._is_unknown(ends_m)
        count = counted.sum(axis=1)
        few = count < max(_MIN_BEAMS, _MIN_TOLD * len(beams))
        return np.where(few, np.nan, explained.sum(axis=1) / np.maximum(count, 1))

    def _is_unknown(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: the map knows nothing of points (..., 2), or of what is next to them."""
        rows, columns = self._grid_map.cells(points_m)
        inside = self._grid_map.contains(rows, columns)
        return ~inside | self._near_unknown[np.where(inside, rows, 0), np.where(inside, columns, 0)]


def _telling(scan: Scan) -> Optional[np.ndarray]:
    """(B,) indices of the beams that are asked; None: too few came back."""
    answered = np.flatnonzero(scan.answered)
    if len(answered) < _MIN_BEAMS:
        return None
    return answered[np.linspace(0, len(answered) - 1, min(_BEAMS, len(answered))).astype(int)]
