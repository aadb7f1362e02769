"""When tf map -> odom is sent, and with which stamp, from scans and corrections as they arrive.

Navigation asks tf for the present and does not wait. So the last correction is sent again as soon as a scan arrives,
before the filter has processed it, and the new correction follows when it is computed. Each transform is stamped
ahead of its scan by `transform_tolerance`, as by AMCL. It is stamped further ahead if the tolerance would end before
the transform of the next scan reaches the listeners, as with ten scans per second and a tolerance of 0.1 s, on a busy
machine, or with a slow lidar. No stamp is sent twice: a correction applies from the end of the transforms sent
before, and never changes one that a listener may have used.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

_STEP_NS = 1_000  # between two stamps: Python's tf2 reads them as doubles, whose steps are 240 ns wide today
_JUMP_NS = 1_000_000_000  # stamps that go back by more are of a clock that was set back
_MARGIN_NS = 50_000_000  # wanted from the arrival of a scan to the end of the last transform: the next may be late
_LATEST_NS = 500_000_000  # scans that come later than that are not expected again: they had stopped
_ADDED_KEPT = 0.998  # how much of what was added is left at the next scan
_AHEAD_NS = 500_000_000  # a scan stamped further in the future has a wrong clock, and tf would keep its stamp


@dataclass(frozen=True)
class StampedTransform:
    """A transform to be sent on tf."""

    stamp_ns: int
    map_from_odom: np.ndarray  # (3,) x [m], y [m], yaw [rad]


class MapToOdom:
    """Remembers the last correction, and the last stamp."""

    def __init__(self) -> None:
        self._map_from_odom: Optional[np.ndarray] = None
        self._last_scan_ns = 0
        self._last_sent_ns = 0
        self._added_ns = 0.0  # added to the tolerance

    def start_over(self) -> None:
        """The pose is no longer known, and the clock may have been set back."""
        self._map_from_odom = None
        self._last_scan_ns = 0

    def arrived(self, scan_ns: int, now_ns: int, tolerance_ns: int) -> Optional[StampedTransform]:
        """A scan has come: the last correction again, if there is one. Not for a scan older than another."""
        if self._map_from_odom is None or not self._last_scan_ns < scan_ns <= now_ns + _AHEAD_NS:
            return None
        self._added_ns *= _ADDED_KEPT
        left_ns = self._last_sent_ns - now_ns
        if -_LATEST_NS < left_ns < _MARGIN_NS // 2:
            self._added_ns += _MARGIN_NS - left_ns
        return self._stamped(scan_ns, tolerance_ns, self._map_from_odom)

    def corrected(self, scan_ns: int, map_from_odom: np.ndarray, tolerance_ns: int) -> Optional[StampedTransform]:
        """The filter's answer to a scan (3,); None if it is what was sent when the scan came."""
        before = self._map_from_odom
        is_sent = before is not None and scan_ns <= self._last_scan_ns and np.array_equal(map_from_odom, before)
        self._map_from_odom = np.array(map_from_odom, float)
        return None if is_sent else self._stamped(scan_ns, tolerance_ns, self._map_from_odom)

    def _stamped(self, scan_ns: int, tolerance_ns: int, map_from_odom: np.ndarray) -> StampedTransform:
        if self._last_scan_ns == 0 and scan_ns + tolerance_ns < self._last_sent_ns - _JUMP_NS:
            self._last_sent_ns = 0
        self._last_scan_ns = max(scan_ns, self._last_scan_ns)
        ahead_ns = tolerance_ns + min(round(self._added_ns), _LATEST_NS)
        self._last_sent_ns = max(scan_ns + ahead_ns, self._last_sent_ns + _STEP_NS)
        return StampedTransform(self._last_sent_ns, map_from_odom)
