"""Glass return model: the probability that a beam returns from a pane instead of passing it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_OBLIQUE_RETURNS = 0.06  # at oblique incidence: dirt, frames
_MIN_HEAD_ON, _MAX_HEAD_ON = 0.85, 0.9  # added at normal incidence; lidars differ
_NARROW_RAD, _WIDE_RAD = np.radians(6.0), np.radians(18.0)  # width of that lobe
_POROUS_RETURNS = 0.3  # of things without a normal: railings, shelves, plants
_FLATTEST_RAD, _STEEPEST_RAD = np.radians(35.0), np.radians(70.0)  # oblique, and a return is told from a passage
_SURELY_GLASS = 0.9
_PRIOR_BEAMS, _MOST_BEAMS = 50.0, 5000.0  # that the usual share is worth; that are remembered


@dataclass(frozen=True)
class ObliqueReturns:
    """The share of beams that this lidar gets back from panes at oblique incidence, learnt while driving."""

    returned: float = _OBLIQUE_RETURNS * _PRIOR_BEAMS
    met: float = _PRIOR_BEAMS

    @property
    def share(self) -> float:
        """0..1."""
        return self.returned / self.met

    def learn(
        self, measured_m: np.ndarray, first_m: np.ndarray, incidence_rad: np.ndarray, glass: np.ndarray, gate_m: float
    ) -> "ObliqueReturns":
        """Learn from a scan at a trusted pose.

        Args:
            measured_m: (B,) ranges by REP 117.
            first_m: (B,) range of the first surface.
            incidence_rad: (B,) angle to its normal, NaN without one.
            glass: (B,) probability that it is glass.
            gate_m: across the surface; a beam that ends farther away did not end at it.
        """
        with np.errstate(invalid="ignore"):
            oblique = (incidence_rad > _FLATTEST_RAD) & (incidence_rad < _STEEPEST_RAD) & (glass > _SURELY_GLASS)
            across_m = (measured_m - first_m) * np.cos(incidence_rad)
            returned = np.count_nonzero(oblique & (np.abs(across_m) <= gate_m))
            passed = np.count_nonzero(oblique & (across_m > 2.0 * gate_m))
        met = self.met + returned + passed
        scale = min(1.0, _MOST_BEAMS / met)
        return ObliqueReturns(scale * (self.returned + returned), scale * met)

    def of_surfaces(self, cos_incidence: np.ndarray, glass: np.ndarray) -> np.ndarray:
        """(B,) share of beams that come back from surfaces which are glass with that probability (B,)."""
        of_glass = np.maximum(self.share, min_share(np.arccos(np.clip(cos_incidence, 0.0, 1.0))) - _OBLIQUE_RETURNS)
        return 1.0 - glass * (1.0 - of_glass)


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
