"""Glass return model: the probability that a beam returns from a pane instead of passing it."""

from __future__ import annotations

import numpy as np

_OBLIQUE_RETURNS = 0.06  # at oblique incidence: dirt, frames
_MIN_HEAD_ON, _MAX_HEAD_ON = 0.85, 0.9  # added at normal incidence; lidars differ
_NARROW_RAD, _WIDE_RAD = np.radians(6.0), np.radians(18.0)  # width of that lobe
_POROUS_RETURNS = 0.3  # of things without a normal: railings, shelves, plants


def min_share(incidence_rad: np.ndarray) -> np.ndarray:
    """Share of the beams that return from clear glass by angle to its normal [rad], for a lidar that sees little of it.

    Between the measured shares: 15-degree bins .56 .39 .11 .04 0 0 (URG-04LX) and .47 .09 .08 .10 .14 .10
    (RPLidar) on ordinary windows; a 64-ring lidar 5 m away has .97 .91 .82 .36 .20 .14 per 5 degrees.
    NaN, no normal: of things with gaps, which are no panes.
    """
    return _share(incidence_rad, _MIN_HEAD_ON, _NARROW_RAD)


def max_share(incidence_rad: np.ndarray) -> np.ndarray:
    """The same for a lidar that sees much of it."""
    return _share(incidence_rad, _MAX_HEAD_ON, _WIDE_RAD)


def _share(incidence_rad: np.ndarray, head_on: float, width_rad: float) -> np.ndarray:
    lobe = head_on * np.exp(-((incidence_rad / width_rad) ** 2))
    return np.where(np.isnan(incidence_rad), _POROUS_RETURNS, _OBLIQUE_RETURNS + lobe)
