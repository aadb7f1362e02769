"""Weights -> pose: mean and covariance of the best cluster of particles.

Other clusters are other hypotheses: they belong neither to the mean nor to the
covariance. P particles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from glass_nav.geometry import angles
from glass_nav.localization.particle_filter import resampling

_YAW_BINS = 36  # bins of 10 degrees go round
_NEIGHBOURS = np.array([(x, y, yaw) for x in (-1, 0, 1) for y in (-1, 0, 1) for yaw in (-1, 0, 1)][14:])


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
    label = _clusters(poses)
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


def _clusters(poses: np.ndarray) -> np.ndarray:
    """(P,) label of each particle: histogram bins that touch are one cluster."""
    cells = resampling.bins(poses)
    base = cells[:, :2].min(axis=0) - 1
    span_y = cells[:, 1].max() - base[1] + 2

    def key(cell: np.ndarray) -> np.ndarray:  # yaw goes round
        x, y = cell[..., 0] - base[0], cell[..., 1] - base[1]
        return (x * span_y + y) * _YAW_BINS + cell[..., 2] % _YAW_BINS

    keys, first, which = np.unique(key(cells), return_index=True, return_inverse=True)
    which = which.reshape(-1)
    wanted = key(cells[first][:, None, :] + _NEIGHBOURS[None])
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    row, column = np.nonzero(keys[at] == wanted)
    links = coo_matrix((np.ones(len(row)), (row, at[row, column])), shape=(len(keys),) * 2)
    return connected_components(links, directed=False)[1][which]
