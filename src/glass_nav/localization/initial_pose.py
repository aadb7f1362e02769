"""The initial pose: default, AMCL's parameters, or as requested."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav.world.grid_map import GridMap


@dataclass(frozen=True)
class StartPose:
    """A pose in the map and how uncertain it is."""

    initial_pose_x: float = 0.0  # [m]
    initial_pose_y: float = 0.0  # [m]
    initial_pose_a: float = 0.0  # [rad]
    initial_cov_xx: float = 0.25  # [m^2]
    initial_cov_yy: float = 0.25  # [m^2]
    initial_cov_aa: float = (math.pi / 12.0) ** 2  # [rad^2]

    def __post_init__(self) -> None:
        for name in ("initial_pose_x", "initial_pose_y", "initial_pose_a"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"~{name} must be finite, got {getattr(self, name)}")
        for name in ("initial_cov_xx", "initial_cov_yy", "initial_cov_aa"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be finite and >= 0, got {getattr(self, name)}")

    @property
    def pose(self) -> np.ndarray:
        """map_from_base (3,)."""
        return np.array([self.initial_pose_x, self.initial_pose_y, self.initial_pose_a])

    @property
    def covariance(self) -> np.ndarray:
        """(3, 3) of x, y, yaw."""
        return np.diag([self.initial_cov_xx, self.initial_cov_yy, self.initial_cov_aa])


@dataclass(frozen=True)
class StartRules:
    """How the localization begins, and begins again; the names are parameters of the node, AMCL's where AMCL has them."""

    start_without_guess: bool = False  # begin with a search of the whole map, not at initial_pose_*
    wait_for_initialpose: bool = False  # no pose and no map -> odom before one is given; nothing is searched
    force_update_after_initialpose: bool = False
    force_update_after_set_map: bool = False
    random_seed: int = 0  # < 0: another one at every start

    @property
    def rng(self) -> np.random.Generator:
        """A generator that repeats itself from start to start, unless ~random_seed is negative."""
        return np.random.default_rng(None if self.random_seed < 0 else self.random_seed)


@dataclass(frozen=True)
class PoseGuess:
    """A given pose, and its time."""

    stamp_ns: int  # 0: now, whenever that is
    map_from_base: np.ndarray  # (3,)
    covariance: np.ndarray  # (3, 3) of x, y, yaw


def refuse_outside(guess: PoseGuess, grid_map: GridMap) -> None:
    """ValueError if the pose is not on the map."""
    if not grid_map.contains(*grid_map.cells(guess.map_from_base[:2])):
        x, y = guess.map_from_base[:2]
        raise ValueError(f"the pose x {x:.3f} m, y {y:.3f} m lies outside the map")


def checked(map_from_base: np.ndarray, covariance: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A given pose, checked.

    Args:
        map_from_base: (3,) x [m], y [m], yaw [rad].
        covariance: (3, 3) symmetric, not negative; 0 is allowed.

    Returns:
        Pose and covariance as floats, and (3, 3) the covariance's principal axes, each as long as its deviation.

    Raises:
        ValueError: not finite, not symmetric, or negative.
    """
    pose, covariance = np.array(map_from_base, float), np.array(covariance, float)
    if pose.shape != (3,) or not np.all(np.isfinite(pose)):
        raise ValueError(f"a pose needs finite x, y, yaw, got {map_from_base}")
    if covariance.shape != (3, 3) or not np.all(np.isfinite(covariance)):
        raise ValueError(f"a pose needs a finite covariance (3, 3), got {covariance.tolist()}")
    scale = max(float(np.abs(covariance).max()), 1e-12)
    if np.abs(covariance - covariance.T).max() > 1e-6 * scale:
        raise ValueError(f"the covariance of a pose must be symmetric, got {covariance.tolist()}")
    variance, axes = np.linalg.eigh(covariance)
    if variance.min() < -1e-6 * scale:
        raise ValueError(f"the covariance of a pose must not be negative, got {covariance.tolist()}")
    return pose, covariance, axes * np.sqrt(np.maximum(variance, 0.0))
