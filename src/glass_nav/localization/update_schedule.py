"""Decides whether a scan updates the particles, by AMCL's rule, for each lidar separately."""

from __future__ import annotations

from typing import Dict, Optional, Set

import numpy as np

from glass_nav.geometry import se2
from glass_nav.localization.localizer_params import Schedule
from glass_nav.sensing.scan import Scan, ScanError


class UpdateSchedule:
    """Remembers when each lidar had its last update, and where odometry was then."""

    def __init__(self) -> None:
        self.period_s: Optional[float] = None  # between the last two scans, of any lidar; None: there was only one
        self._stamps_ns: Dict[str, int] = {}  # of the last scan of each lidar
        self._odom_from_base: Optional[np.ndarray] = None  # at the last update
        self._up_to_date: Set[str] = set()  # lidars that had an update since the robot moved

    def admit(self, scan: Scan, odom_from_base: np.ndarray) -> np.ndarray:
        """The odometry of a scan that may be used, as (3,) floats.

        Raises:
            ScanError: the stamp runs backwards, or odometry is not finite; nothing is changed then.
        """
        odom_from_base = np.array(odom_from_base, float)
        if odom_from_base.shape != (3,) or not np.all(np.isfinite(odom_from_base)):
            raise ScanError(f"odometry must be finite x, y, yaw, got {odom_from_base}", scan.stamp_ns)
        last_ns = self._stamps_ns.get(scan.lidar, scan.stamp_ns)
        if scan.stamp_ns < last_ns:
            raise ScanError(f"time runs backwards, the last scan was at {last_ns * 1e-9:.3f} s", scan.stamp_ns)
        if self._stamps_ns:
            self.period_s = 1e-9 * max(scan.stamp_ns - max(self._stamps_ns.values()), 0)
        self._stamps_ns[scan.lidar] = scan.stamp_ns
        return odom_from_base

    def is_due(self, lidar: str, odom_from_base: np.ndarray, schedule: Schedule) -> bool:
        """Whether an update is due: for each lidar, after enough distance or turn by odometry."""
        step = self.step_to(odom_from_base)
        if step is not None:
            distance_m, turn_rad = se2.travelled(step)
            if distance_m >= schedule.update_min_d or turn_rad >= schedule.update_min_a:
                self._up_to_date = set()
        return lidar not in self._up_to_date

    def step_to(self, odom_from_base: np.ndarray) -> Optional[np.ndarray]:
        """(3,) odometry's step since the last update, in the robot's frame then; None: there was none."""
        if self._odom_from_base is None:
            return None
        return se2.compose(se2.inverse(self._odom_from_base), odom_from_base)

    def updated(self, lidar: str, odom_from_base: np.ndarray) -> None:
        """A scan of this lidar moved the particles, at that odometry."""
        self._odom_from_base = odom_from_base
        self._up_to_date.add(lidar)

    def request(self) -> None:
        """The next scan of each lidar is due, even if the robot does not move."""
        self._up_to_date = set()

    def restart(self) -> None:
        """The particles were put elsewhere: there is nothing to move them from. Stamps still must not run backwards."""
        self._odom_from_base = None
        self._up_to_date = set()
