"""Draws particles where odometry and scan suggest.

A lidar measures the pose far more precisely than odometry, so most particles drawn from odometry alone are ruled out
by the scan. Some are therefore drawn around the poses at which the scan fits (the improved proposal of Grisetti,
Stachniss, Burgard (2007), as a mixture as in Thrun et al. (2005), sec. 8.3.5). Every particle is weighted by the
ratio of target to proposal density, so that the posterior remains that of the filter. P particles, K alignments.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav import _particles
from glass_nav.geometry import angles
from glass_nav.hypotheses.scan_alignment import Alignment
from glass_nav.localization.particle_filter import resampling
from glass_nav.localization.particle_filter.odometry_prior import MIN_DEVIATION, SLIP_DEVIATION
from glass_nav.localization.particle_filter.pose_estimate import PoseEstimate
from glass_nav.params import number


@dataclass(frozen=True)
class Proposal:
    """How particles are shared between odometry and scan."""

    proposal_scan_share: float = number(0.5, 0.0, 1.0)  # of the particles drawn around aligned poses; 0 turns it off
    proposal_max_beams: int = number(90, 2, 10_000)
    proposal_min_cluster_share: float = number(0.5, 0.0, 1.0)  # below it the cloud has no single place to align from
    odom_slip_probability: float = number(0.001, 0.0, 1.0)  # that a step of odometry is useless

    def __post_init__(self) -> None:
        if not 0.0 <= self.proposal_scan_share < 1.0:
            raise ValueError(f"~proposal_scan_share must be in [0, 1), got {self.proposal_scan_share}")
        if not self.proposal_max_beams >= 2:
            raise ValueError(f"~proposal_max_beams must be >= 2, got {self.proposal_max_beams}")
        if not 0.0 <= self.proposal_min_cluster_share <= 1.0:
            raise ValueError(f"~proposal_min_cluster_share must be in [0, 1], got {self.proposal_min_cluster_share}")
        if not 0.0 <= self.odom_slip_probability < 1.0:
            raise ValueError(f"~odom_slip_probability must be in [0, 1), got {self.odom_slip_probability}")


def draw(
    predicted: np.ndarray,
    weights: np.ndarray,
    best: PoseEstimate,
    aligned: Alignment,
    beam_information: float,
    proposal: Proposal,
    rng: np.random.Generator,
) -> Tuple[np.ndarray, np.ndarray]:
    """Particles from both sources, and what their weights have to be multiplied with.

    Args:
        predicted: (P, 3) particles moved by odometry.
        weights: (P,) of them, sum 1.
        best: their best cluster, which the scan was aligned from.
        aligned: K poses at which the scan fits.
        beam_information: of one aligned beam, across the wall [1/m2].
        proposal: shares and deviations.
        rng: source of all randomness.

    Returns:
        (P, 3) particles and (P,) log of target over proposal density.
    """
    count = int(round(proposal.proposal_scan_share * len(predicted)))
    if not count or not len(aligned.poses):
        return predicted, np.log(weights + 1e-300)
    near = best.covariance + np.diag(MIN_DEVIATION**2)
    slipped = near + np.diag(SLIP_DEVIATION**2)
    # Directions that no wall constrains keep odometry's spread.
    around = np.linalg.inv(aligned.information * beam_information + np.linalg.inv(slipped))
    which = rng.integers(len(aligned.poses), size=count)
    noise = np.einsum("pij,pj->pi", np.linalg.cholesky(around)[which], rng.standard_normal((count, 3)))
    drawn = aligned.poses[which] + noise
    drawn[:, 2] = angles.wrap(drawn[:, 2])
    kept = resampling.low_variance(weights, len(predicted) - count, rng)
    poses = np.concatenate([predicted[kept], drawn])
    log_ratio = _particles.proposal_log_ratio(
        poses,
        len(kept),
        best.map_from_base,
        near,
        slipped,
        aligned.poses,
        around,
        proposal.odom_slip_probability,
        proposal.proposal_scan_share,
    )
    return poses, log_ratio
