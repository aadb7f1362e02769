"""Pure pursuit with the settings of the driver: it slows down before the end, so that it arrives."""

from __future__ import annotations

import math

import numpy as np

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.geometry import pure_pursuit

CREEP = 0.04  # [m/s] or [rad/s]


def along_arc(to_point_m: np.ndarray, limits: BaseLimits, remaining_m: float = math.inf) -> np.ndarray:
    """(3,) velocity along the arc to a point (2,) in the robot's frame, slow enough to stand after a distance."""
    speed = pure_pursuit.braking_speed(remaining_m, limits.max_acceleration_m_s2) + CREEP
    return pure_pursuit.along_arc(pure_pursuit.curvature_to(to_point_m), limits, speed)


def on_the_spot(angle_rad: float, limits: BaseLimits) -> np.ndarray:
    """(3,) velocity that turns the base by an angle."""
    return pure_pursuit.on_the_spot(angle_rad, limits, CREEP)
