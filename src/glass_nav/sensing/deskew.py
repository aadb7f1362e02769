"""Corrects a scan for the motion of the robot during the sweep.

A lidar measures its beams one after the other, the first at the scan's stamp. At 1 rad/s and with a sweep of 50 ms the
last beam points 3 degrees away from where its angle says. Odometry between the beams corrects that. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.sensing.scan import Scan

KNOT_S = 0.01  # odometry is looked up at this interval during a sweep and interpolated in between
MAX_SWEEP_S = 1.0  # no 2D lidar is slower; a longer time_increment is in another unit
_SLACK = 1.5  # scan_time may be a rounded figure of a data sheet


@dataclass(frozen=True)
class Deskew:
    """Whether scans are deskewed."""

    deskew: bool = True


def sweep_ns(beams: int, time_increment_s: float) -> int:
    """Time from the first beam to the last one [ns]; 0 if unknown."""
    if not (np.isfinite(time_increment_s) and time_increment_s > 0.0):
        return 0
    sweep_s = time_increment_s * max(beams - 1, 0)
    return round(sweep_s * 1e9) if sweep_s <= MAX_SWEEP_S else 0


def fault(beams: int, time_increment_s: float, scan_time_s: float) -> Optional[str]:
    """Why time_increment cannot be true; None if it can, or is not set."""
    if time_increment_s == 0.0:
        return None
    if not (np.isfinite(time_increment_s) and time_increment_s > 0.0):
        return f"time_increment must be finite and >= 0 s, got {time_increment_s}"
    sweep_s = time_increment_s * max(beams - 1, 0)
    max_s = min(_SLACK * scan_time_s, MAX_SWEEP_S) if scan_time_s > 0.0 else MAX_SWEEP_S
    if sweep_s > max_s:
        return f"time_increment {time_increment_s:g} s times {beams} beams is {sweep_s:.3g} s, allowed {max_s:.3g} s"
    return None


def knots_ns(stamp_ns: int, sweep_ns: int) -> np.ndarray:
    """(K,) stamps during a sweep at which odometry is needed, those of the first and the last beam included."""
    count = 1 + max(1, int(np.ceil(sweep_ns * 1e-9 / KNOT_S)))
    return stamp_ns + np.rint(np.linspace(0.0, sweep_ns, count)).astype(np.int64)


def deskewed(scan: Scan, odom_from_base: Trajectory) -> Scan:
    """The scan as if all beams had been measured at its stamp; the end point of each beam stays where it is.

    Args:
        scan: as measured, its beams time_increment_s apart.
        odom_from_base: odometry during the sweep.
    """
    later_ns = np.rint(np.arange(len(scan)) * scan.time_increment_s * 1e9).astype(np.int64)
    base_then = se2.compose(
        se2.inverse(odom_from_base.at(np.int64(scan.stamp_ns))), odom_from_base.at(scan.stamp_ns + later_ns)
    )
    laser_then = se2.compose(se2.inverse(scan.base_from_laser), se2.compose(base_then, scan.base_from_laser))
    direction_rad = scan.angles_rad + laser_then[:, 2]
    ranges_m = np.where(scan.answered, scan.ranges_m, 0.0)
    ends = laser_then[:, :2] + ranges_m[:, None] * np.stack([np.cos(direction_rad), np.sin(direction_rad)], axis=-1)
    seen_rad = direction_rad + angles.wrap(np.arctan2(ends[:, 1], ends[:, 0]) - direction_rad)
    return replace(
        scan,
        ranges_m=np.where(scan.answered, np.hypot(ends[:, 0], ends[:, 1]), scan.ranges_m),
        angles_rad=np.where(scan.answered, seen_rad, direction_rad),
        time_increment_s=0.0,
        origins_m=laser_then[:, :2],
    )
