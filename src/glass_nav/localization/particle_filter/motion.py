"""Motion models: moves the particles by odometry, each with its own noise.

Thrun, Burgard, Fox, Probabilistic Robotics (2005), sec. 5.4, table 5.6, as in AMCL: a turn in place has no first
rotation, and driving backwards is not a turn by 180 degrees. In the plain models "diff" and "omni" AMCL uses the
variance as a standard deviation; its "-corrected" models do not. "wheels" is the base of the glass document (seed
glass_localization.txt, equations 2 to 4): the increments of left and right wheel have independent noise, whose
variance grows with the distance that the wheel rolls (Chong, Kleeman, Accurate odometry and error modelling for a
mobile robot, 1997). P particles.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav.geometry import angles, se2, wheel_steps
from glass_nav.params import choice, number

WHEELS = "wheels"
MODELS = ("diff", "omni", "diff-corrected", "omni-corrected", WHEELS)
_ON_THE_SPOT_M = 0.01  # below this distance the direction of travel is noise


@dataclass(frozen=True)
class OdometryNoise:
    """How wrong odometry is; the names and meanings are AMCL's, except those of wheels."""

    odom_model_type: str = choice("diff-corrected", MODELS)
    odom_alpha1: float = number(0.02, 0.0, 100.0)  # turn from turn (variance [rad2/rad2] in the corrected models)
    odom_alpha2: float = number(0.01, 0.0, 100.0)  # turn from distance [rad2/m2]
    odom_alpha3: float = number(0.02, 0.0, 100.0)  # distance from distance [m2/m2]
    odom_alpha4: float = number(0.01, 0.0, 100.0)  # distance from turn [m2/rad2]
    odom_alpha5: float = number(0.02, 0.0, 100.0)  # sideways from distance, omni only [m2/m2]
    wheel_base_m: float = number(0.4, 0.01, 100.0)  # between the wheels, for wheels and wheel_topics
    wheel_left_noise_m: float = number(2e-4, 0.0, 100.0)  # variance for each metre that it rolls, wheels only [m2/m]
    wheel_right_noise_m: float = number(2e-4, 0.0, 100.0)

    def __post_init__(self) -> None:
        if self.odom_model_type not in MODELS:
            raise ValueError(f"~odom_model_type must be one of {', '.join(MODELS)}, got {self.odom_model_type!r}")
        for name in (
            "odom_alpha1",
            "odom_alpha2",
            "odom_alpha3",
            "odom_alpha4",
            "odom_alpha5",
            "wheel_left_noise_m",
            "wheel_right_noise_m",
        ):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise ValueError(f"~{name} must be finite and >= 0, got {value}")
        if not self.wheel_base_m > 0.0:
            raise ValueError(f"~wheel_base_m must be > 0 m, got {self.wheel_base_m}")


def sample(
    map_from_base: np.ndarray, before_from_after: np.ndarray, noise: OdometryNoise, rng: np.random.Generator
) -> np.ndarray:
    """Particles after one step of odometry.

    Args:
        map_from_base: (P, 3) particles before the step.
        before_from_after: (3,) the step that odometry reports, in the robot's frame before it.
        noise: model and its alphas.
        rng: source of all randomness.

    Returns:
        (P, 3) particles after the step.
    """
    count = len(map_from_base)
    if noise.odom_model_type == WHEELS:
        (left_m, right_m, turned), deviations = _wheels(before_from_after, noise)
        rolled = rng.normal(left_m, deviations[0], count), rng.normal(right_m, deviations[1], count)
        steps = se2.compose(np.array([0.0, 0.0, turned]), wheel_steps.step_of(*rolled, noise.wheel_base_m))
        steps[:, 2] -= turned
    elif noise.odom_model_type.startswith("omni"):
        bearing, mean, deviations = _omni(before_from_after, noise)
        distances, turns, sideways = (rng.normal(m, s, count) for m, s in zip(mean, deviations))
        cos, sin = np.cos(bearing), np.sin(bearing)
        steps = np.stack([distances * cos - sideways * sin, distances * sin + sideways * cos, turns], axis=-1)
    else:
        mean, deviations = _diff(before_from_after, noise)
        turns_1, distances, turns_2 = (rng.normal(m, s, count) for m, s in zip(mean, deviations))
        steps = np.stack([distances * np.cos(turns_1), distances * np.sin(turns_1), turns_1 + turns_2], axis=-1)
    return se2.compose(map_from_base, steps)


