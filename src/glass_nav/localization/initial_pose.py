"""Where the robot starts when nobody says; the names and defaults are AMCL's."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


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
