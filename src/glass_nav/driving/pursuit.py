"""A point ahead -> the velocity along the arc through it: pure pursuit.

Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm, CMU-RI-TR-92-01 (1992). Velocities (3,) forward,
left [m/s], turn [rad/s], within the speeds of the base but not by its accelerations.
"""

from __future__ import annotations

import math

import numpy as np

from glass_nav.driving import velocity
from glass_nav.driving.base_limits import BaseLimits

LATERAL_M_S2 = 0.4  # slower in bends
CREEP = 0.04  # [m/s] or [rad/s], so that braking arrives


def along_arc(to_point_m: np.ndarray, limits: BaseLimits, remaining_m: float = math.inf) -> np.ndarray:
    """The velocity along the arc to a point (2,) in the robot's frame, slow enough to stand after a way."""
    distance = max(math.hypot(to_point_m[0], to_point_m[1]), 1e-6)
    curvature = 2.0 * float(to_point_m[1]) / distance**2
    bend = max(abs(curvature), 1e-6)
    speed = min(limits.max_speed_m_s, limits.max_turn_rad_s / bend, math.sqrt(LATERAL_M_S2 / bend))
    if math.isfinite(remaining_m):
        speed = min(speed, velocity.braking_speed(remaining_m, limits.max_acceleration_m_s2) + CREEP)
    return np.array([speed, 0.0, speed * curvature])


def on_the_spot(angle_rad: float, limits: BaseLimits) -> np.ndarray:
    """The velocity that turns the base by an angle and can still be braked within it."""
    rate = velocity.braking_speed(abs(angle_rad), limits.max_turn_acceleration_rad_s2) + CREEP
    return np.array([0.0, 0.0, math.copysign(min(rate, limits.max_turn_rad_s), angle_rad)])
