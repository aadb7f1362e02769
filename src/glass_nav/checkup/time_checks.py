"""Checks stamps and rates: of scans against each other, and against the clock of odometry."""

from __future__ import annotations

from typing import Dict, Iterator, List, Sequence

import numpy as np

from glass_nav.checkup.finding import Finding
from glass_nav.recording.observed import HeardScan

_REGULAR = 0.8  # of the scans come within 20 % of the usual period: then a gap is a gap
_GAP_PERIODS, _MIN_GAP_S = 5.0, 0.5
_CLOCKS_S = 0.5  # between stamps and arrival, scans against transforms
_WAVERING_S = 0.3  # of that, from scan to scan


def check_scans(topic: str, scans: Sequence[HeardScan]) -> Iterator[Finding]:
    """Findings on the stamps of one topic, in the order in which the scans were heard."""
    unstamped = sum(scan.stamp_ns == 0 for scan in scans)
    if unstamped:
        yield Finding(
            "stamps-zero",
            f"{topic}: {unstamped} of {len(scans)} scans have the stamp 0",
            "the driver must stamp each scan with the time of its first beam; scans without are not used",
        )
    by_frame: Dict[str, List[HeardScan]] = {}
    for scan in scans:
        if scan.stamp_ns:
            by_frame.setdefault(scan.frame, []).append(scan)
    for lidar in by_frame.values():
        yield from _order(topic, np.array([scan.stamp_ns for scan in lidar], np.int64))
    delays_s = np.array([scan.heard_ns - scan.stamp_ns for scan in scans if scan.stamp_ns]) * 1e-9
    if len(delays_s) >= 20 and np.subtract(*np.percentile(delays_s, [95, 5])) > _WAVERING_S:
        low, high = np.percentile(delays_s, [5, 95])
        yield Finding(
            "scan-delay",
            f"{topic}: scans come {low:.2f} to {high:.2f} s after their stamps",
            "the network or the driver holds scans back, or the driver's clock jumps: record on the "
            "robot's own computer, and keep clocks together with chrony",
        )


def _order(topic: str, stamps_ns: np.ndarray) -> Iterator[Finding]:
    apart_s = np.diff(stamps_ns) * 1e-9
    if (apart_s < 0.0).any():
        yield Finding(
            "stamps-backwards",
            f"{topic}: {int((apart_s < 0.0).sum())} scans are older than the one before, by up to "
            f"{-apart_s.min():.3f} s",
            "two drivers on one topic, a clock that is set back, or a bag that was looped: such scans are dropped",
        )
    if (apart_s == 0.0).any():
        yield Finding(
            "stamps-repeated",
            f"{topic}: {int((apart_s == 0.0).sum())} scans have the stamp of the one before",
            "each scan needs its own stamp: see how the driver stamps, and whether two publish the topic",
        )
    forward = np.diff(np.unique(stamps_ns)) * 1e-9  # whatever the order
    if len(forward) < 20:
        return
    usual = float(np.median(forward))
    gaps = forward[forward > max(_GAP_PERIODS * usual, _MIN_GAP_S)]
    if len(gaps) and np.mean(np.abs(forward - usual) < 0.2 * usual) > _REGULAR:
        yield Finding(
            "scan-gaps",
            f"{topic}: {len(gaps)} gaps of up to {gaps.max():.1f} s in scans that otherwise come every {usual:.3f} s",
            "look for dropped messages (rostopic hz on the robot, `dropped` in rosbag info, a USB lidar "
            "that reconnects); the robot is placed by odometry alone meanwhile",
        )


def check_clocks(scan_delays_s: np.ndarray, odometry_delays_s: np.ndarray) -> Iterator[Finding]:
    """Scans and odometry with different clocks.

    Args:
        scan_delays_s, odometry_delays_s: from stamps to arrival, of each message.
    """
    if not (len(scan_delays_s) and len(odometry_delays_s)):
        return
    apart_s = float(np.median(scan_delays_s) - np.median(odometry_delays_s))
    if abs(apart_s) > _CLOCKS_S:
        yield Finding(
            "clocks-differ",
            f"the stamps of the scans are {abs(apart_s):.2f} s {'behind' if apart_s > 0.0 else 'ahead of'} "
            "those of odometry",
            "lidar and robot go by different clocks: run chrony on both computers, or have the driver "
            "stamp by the computer's time; the robot is placed where it was at another time",
        )
