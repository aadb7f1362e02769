"""How often does a pane itself answer a beam, rather than let it pass?"""

from __future__ import annotations

import numpy as np

_OBLIQUE_RETURNS = 0.06  # from far to the side: dirt, frames
_MIN_HEAD_ON, _MAX_HEAD_ON = 0.85, 0.9  # more than that, head on; lidars differ
_NARROW_RAD, _WIDE_RAD = np.radians(6.0), np.radians(18.0)  # and how far from head on
_POROUS_RETURNS = 0.3  # of what is no straight wall: railings, shelves, plants


def min_share(incidence_rad: np.ndarray) -> np.ndarray:
    """Share of the beams that come back from clear glass, by their angle to its normal [rad]; of a lidar that sees
    little of it.

    Between what is measured: 15-degree bins .56 .39 .11 .04 0 0 (URG-04LX) and .47 .09 .08 .10 .14 .10
    (RPLidar) on ordinary windows; a 64-ring lidar 5 m away has .97 .91 .82 .36 .20 .14 per 5 degrees.
    NaN, no normal: of what is no pane and can be seen through.
    """
    return _share(incidence_rad, _MIN_HEAD_ON, _NARROW_RAD)


def max_share(incidence_rad: np.ndarray) -> np.ndarray:
    """The same of a lidar that sees much of it."""
    return _share(incidence_rad, _MAX_HEAD_ON, _WIDE_RAD)


def _share(incidence_rad: np.ndarray, head_on: float, width_rad: float) -> np.ndarray:
    lobe = head_on * np.exp(-((incidence_rad / width_rad) ** 2))
    return np.where(np.isnan(incidence_rad), _POROUS_RETURNS, _OBLIQUE_RETURNS + lobe)
