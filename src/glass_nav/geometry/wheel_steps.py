"""Converts increments of two driven wheels to a step of the robot and back: equations (2) to (4) of the document.

Seed document glass_localization.txt. Its equations move the robot along a straight line in the heading before the step;
here it moves along the arc that wheels of constant speed drive, of which they are the limit for short steps. N steps.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np

from glass_nav.geometry import angles

_NOWHERE_M = 1e-9


def step_of(left_m: np.ndarray, right_m: np.ndarray, wheel_base_m: float) -> np.ndarray:
    """Steps (..., 3) of the base, in its frame before each, from increments (...) of the wheels.

    Args:
        left_m, right_m: distances that the wheels rolled; negative: backwards.
        wheel_base_m: between the wheels.
    """
    left_m, right_m = np.asarray(left_m, float), np.asarray(right_m, float)
    turn = (right_m - left_m) / wheel_base_m  # eq. (3)
    chord_m = 0.5 * (left_m + right_m) * _chord_share(turn)  # eq. (3)
    return np.stack([chord_m * np.cos(0.5 * turn), chord_m * np.sin(0.5 * turn), turn], axis=-1)


def increments_of(step: np.ndarray, wheel_base_m: float) -> Tuple[float, float, float]:
    """Increments left and right [m] of the arc that ends where a step (3,) does, and how far it is turned [rad].

    Odometry reports steps of many arcs, which no single one leads along; turned by the third value, one does.
    """
    x, y, turn = (float(value) for value in step)
    turn = float(angles.wrap(turn))
    chord_m = float(np.hypot(x, y))
    turned = float(angles.wrap(np.arctan2(y, x) - 0.5 * turn)) if chord_m > _NOWHERE_M else 0.0
    if abs(turned) > 0.5 * np.pi:  # it drove backwards
        chord_m, turned = -chord_m, float(angles.wrap(turned + np.pi))
    forward_m, half_m = chord_m / float(_chord_share(np.array(turn))), 0.5 * turn * wheel_base_m
    return forward_m - half_m, forward_m + half_m, turned


def followed(start: np.ndarray, left_m: np.ndarray, right_m: np.ndarray, wheel_base_m: float) -> np.ndarray:
    """(N, 3) poses after each of N increments, from a pose (3,): equations (2) and (4), summed up."""
    steps = step_of(left_m, right_m, wheel_base_m)
    yaw = start[2] + np.concatenate([[0.0], np.cumsum(steps[:, 2])])
    cos, sin = np.cos(yaw[:-1]), np.sin(yaw[:-1])
    x = start[0] + np.cumsum(cos * steps[:, 0] - sin * steps[:, 1])
    y = start[1] + np.cumsum(sin * steps[:, 0] + cos * steps[:, 1])
    return np.stack([x, y, angles.wrap(yaw[1:])], axis=-1)


def _chord_share(turn: np.ndarray) -> np.ndarray:
    """Chord over arc: sin(t / 2) / (t / 2)."""
    return np.sinc(np.asarray(turn) / (2.0 * np.pi))
