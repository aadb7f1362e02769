"""Predicted particles, scan -> the poses nearby where the scan fits: where the cases are voted on.

The seed document assumes a good prediction (assumption i). Real odometry breaks it: wheels slip, an old
log steps a metre and 10 degrees between scans, a turn of 80 degrees goes unnoticed. So the scan is
aligned from preliminary samples over the predicted spread first, and over ever wider ones when it fits
much worse than it did lately.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.geometry import angles
from glass_nav.localization import preliminary_samples, scan_alignment
from glass_nav.localization.preliminary_samples import PreliminarySamples
from glass_nav.localization.scan_alignment import Alignment
from glass_nav.sensing.distance_field import DistanceField

_START_SHAPE = PreliminarySamples(sample_count=37, sample_min_radius_m=0.12, sample_min_heading_rad=0.05,
                                  sample_max_radius_m=0.5, sample_max_heading_rad=0.35)
_KEEP = 4                     # alignments that are different places
_SAME_M, _SAME_RAD = 0.05, np.radians(1.5)
_POOR_FIT = 0.75              # of the usual fit: odometry is not believed
_WIDE_M, _WIDE_RAD = 0.8, np.pi
_WIDE_COUNT = 360
_MEMORY = 0.9
_LEAST_SCALE_M, _MOST_SCALE_M = 0.06, 0.3  # of the kernel; follows how well the map fits
_SCALE_MEDIANS = 2.0


class ScanAnchor:
    """Finds the aligned poses and remembers how well scans fit lately."""

    def __init__(self, field: DistanceField) -> None:
        self._field = field
        self._usual_fit = float("nan")
        self._scale_m = _LEAST_SCALE_M

    def find(self, mean: np.ndarray, covariance: np.ndarray, points_m: np.ndarray) -> Alignment:
        """At most 4 distinct poses, the best first.

        Args:
            mean, covariance: (3,), (3, 3) of the predicted cluster.
            points_m: (B, 2) finite end points of beams in the robot's frame, B >= 1.
        """
        starts = preliminary_samples.around(mean, covariance, _START_SHAPE)
        found = _distinct(scan_alignment.align(self._field, points_m, starts, last_scale_m=self._scale_m))
        if found.fit[0] < _POOR_FIT * self._usual_fit:
            wide = preliminary_samples.around(
                mean, np.diag([_WIDE_M, _WIDE_M, _WIDE_RAD]) ** 2 / 4.0,
                PreliminarySamples(sample_count=_WIDE_COUNT, sample_max_radius_m=_WIDE_M,
                                   sample_max_heading_rad=_WIDE_RAD))
            coarse = scan_alignment.fit(self._field, points_m, wide)
            wide = wide[np.argsort(-coarse)[:_WIDE_COUNT // 4]]
            wider = _distinct(scan_alignment.align(self._field, points_m, wide, iterations=10,
                                                     last_scale_m=self._scale_m))
            if wider.fit[0] > found.fit[0] + 0.25 * (self._usual_fit - found.fit[0]):
                found = wider
        past = found.fit[0] if np.isnan(self._usual_fit) else self._usual_fit
        self._usual_fit = _MEMORY * past + (1.0 - _MEMORY) * float(found.fit[0])
        scale = _SCALE_MEDIANS * scan_alignment.median_distance(self._field, points_m, found.poses[0])
        self._scale_m = float(np.clip(_MEMORY * self._scale_m + (1.0 - _MEMORY) * scale,
                                      _LEAST_SCALE_M, _MOST_SCALE_M))
        return found


def _distinct(aligned: Alignment) -> Alignment:
    """The best of each place, best first."""
    chosen: "list[int]" = []
    for index in np.argsort(-aligned.fit):
        off = aligned.poses[chosen] - aligned.poses[index]
        same = (np.hypot(off[:, 0], off[:, 1]) < _SAME_M) & (np.abs(angles.wrap(off[:, 2])) < _SAME_RAD)
        if not same.any() and aligned.fit[index] > 0.9 * aligned.fit.max():
            chosen.append(int(index))
        if len(chosen) == _KEEP:
            break
    return Alignment(aligned.poses[chosen], aligned.information[chosen], aligned.fit[chosen])
