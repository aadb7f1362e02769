"""Pose of the filter, scan -> the pose at which the scan lies on the wall segments of the map.

The correction of segment_correction.py in a narrow neighbourhood, by the beams that ended at walls. A pose that would
move further than the filter's own spread allows is left as it is, and so is a direction that no wall constrains. The
formulation is ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.geometry import angles
from glass_nav.localization.particle_filter.pose_estimate import PoseEstimate
from glass_nav.localization.segments.segment_correction import SegmentCorrectionParams, SegmentCorrector
from glass_nav.world import wall_segments
from glass_nav.world.grid_map import GridMap

_NEIGHBOURHOOD_M, _ITERATIONS = 0.15, 6  # the pose is nearly right: the filter has aligned the scan
_SIGMAS = 3.0
_MIN_REACH = np.array([0.05, 0.05, np.radians(1.0)])  # [m, m, rad]: of a filter that is very sure
_MIN_ENDS = 20
_MIN_INLIERS = 0.5  # of these, that must lie on segments: a map of chairs and bushes has few


@dataclass(frozen=True)
class Polish:
    """Whether poses are polished."""

    polish_with_segments: bool = False


class SegmentPolish:
    """The walls of one map."""

    def __init__(self, grid_map: GridMap) -> None:
        walls = wall_segments.extract(grid_map, wall_segments.FINE_TOLERANCE_CELLS)
        self._corrector = SegmentCorrector(
            walls.segments_m, SegmentCorrectionParams(neighbourhood_m=_NEIGHBOURHOOD_M, iterations=_ITERATIONS)
        )

    def pose(self, best: PoseEstimate, ends_m: np.ndarray) -> np.ndarray:
        """(3,) polished pose of the best cluster, by end points (E, 2) of beams in the robot's frame."""
        if len(ends_m) < _MIN_ENDS:
            return best.map_from_base
        found = self._corrector.correct(ends_m, best.map_from_base)
        moved = found.map_from_base - best.map_from_base
        moved[2] = angles.wrap(moved[2])
        reach = np.maximum(_SIGMAS * np.sqrt(np.maximum(np.diag(best.covariance), 0.0)), _MIN_REACH)
        if found.after.inlier_share < _MIN_INLIERS or np.any(np.abs(moved) > reach):
            return best.map_from_base
        return found.map_from_base
