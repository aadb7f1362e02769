"""Commands, what stands around the robot -> commands that can be braked before anything is touched."""

from __future__ import annotations

import math

import numpy as np

from glass_nav.driving.base_limits import BaseLimits

_STEP_M = 0.03
_DELAY_S = 0.15  # until a command acts


def room_m(velocity: np.ndarray, obstacles_m: np.ndarray, limits: BaseLimits, reach_m: float = 1.0) -> float:
    """How far the robot can go along the arc of a velocity.

    Args:
        velocity: (3,) forward, left [m/s], turn [rad/s].
        obstacles_m: (K, 2) points that stand, in the robot's frame; not finite ones are left out.
        limits: of the base.
        reach_m: no further than this is looked.

    Returns:
        way [m] along the arc up to where the outline and its margin touch a point. Points that are nearer already do
        not count as long as the robot moves away from them.
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
    step = 0.5 * _STEP_M * (np.cos(heading[1:]) + np.cos(heading[:-1])), 0.5 * _STEP_M * (np.sin(heading[1:])
                                                                                       + np.sin(heading[:-1]))
    x, y = np.concatenate([[0.0], np.cumsum(step[0])]), np.concatenate([[0.0], np.cumsum(step[1])])
    away = np.hypot(x[:, None] - obstacles_m[:, 0], y[:, None] - obstacles_m[:, 1])  # (steps, K)
    wanted = np.minimum(limits.robot_radius_m + limits.margin_m, away[0])  # nearer ones: only not nearer still
    touched = (away < wanted - 1e-3).any(axis=1)
    return float(along[max(int(touched.argmax()) - 1, 0)]) if touched.any() else reach_m


def allowed(velocity: np.ndarray, obstacles_m: np.ndarray, limits: BaseLimits) -> np.ndarray:
    """(3,) the velocity along the same arc, slow enough to stand before anything is touched. As for room_m()."""
    speed = math.hypot(velocity[0], velocity[1])
    if speed < 1e-6:
        return velocity
    room = room_m(velocity, obstacles_m, limits, 0.5 * speed ** 2 / limits.max_acceleration_m_s2 + 0.5)
    lost = _DELAY_S * limits.max_acceleration_m_s2
    fastest = max(math.sqrt(lost ** 2 + 2.0 * limits.max_acceleration_m_s2 * room) - lost, 0.0)
    if fastest >= speed:
        return velocity
    if fastest < 0.02:
        return np.array([0.0, 0.0, velocity[2]]) if room <= _STEP_M else velocity * (0.02 / speed)
    return velocity * (fastest / speed)
