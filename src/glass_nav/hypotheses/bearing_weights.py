"""Weights of the particles by bearings to landmarks.

Each bearing is either normally distributed around the one expected by the particle, or wrong and uniform. So a tag
seen in a mirror, or a wrong id, changes the weights only by a bounded amount. P particles, N bearings; weights are
natural logarithms, not normalised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.params import number
from glass_nav.sensing import bearing_model
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.world.landmark_map import LandmarkMap


@dataclass(frozen=True)
class BearingMixture:
    """How a bearing spreads around the expected one."""

    bearing_wrong_share: float = number(0.02, 0.0, 1.0)  # of bearings that are wrong
    # [rad] smallest deviation of a bearing: particles have gaps between them
    bearing_sigma_floor: float = number(0.01, 0.0, 3.2)

    def __post_init__(self) -> None:
        if not 0.0 < self.bearing_wrong_share < 1.0:
            raise ValueError(f"~bearing_wrong_share must be > 0 and < 1, got {self.bearing_wrong_share}")
        if not 0.0 <= self.bearing_sigma_floor < np.inf:
            raise ValueError(f"~bearing_sigma_floor must be >= 0 rad, got {self.bearing_sigma_floor}")


def log_weights(
    particles: np.ndarray,
    bearings: LandmarkBearings,
    landmarks: LandmarkMap,
    mixture: BearingMixture = BearingMixture(),
) -> np.ndarray:
    """Log likelihood of the bearings for every particle.

    Args:
        particles: (P, 3) map_from_base at the bearings' stamp.
        bearings: N of them, any number.
        landmarks: that they are of.
        mixture: how often a bearing is wrong, and how sharp a right one is.

    Returns:
        (P,) all 0 without bearings.

    Raises:
        UnknownLandmark: an id that is not on the map.
    """
    if not len(bearings):
        return np.zeros(len(particles))
    seen = bearing_model.sightings(bearings, landmarks)
    sight_m = bearing_model.lines_of_sight(seen, particles)
    residual = bearing_model.residuals(seen, particles, sight_m)
    variance = np.maximum(bearing_model.variances(seen, sight_m), mixture.bearing_sigma_floor**2)
    right = np.exp(-0.5 * residual * residual / variance) / np.sqrt(2.0 * np.pi * variance)
    wrong = mixture.bearing_wrong_share
    return np.log((1.0 - wrong) * right + wrong / (2.0 * np.pi)).sum(axis=1)
