"""Pure pursuit: the velocity along the arc through a point ahead on a line.

Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm, CMU-RI-TR-92-01 (1992). Ours: slower in bends, and
only speeds from which the base can still brake. Velocities (3,) forward, left [m/s], turn [rad/s], within the speeds of
the base but not by its accelerations.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

LATERAL_M_S2 = 0.4  # in bends
BRAKING_SHARE = 0.7  # of the acceleration: the rest is a reserve


class Base(Protocol):
    """Limits on the velocities of a base."""

    @property
    def max_speed_m_s(self) -> float: ...

    @property
    def max_turn_rad_s(self) -> float: ...

    @property
    def max_turn_acceleration_rad_s2(self) -> float: ...


def curvature_to(point_m: np.ndarray) -> float:
    """Curvature [1/m] of the arc from the robot to a point (2,) in its frame, positive to the left."""
    distance = max(math.hypot(point_m[0], point_m[1]), 1e-6)
    return 2.0 * float(point_m[1]) / distance**2


def curvature_towards(bearing_rad: float, distance_m: float) -> float:
    """The same for a point in polar coordinates."""
    return 2.0 * math.sin(bearing_rad) / max(distance_m, 1e-6)


def along_arc(curvature: float, base: Base, speed_m_s: float, lateral_m_s2: float = LATERAL_M_S2) -> np.ndarray:
    """The velocity along an arc of that curvature [1/m].

    Args:
        curvature: of the arc.
        base: its limits.
        speed_m_s: at most.
        lateral_m_s2: acceleration to the side, at most.
    """
    bend = max(abs(curvature), 1e-6)
    speed = min(speed_m_s, base.max_speed_m_s, base.max_turn_rad_s / bend, math.sqrt(lateral_m_s2 / bend))
    return np.array([speed, 0.0, speed * curvature])


def on_the_spot(angle_rad: float, base: Base, creep_rad_s: float = 0.0) -> np.ndarray:
    """The velocity that turns the base by an angle and can still be braked within it; creep makes it arrive."""
    rate = braking_speed(abs(angle_rad), base.max_turn_acceleration_rad_s2) + creep_rad_s
    return np.array([0.0, 0.0, math.copysign(min(rate, base.max_turn_rad_s), angle_rad)])


def braking_speed(distance: float, acceleration: float) -> float:
    """Speed from which the base can stop within a distance [m] or a turn [rad], with some reserve."""
    return math.sqrt(2.0 * BRAKING_SHARE * acceleration * max(distance, 0.0))
