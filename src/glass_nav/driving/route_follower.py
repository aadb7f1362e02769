"""Follows a route by pure pursuit within the limits of the base: first a turn in place, slower at the end.

Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm, CMU-RI-TR-92-01 (1992). Poses (3,) in the frame of
the route; velocities (3,) forward, left [m/s], turn [rad/s].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.driving import pursuit
from glass_nav.driving.base_limits import BaseLimits
from glass_nav.geometry import polyline, se2
from glass_nav.geometry.polyline import Polyline

TURN_FIRST_RAD = 0.8  # a point farther off to the side is turned to on the spot ...
TURNED_RAD = 0.1  # ... until it is so near


@dataclass(frozen=True)
class RouteFollowerParams:
    """How a route is followed."""

    lookahead_m: float = 0.4
    goal_tolerance_m: float = 0.05
    goal_tolerance_rad: float = 0.05

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 < value < math.inf:
                raise ValueError(f"~{name} must be > 0 and finite, got {value}")


class RouteFollower:
    """Commands a base along a route from wherever it is, and then to stand."""

    def __init__(
        self,
        points_m: np.ndarray,
        limits: BaseLimits,
        p: RouteFollowerParams = RouteFollowerParams(),
        final_yaw_rad: Optional[float] = None,
    ) -> None:
        """
        Args:
            points_m: (M, 2), M >= 1.
            limits: of the base.
            p: how.
            final_yaw_rad: to stand with at the end; None: as it comes.
        """
        points = polyline.distinct(np.asarray(points_m, float))
        self._end_m = points[-1]
        self._line = Polyline(points) if len(points) > 1 else None
        self._limits, self._p, self._final_yaw_rad = limits, p, final_yaw_rad
        self._turning = True  # to the route, before anything else
        self._at_end = self._line is None
        self.progress_m = 0.0
        self.off_route_m = 0.0
        self.done = False

    @property
    def remaining_m(self) -> float:
        """Way to the end."""
        return 0.0 if self._line is None or self._at_end else self._line.length - self.progress_m

    def command(self, map_from_base: np.ndarray) -> np.ndarray:
        """(3,) velocity that is wanted, within the speeds of the base but not by its accelerations; zero at the end."""
        position, yaw = np.asarray(map_from_base[:2], float), float(map_from_base[2])
        if not self._at_end and self._line is not None:
            self.progress_m = self._line.nearest(position, self.progress_m, 2.0 * self._p.lookahead_m)
            self.off_route_m = float(np.hypot(*(self._line.at(self.progress_m) - position)))
            to_end_m = float(np.hypot(*(self._end_m - position)))
            passed = self.remaining_m < 1e-3 and to_end_m < 3.0 * self._p.goal_tolerance_m
            self._at_end = self.remaining_m < self._p.goal_tolerance_m and to_end_m < self._p.goal_tolerance_m or passed
        if self._at_end:
            return self._final_turn(yaw)
        assert self._line is not None
        ahead = self._line.at(min(self.progress_m, self._line.length) + self._p.lookahead_m)
        if self.remaining_m < 1e-3:  # the end was missed to the side
            ahead = self._end_m
        return self._pursuit(ahead - position, yaw)

    def _pursuit(self, to_point: np.ndarray, yaw: float) -> np.ndarray:
        ahead = se2.transform_points(np.array([0.0, 0.0, -yaw]), to_point)
        bearing = math.atan2(ahead[1], ahead[0])
        self._turning = abs(bearing) > (TURNED_RAD if self._turning else TURN_FIRST_RAD)
        if self._turning:
            return pursuit.on_the_spot(bearing, self._limits)
        return pursuit.along_arc(ahead, self._limits, self.remaining_m)

    def _final_turn(self, yaw: float) -> np.ndarray:
        if self._final_yaw_rad is None:
            self.done = True
            return np.zeros(3)
        off = math.remainder(self._final_yaw_rad - yaw, 2.0 * math.pi)
        self.done = self.done or abs(off) < self._p.goal_tolerance_rad
        return np.zeros(3) if self.done else pursuit.on_the_spot(off, self._limits)
