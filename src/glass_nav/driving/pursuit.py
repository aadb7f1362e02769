"""A way, the robot's pose -> the velocity along it: pure pursuit of a point of the way a little ahead.

Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm, CMU-RI-TR-92-01 (1992).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.geometry import se2

LOOKAHEAD_M = 0.35
TURN_ON_THE_SPOT_RAD = 0.7       # a point further to the side is turned to first
_LATERAL_ACCELERATION_M_S2 = 0.4
_CREEP_M_S = 0.05                # so that braking arrives


@dataclass(frozen=True)
class Foot:
    """The nearest point of a way."""
    at_m: np.ndarray     # (2,)
    along: np.ndarray    # (2,) unit vector of the way there
    passed_m: float      # way up to it
    remaining_m: float   # way from it on


def foot(way_m: np.ndarray, point_m: np.ndarray, least_m: float = 0.0, reach_m: float = math.inf) -> Foot:
    """Where a point (2,) is beside a way (n, 2), n >= 2, no nearer to its start than least_m, and no further on than
    reach_m from there: a way may come back to where it was.
    """
    pieces = np.diff(way_m, axis=0)
    lengths = np.maximum(np.hypot(*pieces.T), 1e-9)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    along = np.clip(np.sum((point_m - way_m[:-1]) * pieces, axis=1) / lengths, 0.0, lengths)
    along = np.clip(starts[:-1] + along, least_m, least_m + reach_m) - starts[:-1]
    usable = (along >= -1e-9) & (along <= lengths + 1e-9)
    away = np.hypot(*(way_m[:-1] + (along / lengths)[:, None] * pieces - point_m).T)
    away[~usable] = np.inf
    best = int(away.argmin()) if usable.any() else len(lengths) - 1
    share = min(max(along[best], 0.0), lengths[best]) / lengths[best]
    passed = float(starts[best] + share * lengths[best])
    return Foot(way_m[best] + share * pieces[best], pieces[best] / lengths[best], passed, float(starts[-1]) - passed)


def point_at(way_m: np.ndarray, passed_m: float) -> np.ndarray:
    """(2,) the point so far along a way (n, 2); beyond its end straight on."""
    starts = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way_m, axis=0).T))])
    if passed_m <= starts[-1]:
        return np.array([np.interp(passed_m, starts, way_m[:, axis]) for axis in (0, 1)])
    last = way_m[-1] - way_m[-2]
    return way_m[-1] + (passed_m - starts[-1]) * last / max(float(np.hypot(*last)), 1e-9)


def length(way_m: np.ndarray) -> float:
    """Of a way (n, 2)."""
    return float(np.hypot(*np.diff(way_m, axis=0).T).sum())


def part(way_m: np.ndarray, from_m: float, to_m: float) -> np.ndarray:
    """(k, 2) the piece of a way (n, 2) between two lengths along it, k >= 2."""
    starts = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way_m, axis=0).T))])
    from_m, to_m = min(max(from_m, 0.0), starts[-1]), min(max(to_m, 0.0), starts[-1])
    inner = way_m[(starts > from_m) & (starts < to_m)]
    return np.concatenate([point_at(way_m, from_m)[None], inner, point_at(way_m, to_m)[None]])


def velocity(way_m: np.ndarray, passed_m: float, pose: np.ndarray, limits: BaseLimits,
             stop_at_end: bool = True) -> np.ndarray:
    """(3,) forward, left [m/s], turn [rad/s] that brings a base at pose (3,) on along the way.

    Args:
        way_m: (n, 2) in the frame of the pose.
        passed_m: of the foot of the base.
        pose: x, y, yaw.
        limits: of the base.
        stop_at_end: slow down in time; else the way goes on.
    """
    total = float(np.hypot(*np.diff(way_m, axis=0).T).sum())
    x, y = se2.transform_points(se2.inverse(pose), point_at(way_m, passed_m + LOOKAHEAD_M)).tolist()
    bearing, distance = math.atan2(y, x), max(math.hypot(x, y), 1e-6)
    if abs(bearing) > TURN_ON_THE_SPOT_RAD:
        return np.array([0.0, 0.0, turn_rate(bearing, limits)])
    curvature = 2.0 * math.sin(bearing) / distance
    bend = max(abs(curvature), 1e-6)
    speed = min(limits.max_speed_m_s, limits.max_turn_rad_s / bend, math.sqrt(_LATERAL_ACCELERATION_M_S2 / bend))
    if stop_at_end:
        speed = min(speed, math.sqrt(limits.max_acceleration_m_s2 * max(total - passed_m, 0.0)) + _CREEP_M_S)
    return np.array([speed, 0.0, speed * curvature])


def turn_rate(angle_rad: float, limits: BaseLimits) -> float:
    """Turn rate [rad/s] that can still be braked within the angle."""
    rate = math.sqrt(limits.max_turn_acceleration_rad_s2 * abs(angle_rad))
    return math.copysign(min(rate, limits.max_turn_rad_s), angle_rad)


def accelerated(before: np.ndarray, wanted: np.ndarray, dt_s: float, limits: BaseLimits) -> np.ndarray:
    """(3,) the velocity wanted, as near as the base's accelerations allow after a time."""
    return np.concatenate([_towards(before[:2], wanted[:2], limits.max_acceleration_m_s2 * dt_s),
                           _towards(before[2:], wanted[2:], limits.max_turn_acceleration_rad_s2 * dt_s)])


def _towards(before: np.ndarray, wanted: np.ndarray, most: float) -> np.ndarray:
    change = wanted - before
    size = float(np.hypot(*change)) if len(change) == 2 else abs(float(change[0]))
    return wanted if size <= most else before + change * (most / size)
