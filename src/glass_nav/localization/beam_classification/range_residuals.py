"""Learns how measured ranges differ from ray casts at walls: offset and spread.

A ray cast ends at the near boundary of the first occupied cell. A beam ends at the wall: half a cell deeper on a thin
wall, decimetres deeper where the mapping lidar was noisy. That depth, as a share of the drawn thickness, and its
spread depend on map and lidar. They are learnt while driving, perpendicular to the surface, and used by every model
that compares ranges with the map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_NEAR_M = 0.6  # a beam that ended farther from the wall met something else
_SIGMAS = 3.0  # and so, most likely, did one that ended this far outside of the wall as it is drawn
_MIN_BEAMS = 20
_MEMORY = 0.95  # per scan that is taken in
_MAD = 1.4826  # standard deviation of a normal distribution over its median absolute deviation


@dataclass(frozen=True)
class RangeResiduals:
    """How beams end at walls."""

    depth_share: float  # of the drawn thickness, behind the near boundary, 0..1
    sigma_m: float  # around that, across the surface

    def learn(
        self, across_m: np.ndarray, thickness_m: np.ndarray, min_sigma_m: float, max_sigma_m: float
    ) -> "RangeResiduals":
        """Learn from a scan at a trusted pose.

        Args:
            across_m: (B,) range residuals to the near boundary times cosine of incidence.
            thickness_m: (B,) of the wall there, as drawn.
            min_sigma_m, max_sigma_m: limits of the spread.
        """
        off = np.abs(across_m - self.depth_share * thickness_m)
        near = off < _NEAR_M
        if np.count_nonzero(near) < _MIN_BEAMS:
            return self
        near = _unless_few(near & (off < _SIGMAS * self.sigma_m + thickness_m), near)
        share = min(max(_median(across_m[near] / thickness_m[near]), 0.0), 1.0)
        at_wall = _unless_few(near & (off < _SIGMAS * self.sigma_m), near)
        sigma = _MAD * _median(off[at_wall])
        return RangeResiduals(
            _MEMORY * self.depth_share + (1.0 - _MEMORY) * share,
            min(max(_MEMORY * self.sigma_m + (1.0 - _MEMORY) * sigma, min_sigma_m), max_sigma_m),
        )


def _median(values: np.ndarray) -> float:
    """Of some that are no NaN; np.median takes four times as long for those of a scan."""
    middle = len(values) // 2
    parted = np.partition(values, [max(middle - 1, 0), middle])
    return float(parted[middle] if len(values) % 2 else 0.5 * (parted[middle - 1] + parted[middle]))


def _unless_few(chosen: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    return chosen if np.count_nonzero(chosen) >= _MIN_BEAMS else otherwise
