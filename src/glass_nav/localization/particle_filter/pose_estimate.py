"""The estimated pose: mean and covariance of the best cluster of particles.

Other clusters are other hypotheses and are not included. P particles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav import _particles
from glass_nav.localization.particle_filter import resampling

_YAW_BINS = 36  # bins of 10 degrees go round


@dataclass(frozen=True)
class PoseEstimate:
    """The best cluster."""

    map_from_base: np.ndarray  # (3,) mean
    covariance: np.ndarray  # (3, 3) over x [m], y [m], yaw [rad]
    share: float  # of all weight that lies in this cluster, 0..1
    members: np.ndarray  # (P,) bool


def of(poses: np.ndarray, weights: np.ndarray) -> PoseEstimate:
    """The cluster with the most weight: bins of a histogram that touch, also at a corner, are one.

    Args:
        poses: (P, 3) particles in map.
        weights: (P,) that sum to 1.
    """
    return PoseEstimate(*_particles.best_cluster(poses, weights, resampling.BIN, _YAW_BINS))


def moments(poses: np.ndarray, weights: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """Mean (3,) and covariance (3, 3) of weighted poses (P, 3), yaw on the circle."""
    return _particles.moments(poses, weights)
