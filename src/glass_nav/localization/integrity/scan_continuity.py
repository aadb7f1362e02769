"""Detects from two consecutive scans and odometry that the robot was moved without driving.

A robot that is carried to a place that looks like the one it left cannot notice it by the map: among equal doors,
scans fit as well as before. But what it sees changes at once: there are surfaces where the lidar looked through a
moment ago, and the other way round. Surfaces are counted and not beams, since a person nearby covers many beams while
everything else stays. Some surfaces always contradict each other: people, edges of objects, and more so glass; the
usual number is learnt. Odometry may have missed a part of the motion, so the scans are also compared with the motion
of the tracked pose. A break counts only if the next scan contradicts the one before it as well, because a crowd in
front of the lidar makes a single scan look like another place. The formulation is ours. P pieces of surfaces, B beams.
"""

from __future__ import annotations

from typing import NamedTuple, Optional

import numpy as np

from glass_nav.geometry import se2
from glass_nav.sensing.scan import Scan, one_of_each_piece

_TOLERANCE_M, _TOLERANCE_SHARE = 0.15, 0.03  # of a range: nearer than that to what was seen is no contradiction
_TOLERANCE_RAD = 0.035  # of a bearing, odometry's error included
_MIN_BEAMS = 20  # with fewer a scan is no evidence
_MEMORY_SCANS = 20.0  # that what is usual is averaged over
_MIN_SCANS = 5  # before anything is unusual
_BREAK = (0.05, 5.0)  # above the usual share of contradictions, as such and in mean deviations
_TURNS_RAD = (-0.05, 0.05, -0.1, 0.1, -0.2, 0.2)  # that odometry may have missed
_MAX_STEP_M = 1.0  # farther apart two scans need not have anything in common


class Sweep:
    """What a scan says about where there are surfaces, and where there are none."""

    def __init__(self, scan: Scan) -> None:
        self.base_from_laser = scan.base_from_laser
        pieces = one_of_each_piece(scan)
        ranges_m, bearings = scan.ranges_m[pieces], scan.angles_rad[pieces]
        self.ends_m = np.column_stack(
            [ranges_m * np.cos(bearings), ranges_m * np.sin(bearings)]
        )  # (P, 2) from the lidar
        answered = scan.answered
        order = np.argsort(scan.angles_rad[answered])
        self.beams_rad = scan.angles_rad[answered][order]  # (B,) ascending, of all that returned
        self.ranges_m = scan.ranges_m[answered][order]  # (B,)


class _View(NamedTuple):
    lidar: str
    sweep: Sweep
    odom_from_base: np.ndarray  # (3,) odometry at the scan
    map_from_base: np.ndarray  # (3,) tracked pose after it


class ScanContinuity:
    """Compares each scan with the one before it."""

    def __init__(self) -> None:
        self._last: Optional[_View] = None
        self._before: Optional[_View] = None  # the one before a break that the next scan may confirm
        self._usual, self._deviation, self._scans = 0.0, 0.0, 0

    def observe(self, scan: Scan, odom_from_base: np.ndarray, map_from_base: np.ndarray) -> bool:
        """Whether this scan and the last one both contradict the one before them far more than scans usually do.

        Args:
            scan: one revolution of a lidar.
            odom_from_base: (3,) odometry at its stamp.
            map_from_base: (3,) the tracked pose after it.
        """
        if np.count_nonzero(scan.answered) < _MIN_BEAMS:
            return False
        now = _View(scan.lidar, Sweep(scan), np.array(odom_from_base, float), np.array(map_from_base, float))
        before, last = self._before, self._last
        self._before, self._last = None, now
        excess = -np.inf if last is None else self._excess(last, now)
        confirmed = before is not None and self._excess(before, now) > self._limit
        if (
            before is None and excess > self._limit
        ):  # else the last scan was the odd one, which contradicts both its sides
            self._before = last
        if np.isfinite(excess):
            self._learn(excess)
        return confirmed

    @property
    def _limit(self) -> float:
        """Limit of the excess; inf until the usual one is known."""
        return max(_BREAK[0], _BREAK[1] * self._deviation) if self._scans >= _MIN_SCANS else np.inf

    def _excess(self, before: _View, after: _View) -> float:
        """Share of contradictions above the usual one; -inf: the two cannot be compared."""
        step = se2.compose(se2.inverse(before.odom_from_base), after.odom_from_base)
        if before.lidar != after.lidar or se2.travelled(step)[0] > _MAX_STEP_M:
            return -np.inf
        least = np.inf
        tracked = se2.compose(se2.inverse(before.map_from_base), after.map_from_base)
        for each in (step, tracked, *(step + [0.0, 0.0, turn_rad] for turn_rad in _TURNS_RAD)):
            least = min(least, contradictions(before.sweep, after.sweep, each) - self._usual)
            if least <= self._limit:  # explained
                break
        return least

    def _learn(self, excess: float) -> None:
        self._scans += 1
        weight = 1.0 / min(self._scans, _MEMORY_SCANS)
        self._usual += weight * excess
        self._deviation += weight * (abs(excess) - self._deviation)


def contradictions(before: Sweep, after: Sweep, step: np.ndarray) -> float:
    """Of the pieces of surfaces that two scans, taken a step (3,) apart, met: the share that the other looked through."""
    before_from_after = se2.compose(
        se2.inverse(before.base_from_laser), se2.compose(np.asarray(step, float), after.base_from_laser)
    )
    seen = _looked_through(before, after.ends_m, before_from_after)
    missed = _looked_through(after, before.ends_m, se2.inverse(before_from_after))
    return float(np.concatenate([seen, missed]).mean())


def _looked_through(sweep: Sweep, points_m: np.ndarray, laser_from_points: np.ndarray) -> np.ndarray:
    """(N,) bool: all beams of the scan that pass close to a point (N, 2) end behind it."""
    points_m = se2.transform_points(laser_from_points, points_m)
    range_m = np.hypot(points_m[:, 0], points_m[:, 1])
    bearing = np.arctan2(points_m[:, 1], points_m[:, 0])
    start_rad = sweep.beams_rad[0]
    turned = start_rad + np.mod(bearing - start_rad + _TOLERANCE_RAD, 2.0 * np.pi) - _TOLERANCE_RAD
    first = np.searchsorted(sweep.beams_rad, turned - _TOLERANCE_RAD)
    last = np.searchsorted(sweep.beams_rad, turned + _TOLERANCE_RAD)
    nearest_m = _minimum_between(sweep.ranges_m, first, last)
    return np.isfinite(nearest_m) & (range_m + _TOLERANCE_M + _TOLERANCE_SHARE * range_m < nearest_m)


def _minimum_between(values: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """(N,) least of values[first:last]; inf where that is empty."""
    padded = np.append(values, [np.inf, np.inf])
    least = np.minimum.reduceat(padded, np.column_stack([first, np.maximum(last, first + 1)]).ravel())[::2]
    return np.where(last > first, least, np.inf)
