"""What happens between two scans: odometry -> particles moved, each with its own noise.

Thrun, Burgard, Fox, Probabilistic Robotics (2005), sec. 5.4, table 5.6, as AMCL has it: turning on the
spot has no first rotation, and driving backwards is not a turn by 180 degrees. In the plain models
"diff" and "omni" AMCL takes the variance for a standard deviation; its "-corrected" ones do not.
P particles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.geometry import angles, se2

MODELS = ("diff", "omni", "diff-corrected", "omni-corrected")
_ON_THE_SPOT_M = 0.01  # below this distance the direction of travel is noise


@dataclass(frozen=True)
class OdometryNoise:
    """How wrong odometry is; the names and meanings are AMCL's."""

    odom_model_type: str = "diff-corrected"
    odom_alpha1: float = 0.02  # turn from turn (variance [rad2/rad2] in the corrected models)
    odom_alpha2: float = 0.01  # turn from distance [rad2/m2]
    odom_alpha3: float = 0.02  # distance from distance [m2/m2]
    odom_alpha4: float = 0.01  # distance from turn [m2/rad2]
    odom_alpha5: float = 0.02  # sideways from distance, omni only [m2/m2]

    def __post_init__(self) -> None:
        if self.odom_model_type not in MODELS:
            raise ValueError(f"~odom_model_type must be one of {', '.join(MODELS)}, got {self.odom_model_type!r}")
        for name in ("odom_alpha1", "odom_alpha2", "odom_alpha3", "odom_alpha4", "odom_alpha5"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise ValueError(f"~{name} must be finite and >= 0, got {value}")


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
    step = _omni if noise.odom_model_type.startswith("omni") else _diff
    return se2.compose(map_from_base, step(before_from_after, noise, rng, len(map_from_base)))


def _deviation(variance: float, noise: OdometryNoise) -> float:
    return float(np.sqrt(variance)) if noise.odom_model_type.endswith("corrected") else variance


def _diff(step: np.ndarray, noise: OdometryNoise, rng: np.random.Generator, count: int) -> np.ndarray:
    distance, _ = se2.travelled(step)
    turn_1 = float(np.arctan2(step[1], step[0])) if distance >= _ON_THE_SPOT_M else 0.0
    turn_2 = float(angles.wrap(step[2] - turn_1))
    square_1, square_2 = _turn_either_way(turn_1) ** 2, _turn_either_way(turn_2) ** 2
    a1, a2, a3, a4 = noise.odom_alpha1, noise.odom_alpha2, noise.odom_alpha3, noise.odom_alpha4
    turns_1 = turn_1 + rng.normal(0.0, _deviation(a1 * square_1 + a2 * distance**2, noise), count)
    distances = distance + rng.normal(0.0, _deviation(a3 * distance**2 + a4 * (square_1 + square_2), noise), count)
    turns_2 = turn_2 + rng.normal(0.0, _deviation(a1 * square_2 + a2 * distance**2, noise), count)
    return np.stack([distances * np.cos(turns_1), distances * np.sin(turns_1), turns_1 + turns_2], axis=-1)


def _turn_either_way(turn: float) -> float:
    """A robot that backs up turned little, although its direction of travel turned by pi."""
    return min(abs(float(angles.wrap(turn))), abs(float(angles.wrap(turn - np.pi))))


def _omni(step: np.ndarray, noise: OdometryNoise, rng: np.random.Generator, count: int) -> np.ndarray:
    distance, _ = se2.travelled(step)
    bearing, turn = float(np.arctan2(step[1], step[0])), float(angles.wrap(step[2]))
    a1, a2, a3, a4, a5 = (noise.odom_alpha1, noise.odom_alpha2, noise.odom_alpha3, noise.odom_alpha4, noise.odom_alpha5)
    distances = distance + rng.normal(0.0, _deviation(a3 * distance**2 + a1 * turn**2, noise), count)
    turns = turn + rng.normal(0.0, _deviation(a4 * turn**2 + a2 * distance**2, noise), count)
    sideways = rng.normal(0.0, _deviation(a1 * turn**2 + a5 * distance**2, noise), count)
    cos, sin = np.cos(bearing), np.sin(bearing)
    return np.stack([distances * cos - sideways * sin, distances * sin + sideways * cos, turns], axis=-1)
