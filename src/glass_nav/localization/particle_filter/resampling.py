"""Resampling, and the number of particles.

Low-variance resampling: Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 4.4. Number of particles: KLD
sampling, Fox, Adapting the Sample Size in Particle Filters (2003). P particles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glass_nav import _particles
from glass_nav.params import number

BIN = np.array([0.5, 0.5, np.radians(10.0)])  # of the histogram over poses, AMCL's: m, m, rad


@dataclass(frozen=True)
class ParticleCount:
    """How many particles; the names and meanings are AMCL's."""

    min_particles: int = number(300, 1, 1_000_000)
    max_particles: int = number(5000, 1, 1_000_000)
    kld_err: float = number(0.01, 1e-6, 1.0)  # largest error between the true and the estimated distribution
    kld_z: float = number(0.99, 0.0, 10.0)  # upper normal quantile of the probability that the error is below kld_err

    def __post_init__(self) -> None:
        if not self.max_particles >= 1:
            raise ValueError(f"~max_particles must be >= 1, got {self.max_particles}")
        if not 1 <= self.min_particles <= self.max_particles:
            raise ValueError(
                f"~min_particles must be in [1, ~max_particles = {self.max_particles}], got {self.min_particles}"
            )
        if not self.kld_err > 0.0:
            raise ValueError(f"~kld_err must be > 0, got {self.kld_err}")
        if not self.kld_z >= 0.0:
            raise ValueError(f"~kld_z must be >= 0, got {self.kld_z}")


def normalised(log_w: np.ndarray) -> np.ndarray:
    """(P,) weights that sum to 1 from log weights of any offset; equal if none is finite."""
    top = np.max(log_w)
    if not np.isfinite(top):
        return np.full(len(log_w), 1.0 / len(log_w))
    w = np.exp(log_w - top)
    return w / w.sum()


def effective_count(weights: np.ndarray) -> float:
    """Number of equal particles that would be worth as much, 1..P."""
    return float(1.0 / np.sum(weights**2))


def tempered(log_w: np.ndarray, min_effective: float = 20.0) -> np.ndarray:
    """(P,) weights that sum to 1, flattened until the effective count is that large.

    If only one particle explains a scan, the error model is more likely wrong than all other particles.
    """
    weights = normalised(log_w)
    min_effective = min(min_effective, 0.5 * len(weights))
    if effective_count(weights) >= min_effective:
        return weights
    low, high = 0.0, 1.0
    for _ in range(20):
        power = 0.5 * (low + high)
        enough = effective_count(normalised(power * log_w)) >= min_effective
        low, high = (power, high) if enough else (low, power)
    return normalised(low * log_w)


def low_variance(weights: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count,) indices of the particles drawn: one random number, then equal strides."""
    return _particles.low_variance(weights, count, rng.uniform())


def enough_particles(poses: np.ndarray, limits: ParticleCount) -> int:
    """Particles needed so that the KL distance to the truth stays below kld_err (Fox, eq. 7).

    Args:
        poses: (P, 3) particles with equal weights; only how many bins they fill counts.
    """
    filled = _particles.count_bins(poses, BIN)
    if filled <= 1:
        return limits.min_particles
    share = 2.0 / (9.0 * (filled - 1))
    needed = (filled - 1) / (2.0 * limits.kld_err) * (1.0 - share + math.sqrt(share) * limits.kld_z) ** 3
    return min(max(math.ceil(needed), limits.min_particles), limits.max_particles)
