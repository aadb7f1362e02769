"""Learns the intensity of mapped walls, and tells which returns differ from it.

Drivers give intensities in their own units: some fall with range and incidence, some are corrected for that, some are
constant. Mean and deviation of the intensities of mapped walls are learnt while the robot drives, by range and
incidence, so no calibration is needed. N returns.
"""

from __future__ import annotations

import numpy as np

_RANGE_M = np.array([0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0])  # bounds of the bins
_INCIDENCE_RAD = np.radians([6.0, 12.0, 20.0, 30.0, 45.0, 60.0])
_BINS = len(_RANGE_M) + 1, len(_INCIDENCE_RAD) + 1
_LEAST_RETURNS = 50  # of a bin, before it says something
_LEAST_SHARE = 0.1  # of the mean: no wall is known better
_CONSTANT_SHARE = 0.01  # of the mean, all bins together: such intensities carry nothing
_CHORD = 3  # beams to either side, whose ends show how a surface runs
# Deviations of a return: of a pane, which mirrors the beam straight back; of a thing, as walls or of another colour.
_PANE_SIGMA, _THING_SIGMA, _OTHER_COLOUR = 5.0, 1.5, 0.2
_MOST_LOG_ODDS = 2.0  # returns of one pane are of one kind: together they count as little


class WallIntensity:
    """The intensities of the mapped walls, of one lidar."""

    def __init__(self) -> None:
        self._count = np.zeros(_BINS[0] * _BINS[1])
        self._sum = np.zeros_like(self._count)
        self._squares = np.zeros_like(self._count)

    def learn(self, range_m: np.ndarray, incidence_rad: np.ndarray, intensity: np.ndarray) -> None:
        """Returns of mapped walls, all (N,)."""
        usable = np.isfinite(intensity) & np.isfinite(incidence_rad)
        bins = _bins(range_m[usable], incidence_rad[usable])
        for total, power in ((self._count, 0), (self._sum, 1), (self._squares, 2)):
            total += np.bincount(bins, intensity[usable] ** power, minlength=len(total))

    @property
    def is_informative(self) -> bool:
        """Whether the intensities differ at all."""
        count = self._count.sum()
        if count < _LEAST_RETURNS:
            return False
        mean = self._sum.sum() / count
        variance = self._squares.sum() / count - mean**2
        return bool(variance > (_CONSTANT_SHARE * mean) ** 2)

    def excess(self, range_m: np.ndarray, incidence_rad: np.ndarray, intensity: np.ndarray) -> np.ndarray:
        """(N,) deviations by which returns differ from walls at that range and incidence; NaN where that is not known."""
        if not self.is_informative:
            return np.full(len(range_m), np.nan)
        count = np.maximum(self._count, 1.0)
        mean = self._sum / count
        sigma = np.sqrt(np.maximum(self._squares / count - mean**2, (_LEAST_SHARE * mean) ** 2))
        sigma[(self._count < _LEAST_RETURNS) | (sigma == 0.0)] = np.nan
        bins = _bins(range_m, incidence_rad)
        deviations: np.ndarray = (intensity - mean[bins]) / sigma[bins]
        return deviations


def log_odds(excess: np.ndarray) -> float:
    """Log odds of a pane against other objects, from the excess (N,) of returns near its normal; 0 if unknown."""
    known = excess[np.isfinite(excess)]
    if not len(known):
        return 0.0
    pane = _normal(known, _PANE_SIGMA)
    thing = (1.0 - _OTHER_COLOUR) * _normal(known, _THING_SIGMA) + _OTHER_COLOUR * pane
    return float(_MOST_LOG_ODDS * np.mean(np.log(pane / thing)) / np.log(1.0 / _OTHER_COLOUR))


def incidence(points_m: np.ndarray, beam_rad: np.ndarray) -> np.ndarray:
    """(B,) angles between the beams of a scan and the normals of what they met; NaN beside a beam without a return.

    Args:
        points_m: (B, 2) where they ended, NaN: nowhere.
        beam_rad: (B,) their directions.
    """
    chord = np.full((len(points_m), 2), np.nan)
    chord[_CHORD:-_CHORD] = points_m[2 * _CHORD :] - points_m[: -2 * _CHORD]
    along, across = np.cos(beam_rad), np.sin(beam_rad)
    on_beam = np.abs(chord[:, 0] * along + chord[:, 1] * across)
    beside = np.abs(chord[:, 1] * along - chord[:, 0] * across)
    angle: np.ndarray = np.arctan2(on_beam, beside)
    return angle


def _bins(range_m: np.ndarray, incidence_rad: np.ndarray) -> np.ndarray:
    """(N,) number of the bin."""
    bins: np.ndarray = np.searchsorted(_RANGE_M, range_m) * _BINS[1] + np.searchsorted(_INCIDENCE_RAD, incidence_rad)
    return bins


def _normal(values: np.ndarray, sigma: float) -> np.ndarray:
    density: np.ndarray = np.exp(-0.5 * (values / sigma) ** 2) / sigma
    return density
