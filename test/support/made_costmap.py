"""A local costmap as costmap_2d's obstacle layer keeps it, from scans with exact transforms. B beams."""

from __future__ import annotations

import numpy as np

from glass_nav.geometry import se2

OBSTACLE_M, RAYTRACE_M = 2.5, 3.0  # beams mark and clear so far
CELL_M = 0.05
HALF_M = 3.0  # it reaches so far from the robot to each side


class MadeCostmap:
    """Cells of a wide plane, of which those near the robot count."""

    def __init__(self, low_m: np.ndarray, high_m: np.ndarray) -> None:
        """Around a building between two corners (2,)."""
        self._low_m = np.asarray(low_m, float) - 5.0
        self._occupied = np.zeros(np.ceil((np.asarray(high_m) + 5.0 - self._low_m) / CELL_M).astype(int), bool)

    def update(self, map_from_laser: np.ndarray, angles_rad: np.ndarray, *scans_m: np.ndarray) -> None:
        """Clear along the beams of all scans (B,), then mark where they end; a beam without a return clears."""
        for range_m in scans_m:
            usable = ~np.isnan(range_m) & (range_m > 0.0)
            free_m = np.minimum(range_m[usable], RAYTRACE_M)
            steps = np.arange(0.0, RAYTRACE_M, CELL_M / 2.0)
            along = np.where(steps < free_m[:, None] - CELL_M, steps, 0.0)
            self._occupied[self._cells(map_from_laser, angles_rad[usable, None], along)] = False
        for range_m in scans_m:
            marks = np.isfinite(range_m) & (range_m <= OBSTACLE_M) & (range_m > 0.0)
            self._occupied[self._cells(map_from_laser, angles_rad[marks], range_m[marks])] = True

    def occupied_m(self, map_from_base: np.ndarray) -> np.ndarray:
        """(C, 2) centres of the occupied cells that the rolling window holds."""
        centres = (np.argwhere(self._occupied) + 0.5) * CELL_M + self._low_m
        return centres[(np.abs(centres - map_from_base[:2]) < HALF_M).all(axis=1)]

    def _cells(
        self, map_from_laser: np.ndarray, angle_rad: np.ndarray, range_m: np.ndarray
    ) -> "tuple[np.ndarray, ...]":
        ends = np.stack(np.broadcast_arrays(np.cos(angle_rad) * range_m, np.sin(angle_rad) * range_m), axis=-1)
        at_m = se2.transform_points(map_from_laser, ends.reshape(-1, 2))
        return tuple(np.floor((at_m - self._low_m) / CELL_M).astype(int).T)
