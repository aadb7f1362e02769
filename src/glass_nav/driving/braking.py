"""Limits commands so that the base can still brake before it touches an obstacle."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Tuple

import numpy as np

from glass_nav.driving.base_limits import BaseLimits

_STEP_M = 0.03
_SQUEEZE_M = 0.01
_TIGHT_M = 0.3  # with less room other arcs are tried,
_OTHER_ARCS_RAD_M = (0.5, -0.5, 1.0, -1.0, 2.0, -2.0)  # bent by so much more,
_WORTH_M = 0.06  # and taken if they lead so much further
_MIN_M_S = 0.04
_CREEPING_MARGIN_M = 0.005  # kept at that speed, which stops within it
_DELAY_S = 0.15  # until a command acts


def room_m(velocity: np.ndarray, obstacles_m: np.ndarray, limits: BaseLimits, reach_m: float = 1.0) -> float:
    """How far the robot can go along the arc of a velocity.

    Args:
        velocity: (3,) forward, left [m/s], turn [rad/s].
        obstacles_m: (K, 2) points that stand, in the robot's frame; not finite ones are left out.
        limits: of the base.
        reach_m: no further than this is looked.

    Returns:
        distance [m] along the arc up to where the outline and its margin touch a point. What is within the margin already
        may come nearer by a centimetre, but not into the outline.
    """
    speed = math.hypot(velocity[0], velocity[1])
    obstacles_m = obstacles_m[np.isfinite(obstacles_m).all(axis=1)]
    near = np.hypot(*obstacles_m.T) < reach_m + limits.robot_radius_m + limits.margin_m
    obstacles_m = obstacles_m[near]
    if speed < 1e-6 or not len(obstacles_m):
        return reach_m
    along = np.arange(0.0, reach_m + _STEP_M, _STEP_M)
    turned = velocity[2] / speed * along
    heading = math.atan2(velocity[1], velocity[0]) + turned
    step = (
        0.5 * _STEP_M * (np.cos(heading[1:]) + np.cos(heading[:-1])),
        0.5 * _STEP_M * (np.sin(heading[1:]) + np.sin(heading[:-1])),
    )
    x, y = np.concatenate([[0.0], np.cumsum(step[0])]), np.concatenate([[0.0], np.cumsum(step[1])])
    away = np.hypot(x[:, None] - obstacles_m[:, 0], y[:, None] - obstacles_m[:, 1])  # (steps, K)
    wanted = np.minimum(
        limits.robot_radius_m + limits.margin_m,
        np.minimum(np.maximum(away[0] - _SQUEEZE_M, limits.robot_radius_m), away[0] - 5e-3),
    )
    touched = (away < wanted).any(axis=1)
    return float(along[max(int(touched.argmax()) - 1, 0)]) if touched.any() else reach_m


def allowed(velocity: np.ndarray, obstacles_m: np.ndarray, limits: BaseLimits, creep: bool = False) -> np.ndarray:
    """(3,) the velocity, slow enough to stand before anything is touched; between close obstacles along another arc, if
    that leads further.

    Args:
        velocity, obstacles_m, limits: as for room_m().
        creep: where there is no other way, slowly and with next to no margin: out of where the robot came in.
    """
    speed = math.hypot(velocity[0], velocity[1])
    if speed < 1e-6:
        return velocity
    reach = 0.5 * speed**2 / limits.max_acceleration_m_s2 + 0.5
    velocity, room = _furthest(velocity, obstacles_m, limits, reach)
    if creep and room <= _STEP_M:
        limits = replace(limits, margin_m=min(limits.margin_m, _CREEPING_MARGIN_M))
        velocity, room = _furthest(velocity, obstacles_m, limits, reach)
        if room > _STEP_M:
            return velocity * (min(_MIN_M_S, speed) / speed)
    lost = _DELAY_S * limits.max_acceleration_m_s2
    fastest = max(math.sqrt(lost**2 + 2.0 * limits.max_acceleration_m_s2 * room) - lost, 0.0)
    if fastest >= speed:
        return velocity
    if room <= _STEP_M:
        return np.array([0.0, 0.0, velocity[2]])
    return velocity * (max(fastest, _MIN_M_S) / speed)


def _furthest(
    velocity: np.ndarray, obstacles_m: np.ndarray, limits: BaseLimits, reach_m: float
) -> Tuple[np.ndarray, float]:
    """The velocity, or between close obstacles one along an arc that leads further; and how far that is free."""
    room = room_m(velocity, obstacles_m, limits, reach_m)
    if room < _TIGHT_M:
        speed = math.hypot(velocity[0], velocity[1])
        for change in _OTHER_ARCS_RAD_M:
            other = velocity + [0.0, 0.0, change * speed]
            further = room_m(other, obstacles_m, limits, reach_m)
            if further > room + _WORTH_M:
                velocity, room = other, further
    return velocity, room
