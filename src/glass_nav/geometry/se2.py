"""Rigid motions of the plane as arrays (..., 3) of x [m], y [m], yaw [rad].

Named like transforms: `map_from_base = compose(map_from_odom, odom_from_base)`, equal names meet.
All functions broadcast over leading axes; the compiled module _poses computes them.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np

from glass_nav import _poses
from glass_nav.geometry import angles


def compose(a_from_b: np.ndarray, b_from_c: np.ndarray) -> np.ndarray:
    """a_from_c, yaw in [-pi, pi)."""
    return _poses.compose(a_from_b, b_from_c)


def inverse(a_from_b: np.ndarray) -> np.ndarray:
    """b_from_a, yaw in [-pi, pi)."""
    return _poses.inverse(a_from_b)


def transform_points(a_from_b: np.ndarray, points_b: np.ndarray) -> np.ndarray:
    """Points (..., 2) [m] given in b, in a."""
    return _poses.transform_points(a_from_b, points_b)


def travelled(before_from_after: np.ndarray) -> Tuple[float, float]:
    """Distance [m] and turn [rad], both >= 0, of one step of odometry (3,)."""
    x, y, yaw = (float(value) for value in before_from_after)
    return math.hypot(x, y), abs(angles.wrap_one(yaw))
