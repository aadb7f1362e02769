"""Rigid motions of the plane as arrays (..., 3) of x [m], y [m], yaw [rad].

Named like transforms: `map_from_base = compose(map_from_odom, odom_from_base)`, equal names meet.
All functions broadcast over leading axes.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np

from glass_nav.geometry import angles


def compose(a_from_b: np.ndarray, b_from_c: np.ndarray) -> np.ndarray:
    """a_from_c, yaw in [-pi, pi)."""
    a_from_b, b_from_c = np.asarray(a_from_b, float), np.asarray(b_from_c, float)
    cos, sin = angles.cos_sin(a_from_b[..., 2])
    x, y = b_from_c[..., 0], b_from_c[..., 1]
    return _stacked(
        a_from_b[..., 0] + cos * x - sin * y,
        a_from_b[..., 1] + sin * x + cos * y,
        angles.wrap(a_from_b[..., 2] + b_from_c[..., 2]),
    )


def inverse(a_from_b: np.ndarray) -> np.ndarray:
    """b_from_a, yaw in [-pi, pi)."""
    a_from_b = np.asarray(a_from_b, float)
    cos, sin = angles.cos_sin(a_from_b[..., 2])
    x, y = a_from_b[..., 0], a_from_b[..., 1]
    return _stacked(-cos * x - sin * y, sin * x - cos * y, angles.wrap(-a_from_b[..., 2]))


def transform_points(a_from_b: np.ndarray, points_b: np.ndarray) -> np.ndarray:
    """Points (..., 2) [m] given in b, in a."""
    a_from_b, points_b = np.asarray(a_from_b, float), np.asarray(points_b, float)
    cos, sin = angles.cos_sin(a_from_b[..., 2])
    x, y = points_b[..., 0], points_b[..., 1]
    return _stacked(a_from_b[..., 0] + cos * x - sin * y, a_from_b[..., 1] + sin * x + cos * y)


def travelled(before_from_after: np.ndarray) -> Tuple[float, float]:
    """Distance [m] and turn [rad], both >= 0, of one step of odometry (3,)."""
    return float(np.hypot(*before_from_after[:2])), float(abs(angles.wrap(before_from_after[2])))


def _stacked(*columns: np.ndarray) -> np.ndarray:
    """Arrays that broadcast to (...), as (..., number of arrays). np.stack takes twice as long for a single pose."""
    stacked = np.empty(np.broadcast(*columns).shape + (len(columns),))
    for number, column in enumerate(columns):
        stacked[..., number] = column
    return stacked
