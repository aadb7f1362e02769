"""The motion of the lidar between two scans, without a map and without trusting odometry.

The later scan is laid over the earlier one at every offset and turn of a grid, and the best is refined (correlative
scan matching, Olson (2009), then scan_alignment). Nothing is assumed about the direction of the motion: an odometry
with the wrong sign, or a lidar that is mounted otherwise than tf says, must not be helped. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.hypotheses import scan_alignment
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.world.grid_map import GridMap

CELL_M = 0.05
FARTHEST_M = 20.0  # of beams that are used
MAX_POINTS = 120  # of the later scan
MIN_POINTS = 30
_STEP_M, _STEP_RAD = 0.15, np.radians(4.0)
_KEEP = 16  # of the grid's best, to be refined
_MIN_FIT = 0.6  # of the beams that lie on the earlier scan
_RIVAL = 0.97  # another place that fits about as well: the motion is not known
_MIN_INFORMATION = 0.08  # of the beams that hold the least certain direction


@dataclass(frozen=True)
class Motion:
    """The later lidar's pose in the earlier one's frame."""

    earlier_from_later: np.ndarray  # (3,)
    fit: float  # 0..1


class EarlierScan:
    """A scan that others are laid over."""

    def __init__(self, points_m: np.ndarray) -> None:
        """
        Args:
            points_m: (B, 2) finite end points in the lidar's frame.
        """
        low, high = points_m.min(axis=0) - 1.0, points_m.max(axis=0) + 1.0
        columns, rows = np.ceil((high - low) / CELL_M).astype(int)
        cells = np.zeros((rows, columns), np.int8)
        column, row = np.floor((points_m - low) / CELL_M).astype(int).T
        cells[row, column] = 100
        self._field = DistanceField(GridMap(cells, CELL_M, np.array([low[0], low[1], 0.0])), max_distance_m=0.5)

    def motion_to(self, points_m: np.ndarray, reach_m: float, reach_rad: float) -> Optional[Motion]:
        """How the lidar moved until it saw points (B, 2); None where the scans do not show it.

        Args:
            points_m: finite end points in the later lidar's frame.
            reach_m, reach_rad: the most that it may have moved.
        """
        points = points_m[:: max(1, -(-len(points_m) // MAX_POINTS))]
        offsets = np.arange(-reach_m, reach_m + 1e-9, _STEP_M)
        turns = np.arange(-reach_rad, reach_rad + 1e-9, _STEP_RAD)
        coarse = points[:: max(1, len(points) // 30)]
        x0, y0 = np.meshgrid(offsets, offsets)
        near = np.hypot(x0, y0).ravel() <= reach_m
        starts = np.stack([x0.ravel()[near], y0.ravel()[near]], axis=-1)
        grid = np.concatenate([np.column_stack([starts, np.full(len(starts), turn)]) for turn in turns])
        fit = scan_alignment.fit(self._field, coarse, grid, scale_m=0.15)
        best = grid[np.argsort(-fit)[:_KEEP]]
        aligned = scan_alignment.align(self._field, points, best, first_scale_m=0.2)
        order = np.argsort(-aligned.fit)
        first = order[0]
        if aligned.fit[first] < _MIN_FIT or np.hypot(*aligned.poses[first, :2]) > reach_m + 0.2:
            return None
        off = aligned.poses - aligned.poses[first]
        elsewhere = (np.hypot(off[:, 0], off[:, 1]) > 0.1) | (np.abs(off[:, 2]) > 0.05)
        if np.any(aligned.fit[elsewhere] > _RIVAL * aligned.fit[first]):
            return None
        held = np.linalg.eigvalsh(aligned.information[first][:2, :2])[0] / len(points)
        if held < _MIN_INFORMATION:
            return None
        return Motion(aligned.poses[first], float(aligned.fit[first]))
