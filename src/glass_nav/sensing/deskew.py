"""A scan measured while the robot moves -> the same scan seen from one place.

A lidar takes its beams one after the other, the first at the scan's stamp. At 1 rad/s and a turn of 50 ms the last one
points 3 degrees away from where its angle says. Odometry between the beams tells by how much. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.sensing.scan import Scan

KNOT_S = 0.01  # odometry is looked up so often in a turn and interpolated in between
LONGEST_TURN_S = 1.0  # no 2D lidar turns slower; drivers that write another unit do
_SLACK = 1.5  # scan_time may be a rounded figure of a data sheet


@dataclass(frozen=True)
class Deskew:
    """Whether it is done."""

    deskew: bool = True


def turn_ns(beams: int, time_increment_s: float) -> int:
    """From the first beam to the last one [ns]; 0 where nothing is told."""
    if not (np.isfinite(time_increment_s) and time_increment_s > 0.0):
        return 0
    turn_s = time_increment_s * max(beams - 1, 0)
    return round(turn_s * 1e9) if turn_s <= LONGEST_TURN_S else 0


def fault(beams: int, time_increment_s: float, scan_time_s: float) -> Optional[str]:
    """Why time_increment cannot be what a driver means; None if it can, or says nothing."""
    if time_increment_s == 0.0:
        return None
    if not (np.isfinite(time_increment_s) and time_increment_s > 0.0):
        return f"time_increment must be finite and >= 0 s, got {time_increment_s}"
    turn_s = time_increment_s * max(beams - 1, 0)
    most_s = min(_SLACK * scan_time_s, LONGEST_TURN_S) if scan_time_s > 0.0 else LONGEST_TURN_S
    if turn_s > most_s:
        return (
            f"time_increment {time_increment_s:g} s times {beams} beams makes {turn_s:.3g} s, the most for one "
            f"turn is {most_s:.3g} s"
        )
    return None


def knots_ns(stamp_ns: int, whole_ns: int) -> np.ndarray:
    """(K,) stamps over a turn at which odometry is needed, its first and its last beam's included."""
    count = 1 + max(1, int(np.ceil(whole_ns * 1e-9 / KNOT_S)))
    return stamp_ns + np.rint(np.linspace(0.0, whole_ns, count)).astype(np.int64)


def straightened(scan: Scan, odom_from_base: Trajectory) -> Scan:
    """The scan as if all beams had been measured at its stamp; the end of each stays where it was in the room.

    Args:
        scan: as measured, its beams time_increment_s apart.
        odom_from_base: odometry over the turn.
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