def covariance(before_from_after: np.ndarray, noise: OdometryNoise) -> np.ndarray:
    """(3, 3) over x [m], y [m], yaw [rad] of one step of odometry, linearized, in the robot's frame before it.

    Args:
        before_from_after, noise: as for sample().

    Returns:
        Not to be changed.
    """
    return _covariance(tuple(before_from_after.tolist()), noise)


@functools.lru_cache(maxsize=16)  # several ask for it at each scan
def _covariance(before_from_after: Tuple[float, float, float], noise: OdometryNoise) -> np.ndarray:
    step = np.array(before_from_after)
    if noise.odom_model_type == WHEELS:
        (left_m, right_m, turned), deviations = _wheels(step, noise)
        forward_m, turn = 0.5 * (left_m + right_m), (right_m - left_m) / noise.wheel_base_m
        cos, sin = np.cos(turned + 0.5 * turn), np.sin(turned + 0.5 * turn)
        by_forward, by_turn = np.array([cos, sin, 0.0]), np.array([-0.5 * forward_m * sin, 0.5 * forward_m * cos, 1.0])
        by_error = np.stack(
            [0.5 * by_forward - by_turn / noise.wheel_base_m, 0.5 * by_forward + by_turn / noise.wheel_base_m], axis=-1
        )
    elif noise.odom_model_type.startswith("omni"):
        bearing, _, deviations = _omni(step, noise)
        cos, sin = np.cos(bearing), np.sin(bearing)
        by_error = np.array([[cos, 0.0, -sin], [sin, 0.0, cos], [0.0, 1.0, 0.0]])  # of distance, turn, sideways
    else:
        (turn_1, distance, _), deviations = _diff(step, noise)
        cos, sin = math.cos(turn_1), math.sin(turn_1)
        by_error = np.array([[-distance * sin, cos, 0.0], [distance * cos, sin, 0.0], [1.0, 0.0, 1.0]])
    scaled = by_error * deviations
    found = scaled @ scaled.T
    found.flags.writeable = False
    return found


def _wheels(step: np.ndarray, noise: OdometryNoise) -> Tuple[np.ndarray, np.ndarray]:
    """Increments left, right [m] and how far their arc is turned [rad] (3,); deviations of the increments (2,) [m]."""
    increments = np.array(wheel_steps.increments_of(step, noise.wheel_base_m))
    return increments, np.sqrt(np.abs(increments[:2]) * [noise.wheel_left_noise_m, noise.wheel_right_noise_m])


def _deviation(variance: float, noise: OdometryNoise) -> float:
    return math.sqrt(variance) if noise.odom_model_type.endswith("corrected") else variance


def _diff(step: np.ndarray, noise: OdometryNoise) -> Tuple[np.ndarray, np.ndarray]:
    """Mean (3,) and deviations (3,) of first turn [rad], distance [m], second turn [rad]."""
    distance, _ = se2.travelled(step)
    turn_1 = math.atan2(step[1], step[0]) if distance >= _ON_THE_SPOT_M else 0.0
    turn_2 = angles.wrap_one(float(step[2]) - turn_1)
    square_1, square_2 = _turn_either_way(turn_1) ** 2, _turn_either_way(turn_2) ** 2
    a1, a2, a3, a4 = noise.odom_alpha1, noise.odom_alpha2, noise.odom_alpha3, noise.odom_alpha4
    variances = (
        a1 * square_1 + a2 * distance**2,
        a3 * distance**2 + a4 * (square_1 + square_2),
        a1 * square_2 + a2 * distance**2,
    )
    return np.array([turn_1, distance, turn_2]), np.array([_deviation(variance, noise) for variance in variances])


def _turn_either_way(turn: float) -> float:
    """A robot that backs up turned little, although its direction of travel turned by pi."""
    return min(abs(angles.wrap_one(turn)), abs(angles.wrap_one(turn - math.pi)))


def _omni(step: np.ndarray, noise: OdometryNoise) -> Tuple[float, np.ndarray, np.ndarray]:
    """Direction of travel [rad]; mean (3,) and deviations (3,) of distance [m], turn [rad], and sideways of it [m]."""
    distance, _ = se2.travelled(step)
    bearing, turn = float(np.arctan2(step[1], step[0])), float(angles.wrap(step[2]))
    a1, a2, a3, a4, a5 = (noise.odom_alpha1, noise.odom_alpha2, noise.odom_alpha3, noise.odom_alpha4, noise.odom_alpha5)
    variances = (
        a3 * distance**2 + a1 * turn**2,
        a4 * turn**2 + a2 * distance**2,
        a1 * turn**2 + a5 * distance**2,
    )
    deviations = np.array([_deviation(variance, noise) for variance in variances])
    return bearing, np.array([distance, turn, 0.0]), deviations
