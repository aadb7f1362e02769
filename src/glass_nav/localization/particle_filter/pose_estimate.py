"""Weights -> pose: mean and covariance of the best cluster of particles.

Other clusters are other hypotheses: they belong neither to the mean nor to the
covariance. P particles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav import _particles
from glass_nav.geometry import angles
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
    """The cluster with the most weight.

    Args:
        poses: (P, 3) particles in map.
        weights: (P,) that sum to 1.
    """
    label = _particles.clusters(poses, resampling.BIN, _YAW_BINS)  # histogram bins that touch are one cluster
    share = np.bincount(label, weights)
    best = int(np.argmax(share))
    members = label == best
    pose, covariance = moments(poses[members], weights[members])
    return PoseEstimate(pose, covariance, float(share[best]), members)


def moments(poses: np.ndarray, weights: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """Mean (3,) and covariance (3, 3) of weighted poses (P, 3), yaw on the circle."""
    total = weights.sum()
    w = weights / total if total > 0.0 else np.full(len(weights), 1.0 / len(weights))
    # summed, not w @ poses: BLAS adds strided columns in an order that goes with where they lie in memory
    mean = np.append(np.sum(w[:, None] * poses[:, :2], axis=0), angles.mean(poses[:, 2], w))
    off = poses - mean
    off[:, 2] = angles.wrap(off[:, 2])
    return mean, (off * w[:, None]).T @ off
