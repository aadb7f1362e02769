"""Protection levels: bounds of the pose error that hold with a stated probability, from a covariance.

The term is that of satellite navigation (RTCA DO-229): the error exceeds its protection level with at most the stated
risk. A pose that is reported as LOCALIZED while its error exceeds the level is misleading information.

Errors of scan registration have heavier tails than a normal distribution, so the multiples of the standard deviation
are those of Student's t, scaled to the same variance. However many beams agree, the map limits how well a pose can be
known: a grid map gives the position of a wall to half a cell, and all walls may be drawn off to the same side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

_FREEDOM = 5.0  # degrees of freedom of the tails
PROBABILITIES = (0.95, 0.999)


def _multiple(probability: float) -> float:
    """Multiple of the standard deviation that an error of either sign exceeds with the remaining probability."""
    return float(special.stdtrit(_FREEDOM, 0.5 + 0.5 * probability) * np.sqrt((_FREEDOM - 2.0) / _FREEDOM))


_MULTIPLES = [_multiple(each) for each in PROBABILITIES]


@dataclass(frozen=True)
class ProtectionLevels:
    """Limits of the error along the robot's heading [m], across it [m], and of the heading [rad]."""

    p95: np.ndarray  # (3,) each is exceeded with a probability of at most 5 %; NaN: no pose
    p999: np.ndarray  # (3,) 0.1 %


UNKNOWN = ProtectionLevels(np.full(3, np.nan), np.full(3, np.nan))


def of(map_from_base: np.ndarray, covariance: np.ndarray, least_m: float) -> ProtectionLevels:
    """Levels of a pose (3,) with a covariance (3, 3) over x [m], y [m], yaw [rad] in map.

    Args:
        map_from_base, covariance: the pose.
        least_m: 99.9 % level along and across that the map allows.
    """
    cos, sin = math.cos(map_from_base[2]), math.sin(map_from_base[2])
    (xx, xy, _), (_, yy, _), (_, _, yaw) = covariance.tolist()
    along, across = (
        cos * cos * xx + 2.0 * cos * sin * xy + sin * sin * yy,
        sin * sin * xx - 2.0 * cos * sin * xy + cos * cos * yy,
    )
    deviations = [math.sqrt(max(variance, 0.0)) for variance in (along, across, yaw)]
    p95, p999 = (np.array([multiple * each for each in deviations]) for multiple in _MULTIPLES)
    p95[2], p999[2] = min(p95[2], math.pi), min(p999[2], math.pi)
    p999[:2] = np.maximum(p999[:2], least_m)
    return ProtectionLevels(p95, p999)
