"""Watches scans, odometry and localization: what came last, and why the robot cannot drive.

Times are those of the data's clock, as the caller gives them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.driving.driver_params import DriverRules
from glass_nav.geometry import se2
from glass_nav.vocabulary import LocalizationState

_LATE = 0.5  # of the time after which a scan is too old
POSE_STATES = (LocalizationState.LOCALIZED, LocalizationState.UNCERTAIN)  # a pose of these is good enough to drive by


@dataclass(frozen=True)
class InputNames:
    """Names of the inputs, for messages."""

    odom_frame: str = "odom"
    base_frame: str = "base_link"
    map_frame: str = "map"
    localization: str = "localization_status"


@dataclass(frozen=True)
class Odometry:
    """A pose by odometry."""

    stamp_ns: int
    odom_from_base: np.ndarray  # (3,)


class InputWatch:
    """Keeps the newest of each input, and says what is missing."""

    def __init__(self, rules: DriverRules, names: InputNames) -> None:
        self._rules, self._names = rules, names
        self.reset()

    def reset(self) -> None:
        """Start over: time jumped back."""
        self.scan_ns = 0  # stamp of the last scan that was used; 0: none
        self.odometry: Optional[Odometry] = None
        self.localization: Optional[LocalizationState] = None
        self._localization_reason = ""
        self._localization_s = self._surfaces_s = -math.inf
        self._map_from_odom: Optional[np.ndarray] = None

    # -- what is heard

    def take_scan(self, stamp_ns: int) -> bool:
        """Whether a scan is newer than the last one that was used; then it is that."""
        if stamp_ns <= self.scan_ns:
            return False
        self.scan_ns = stamp_ns
        return True

    def take_surfaces(self, now_s: float) -> None:
        """A scan of the surfaces came, used or not."""
        self._surfaces_s = now_s

    def take_localization(self, state: LocalizationState, reason: str, now_s: float) -> None:
        """The localization reports its state."""
        self.localization, self._localization_reason, self._localization_s = state, reason, now_s

    def take_poses(self, odometry: Optional[Odometry], map_from_odom: Optional[np.ndarray]) -> float:
        """Poses of this control step; None: not known now. Returns how far the robot came since the last one [m]."""
        before, self._map_from_odom = self.odometry, map_from_odom
        if odometry is None:
            return 0.0
        self.odometry = odometry
        if before is None:
            return 0.0
        return float(np.hypot(*(odometry.odom_from_base - before.odom_from_base)[:2]))

    # -- what follows

    @property
    def odom_from_base(self) -> Optional[np.ndarray]:
        """(3,) the newest; None: none yet."""
        return None if self.odometry is None else self.odometry.odom_from_base

    @property
    def map_from_base(self) -> Optional[np.ndarray]:
        """(3,) at the last control step; None: not known."""
        if self._map_from_odom is None or self.odometry is None:
            return None
        return se2.compose(self._map_from_odom, self.odometry.odom_from_base)

    def map_from_base_at(self, odom_from_base: np.ndarray) -> Optional[np.ndarray]:
        """(3,) where the robot is in the map where odometry has it at that pose (3,); None: not localized."""
        return None if self._map_from_odom is None else se2.compose(self._map_from_odom, odom_from_base)

    def prefers_surfaces(self, now_s: float) -> bool:
        """Whether scan_surfaces is to be used in place of scan: only a robot that knows its pose sees glass in it.

        If it is late, scan stands in, before the last one that was used is too old.
        """
        return (
            self.localization == LocalizationState.LOCALIZED
            and now_s - self._localization_s < self._rules.status_timeout_s
            and now_s - self._surfaces_s < _LATE * self._rules.scan_timeout_s
        )

    def no_input(self, now_s: float, no_scan: str) -> Optional[str]:
        """Why the robot cannot be driven at all; None if it can.

        Args:
            now_s: the time.
            no_scan: why no scan could be used, in case none was yet.
        """
        if self.scan_ns == 0:
            return no_scan
        age_s = now_s - self.scan_ns * 1e-9
        if age_s > self._rules.scan_timeout_s:
            return f"the last scan is {age_s:.1f} s old"
        missing = f"no transform {self._names.odom_frame} <- {self._names.base_frame}"
        if self.odometry is None:
            return missing
        age_s = now_s - self.odometry.stamp_ns * 1e-9
        return f"{missing} for {age_s:.1f} s" if age_s > self._rules.odometry_timeout_s else None

    def localization_is_silent(self, now_s: float) -> bool:
        """Whether it was heard, but not lately."""
        return self.localization is not None and now_s - self._localization_s > self._rules.status_timeout_s

    def no_pose(self, now_s: float) -> Optional[str]:
        """Why there is no pose in the map; None if there is one."""
        if self.localization is None:
            return f"no word on {self._names.localization}"
        if self.localization_is_silent(now_s):
            return f"the localization is silent for {now_s - self._localization_s:.1f} s"
        if self.localization not in POSE_STATES:
            reason = f": {self._localization_reason}" if self._localization_reason else ""
            return f"the localization is {self.localization}{reason}"
        if self.map_from_base is None:
            return f"no transform {self._names.map_frame} <- {self._names.odom_frame}"
        return None
