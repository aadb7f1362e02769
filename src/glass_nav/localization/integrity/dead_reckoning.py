"""Dead reckoning from the last certain pose, as a prior over places.

Where two halls look alike, scans cannot tell in which of them the robot is, but the distance driven since the last
certain pose can. The covariance grows by the noise of odometry, linearized as in Thrun, Burgard, Fox, Probabilistic
Robotics (2005), sec. 7.4.2. K poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav import _integrity
from glass_nav.geometry import angles, se2
from glass_nav.localization.particle_filter import motion
from glass_nav.localization.particle_filter.motion import OdometryNoise

SURE = np.diag(np.square([0.01, 0.01, np.radians(0.2)]))  # (3, 3) of a sure pose: nothing depends on less
_AS_IT_IS = np.ones(3)  # noise


@dataclass(frozen=True)
class DeadReckoning:
    """A pose carried by odometry alone since it was last sure."""

    map_from_base: np.ndarray  # (3,)
    covariance: np.ndarray  # (3, 3) over x [m], y [m], yaw [rad], in map
    distance_m: float = 0.0  # driven since the pose was sure

    def carried(self, step: np.ndarray, noise: OdometryNoise, noise_scale: np.ndarray = _AS_IT_IS) -> DeadReckoning:
        """After an odometry step. The noise is per step, so steps are those between two updates of the particles.

        Args:
            step: (3,) in the robot's frame before it.
            noise: of odometry.
            noise_scale: (3,) factors of its variances along, across and of the heading.
        """
        added = motion.covariance(step, noise)
        grown = _integrity.carried(self.map_from_base[2], self.covariance, step, added, noise_scale)
        distance_m, _ = se2.travelled(step)
        return DeadReckoning(se2.compose(self.map_from_base, step), grown, self.distance_m + distance_m)

    def mahalanobis(self, poses: np.ndarray) -> np.ndarray:
        """(K,) distances of poses (K, 3) in map from this one, in standard deviations."""
        off = poses - self.map_from_base
        off[:, 2] = angles.wrap(off[:, 2])
        root = np.linalg.cholesky(self.covariance + SURE)
        return np.sqrt(np.sum(np.linalg.solve(root, off.T) ** 2, axis=0))

    def log_likelihood(self, poses: np.ndarray, least: float = -np.inf) -> np.ndarray:
        """(K,) log likelihoods of poses (K, 3) in map, relative to that of this one.

        Args:
            poses: in map.
            least: no pose is less likely than this, because a robot may also be carried away.
        """
        return np.maximum(-0.5 * self.mahalanobis(poses) ** 2, least)
