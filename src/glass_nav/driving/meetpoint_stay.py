"""The meetpoint where the robot stands: valid answers, when it is reported again, whether the robot was moved."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np

from glass_nav.driving.edge_tracking.edge_driver import Arrival

REPORT_AGAIN_S = 2.0  # from one report to the next, while a search waits for one
MOVED_M = 0.3  # farther from where it arrived the robot no longer stands there


class MeetpointStay:
    """A stay at a meetpoint, until the robot leaves or is moved away."""

    def __init__(self) -> None:
        self.arrival: Optional[Arrival] = None  # None: it stands at no meetpoint
        self._arrived_at = np.zeros(3)  # odom_from_base
        self._reported_s = -math.inf

    def begin(self, arrival: Arrival, odom_from_base: Optional[np.ndarray]) -> None:
        """The robot arrived, with that pose (3,) by odometry if it is known."""
        self.arrival = arrival
        if odom_from_base is not None:
            self._arrived_at = odom_from_base

    def end(self) -> None:
        self.arrival = None

    def reset(self) -> None:
        """Start over: time jumped back."""
        self.arrival, self._reported_s = None, -math.inf

    def was_left(self, odom_from_base: Optional[np.ndarray]) -> bool:
        """Whether the robot is no longer where it arrived, although no task moved it."""
        if self.arrival is None or odom_from_base is None:
            return False
        return float(np.hypot(*(odom_from_base - self._arrived_at)[:2])) > MOVED_M

    def reported(self, now_s: float) -> None:
        """The meetpoint was reported."""
        self._reported_s = now_s

    def is_report_due(self, now_s: float) -> bool:
        """Whether to report it again to a search that waits."""
        return now_s - self._reported_s > REPORT_AGAIN_S
