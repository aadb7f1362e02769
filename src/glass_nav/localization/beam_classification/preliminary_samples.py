"""Preliminary samples: the poses around the predicted one that vote on the case of each beam.

Seed document glass_localization.txt, step 1, eq. (5): poses at regular angular intervals around the predicted pose.
The document breaks off before it says how far from it. Here radius and heading spread follow from the covariance of
the filter, with lower limits. N samples.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav.geometry import angles
from glass_nav.params import number

_RINGS = (1.0, 2.0)  # of the standard deviation
_WIDEST = 2.0  # headings reach as far, in standard deviations
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)  # multiples of it fill an interval evenly, however many there are


@dataclass(frozen=True)
class PreliminarySamples:
    """How many samples vote, and the limits of their distance from the predicted pose."""

    sample_count: int = number(37, 1, 1000)
    sample_min_radius_m: float = number(0.02, 0.0, 10.0)
    sample_min_heading_rad: float = number(0.005, 0.0, 3.2)
    sample_max_radius_m: float = number(0.5, 0.0, 10.0)
    sample_max_heading_rad: float = number(0.35, 0.0, 3.2)

    def __post_init__(self) -> None:
        if not self.sample_count >= 1:
            raise ValueError(f"~sample_count must be >= 1, got {self.sample_count}")
        if not 0.0 < self.sample_min_radius_m <= self.sample_max_radius_m:
            raise ValueError(
                f"~sample_min_radius_m must be in (0, ~sample_max_radius_m = "
                f"{self.sample_max_radius_m}] m, got {self.sample_min_radius_m}"
            )
        if not 0.0 < self.sample_min_heading_rad <= self.sample_max_heading_rad:
            raise ValueError(
                f"~sample_min_heading_rad must be in (0, ~sample_max_heading_rad = "
                f"{self.sample_max_heading_rad}] rad, got {self.sample_min_heading_rad}"
            )

    def is_exceeded_by(self, covariance: np.ndarray) -> bool:
        """Whether a pose with that covariance (3, 3) is known less well than the least spread of the samples."""
        x, y, heading = np.sqrt(np.diag(covariance)).tolist()
        return max(x, y) > self.sample_min_radius_m or heading > self.sample_min_heading_rad


def around(map_from_base: np.ndarray, covariance: np.ndarray, shape: PreliminarySamples) -> np.ndarray:
    """The predicted pose and rings around it at regular angular intervals.

    Args:
        map_from_base: (3,) predicted pose.
        covariance: (3, 3) of it; its axes shape the rings into ellipses.
        shape: count and limits.

    Returns:
        (N, 3) poses in map; the first is the predicted pose itself.
    """
    variance, axes = np.linalg.eigh(covariance[:2, :2])
    radii = np.minimum(
        np.maximum(np.sqrt(np.maximum(variance, 0.0)), shape.sample_min_radius_m), shape.sample_max_radius_m
    )
    heading = math.sqrt(max(covariance[2, 2], 0.0))
    heading = min(max(heading, shape.sample_min_heading_rad), shape.sample_max_heading_rad)
    on_circle, turns = _pattern(shape.sample_count - 1)
    samples = np.empty((shape.sample_count, 3))
    samples[:] = map_from_base
    samples[1:, :2] += (on_circle * radii) @ axes.T
    samples[1:, 2] += turns * heading
    samples[:, 2] = angles.wrap(samples[:, 2])
    return samples


@functools.lru_cache(maxsize=64)
def _pattern(count: int) -> Tuple[np.ndarray, np.ndarray]:
    """Points (count, 2) on the rings for a spread of 1, and turns (count,) for one of 1."""
    bearing = 2.0 * np.pi * np.arange(count) / max(count, 1)
    on_circle = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1) * np.resize(_RINGS, count)[:, None]
    return on_circle, _WIDEST * (2.0 * np.mod(_GOLDEN * np.arange(1, count + 1), 1.0) - 1.0)
