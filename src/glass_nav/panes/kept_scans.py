"""A bounded memory of scans at trusted poses: the newest for each place and heading of the robot.

Each scan is kept on a fixed circle of directions, whatever the lidar. S scans, D directions.
"""

from __future__ import annotations

from typing import Dict, Optional, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.sensing.scan import Scan

DIRECTIONS = 720
STEP_RAD = 2.0 * np.pi / DIRECTIONS
NO_BEAM = np.float32(np.nan)
_HEADINGS = 8
_FIRST_ROOM = 64


class KeptScans:
    """Ranges along a circle of directions, with where the laser was."""

    def __init__(self, spacing_m: float, most: int) -> None:
        """
        Args:
            spacing_m: edge of the square in which one scan is kept for each of eight headings.
            most: scans; beyond, the oldest is replaced.
        """
        self._spacing_m, self._most = spacing_m, most
        self._row_of: "Dict[Tuple[int, int, int], int]" = {}  # oldest first
        self._laser = np.zeros((_FIRST_ROOM, 3))
        self._max = np.zeros(_FIRST_ROOM)
        self._measured = np.zeros((_FIRST_ROOM, DIRECTIONS), np.float32)
        self._mapped = np.zeros((_FIRST_ROOM, DIRECTIONS), np.float32)
        self._beams_of: "Dict[str, Tuple[np.ndarray, np.ndarray, np.ndarray]]" = {}  # angles, beams, directions by lidar

    def __len__(self) -> int:
        return len(self._row_of)

    @property
    def map_from_laser(self) -> np.ndarray:
        """(S, 3)"""
        return self._laser[: len(self)]

    @property
    def range_max_m(self) -> np.ndarray:
        """(S,) of the lidar"""
        return self._max[: len(self)]

    @property
    def measured_m(self) -> np.ndarray:
        """(S, D) range of the beam nearest to each direction, REP 117; NaN: no beam."""
        return self._measured[: len(self)]

    @property
    def mapped_m(self) -> np.ndarray:
        """(S, D) range to the first mapped surface along that beam, inf: none; NaN: no beam."""
        return self._mapped[: len(self)]

    def keep(self, scan: Scan, map_from_base: np.ndarray, mapped_m: np.ndarray) -> int:
        """The row that holds the scan from now on.

        Args:
            scan: one revolution of a lidar.
            map_from_base: (3,) trusted pose at its stamp.
            mapped_m: (B,) ranges to the first mapped surface along its beams.
        """
        laser = se2.compose(map_from_base, scan.base_from_laser)
        row = self._row(laser)
        self._laser[row], self._max[row] = laser, scan.range_max_m
        beams, direction = self._beams(scan)
        for kept, values in ((self._measured, scan.ranges_m), (self._mapped, mapped_m)):
            kept[row] = NO_BEAM
            kept[row, direction] = values[beams]
        return row

    def _beams(self, scan: Scan) -> Tuple[np.ndarray, np.ndarray]:
        """As nearest_beams(); the angles are nearly always those of the last scan of the lidar."""
        if scan.lidar in self._beams_of:
            angles_rad, beams, direction = self._beams_of[scan.lidar]
            if np.array_equal(angles_rad, scan.angles_rad):
                return beams, direction
        beams, direction = nearest_beams(scan.angles_rad)
        self._beams_of[scan.lidar] = scan.angles_rad, beams, direction
        return beams, direction

    def _row(self, laser: np.ndarray) -> int:
        column, line = np.floor(laser[:2] / self._spacing_m).astype(int)
        key = int(column), int(line), int(np.floor(laser[2] / (2.0 * np.pi) * _HEADINGS)) % _HEADINGS
        row: Optional[int] = self._row_of.pop(key, None)
        if row is None and len(self) >= self._most:
            row = self._row_of.pop(next(iter(self._row_of)))
        if row is None:
            row = len(self)
            if row == len(self._laser):
                self._laser, self._max, self._measured, self._mapped = (
                    np.concatenate([kept, np.zeros_like(kept)])
                    for kept in (self._laser, self._max, self._measured, self._mapped)
                )
        self._row_of[key] = row
        return row


def nearest_beams(angles_rad: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Beams and directions (N,) that belong together: of each direction the nearest beam, if it is no farther than
    half way to the next.
    """
    around = np.mod(angles_rad, 2.0 * np.pi)
    order = np.argsort(around, kind="stable")
    around = around[order]
    spacing = float(np.median(np.diff(around))) if len(around) > 1 else 0.0
    circle = np.arange(DIRECTIONS) * STEP_RAD
    after = np.searchsorted(around, circle) % len(around)
    before = after - 1  # of the first beam the last one
    away_after, away_before = (np.abs(angles.wrap(around[at] - circle)) for at in (after, before))
    nearest = np.where(away_after <= away_before, after, before)
    found = np.flatnonzero(np.minimum(away_after, away_before) <= 0.51 * max(spacing, STEP_RAD))
    return order[nearest[found]], found


def direction_of(bearing_rad: np.ndarray) -> np.ndarray:
    """(...) index of the direction nearest to a bearing in the laser's frame."""
    return np.rint(np.mod(bearing_rad, 2.0 * np.pi) / STEP_RAD).astype(int) % DIRECTIONS


def moved(before: np.ndarray, now: np.ndarray) -> Tuple[float, float]:
    """Distance [m] and turn [rad] between two poses (3,)."""
    return float(np.hypot(*(now[:2] - before[:2]))), float(abs(angles.wrap(now[2] - before[2])))
