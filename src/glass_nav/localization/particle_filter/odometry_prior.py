"""The prior probability of poses near the odometry prediction, before the scan is used.

Scans with many returns that the map lacks, such as a building behind the panes or a cabinet beside a wall, may fit
best at a wrong pose. So scans are classified at the pose where they fit best only if it is also the more probable
one. If a wheel slipped, a wider distribution with a small weight applies. K poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.geometry import angles

MIN_DEVIATION = np.array([0.01, 0.01, np.radians(0.2)])  # of odometry: m, m, rad
SLIP_DEVIATION = np.array([0.3, 0.3, np.radians(30.0)])  # a wheel that slipped, a robot that was pushed
REACH = 3.0  # deviations
_WIDER = 2.0  # than the covariance says: what is wrong in the map errs alike in scan after scan, which it does not know


@dataclass(frozen=True)
class OdometryPrior:
    """A prior over planar poses."""

    map_from_base: np.ndarray  # (3,) where odometry led
    covariance: np.ndarray  # (3, 3) of that over x [m], y [m], yaw [rad] in map
    slip_probability: float = 0.0  # that this step of odometry is useless

    @property
    def information(self) -> np.ndarray:
        """(3, 3) of a step that did not slip."""
        return np.linalg.inv(self._near)

    def reaches(self, poses: np.ndarray) -> np.ndarray:
        """(K,) bool: a step that did not slip may have led to poses (K, 3)."""
        return self._squared(poses, np.linalg.cholesky(self._near)) <= REACH**2

    def log_density(self, poses: np.ndarray) -> np.ndarray:
        """(K,) of poses (K, 3), but for a constant."""
        near = self._log_normal(poses, self._near) + np.log1p(-self.slip_probability)
        if not self.slip_probability:
            return near
        slipped = self._log_normal(poses, self._near + np.diag(SLIP_DEVIATION**2))
        return np.logaddexp(near, slipped + np.log(self.slip_probability))

    @property
    def _near(self) -> np.ndarray:
        return _WIDER**2 * self.covariance + np.diag(MIN_DEVIATION**2)

    def _log_normal(self, poses: np.ndarray, covariance: np.ndarray) -> np.ndarray:
        root = np.linalg.cholesky(covariance)
        return -0.5 * self._squared(poses, root) - np.log(np.diag(root)).sum()

    def _squared(self, poses: np.ndarray, root: np.ndarray) -> np.ndarray:
        """(K,) squared distances of poses (K, 3), in deviations; root (3, 3) of the covariance."""
        off = poses - self.map_from_base
        off[:, 2] = angles.wrap(off[:, 2])
        return np.sum(np.linalg.solve(root, off.T) ** 2, axis=0)
