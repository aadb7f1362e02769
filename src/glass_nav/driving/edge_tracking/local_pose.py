"""The pose of the robot in the local map, without the drift of odometry over a few metres.

Each scan is registered to the walls of the local map as it was when its graph was made, with odometry as the prior.
So walls stay thin, and edges have their true length. The frame is called local; it drifts from odom by the error of
odometry.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from glass_nav.geometry import se2
from glass_nav.hypotheses import scan_alignment
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

_BEAMS = 180  # of a scan that are used
_MIN_BEAMS = 30  # that end near walls of the map
_KNOWN_M = 0.3  # so near
_HELD_PER_M2, _HELD_PER_RAD2 = 40.0, 40.0  # how firmly odometry holds, in beams
_FIRST_M, _LAST_M = 0.1, 0.05  # scales of the alignment
_MAX_M = 0.15  # it corrects no more at once: that would be another place


class LocalPose:
    """local_from_odom, corrected with every scan."""

    def __init__(self) -> None:
        self.local_from_odom = np.zeros(3)
        self._field: Optional[DistanceField] = None

    def clear(self) -> None:
        """Begin anew: local is odom."""
        self.local_from_odom, self._field = np.zeros(3), None

    def now(self, odom_from_base: np.ndarray) -> np.ndarray:
        """(3,) local_from_base."""
        return se2.compose(self.local_from_odom, odom_from_base)

    def know(self, walls: GridMap) -> None:
        """The walls that scans are held against from now on; the map is in the frame local."""
        self._field = DistanceField(walls, 1.0) if walls.occupied.any() else None

    def correct(self, scan: Scan, odom_from_base: np.ndarray) -> np.ndarray:
        """(3,) local_from_base at a scan, as far as its beams and odometry's pose (3,) determine it."""
        predicted = self.now(odom_from_base)
        if self._field is None:
            return predicted
        points = scan.points_in_base()
        points = points[np.isfinite(points).all(axis=1)]
        there = se2.transform_points(predicted, points)
        points = points[self._field.distance(there[:, 0], there[:, 1]) < _KNOWN_M]
        if len(points) < _MIN_BEAMS:
            return predicted
        points = points[:: max(len(points) // _BEAMS, 1)]
        held = np.diag([_HELD_PER_M2, _HELD_PER_M2, _HELD_PER_RAD2])
        aligned = scan_alignment.align_near(self._field, points, predicted[None], held, 3, _FIRST_M, _LAST_M)[0]
        if float(np.hypot(*(aligned[:2] - predicted[:2]))) > _MAX_M:
            return predicted
        self.local_from_odom = se2.compose(aligned, se2.inverse(odom_from_base))
        return aligned
