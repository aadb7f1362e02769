"""A line, kept scans -> is it a pane?

Pieces of the line are looked up in every scan that saw them: a beam returned there, passed, or ended before. A pane
returns what comes along its normal and lets the rest pass; a thing returns what comes from anywhere; clutter and people
return little. L pieces, S scans.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav.panes import kept_scans
from glass_nav.panes.kept_scans import KeptScans

PIECE_M = 0.1
_BOUNDS_RAD = np.radians([0.0, 3.0, 6.0, 10.0, 15.0, 20.0, 30.0, 45.0, 65.0])  # of incidence
_MIDDLE_RAD = 0.5 * (_BOUNDS_RAD[1:] + _BOUNDS_RAD[:-1])
INCIDENCES = len(_MIDDLE_RAD)
_NEAR_NORMAL = 5  # of them: up to 20 degrees
_AT_M = 0.1  # across the line: the beam ended there
_BEHIND_M = 0.2  # it went on behind
_MAP_BEFORE_M = 0.2  # the map has a surface before the line
_MOST = 12  # of each kind and incidence that count: what is seen over and over has the same errors
_TEMPER = 0.5  # scans from places next to each other are not independent
# Shares of the beams that return: along the normal, at oblique incidence over that, and where half is lost between.
_HALF_RAD = np.radians([2.5, 4.0, 6.5, 10.0, 15.0, 20.0])
_PANE_HEAD_ON = (0.99, 0.95, 0.85, 0.7)
_PANE_OBLIQUE = {0.02: 1.0, 0.06: 1.0, 0.15: 1.0, 0.3: 0.7, 0.5: 0.4, 0.7: 0.2, 0.82: 0.1}  # with its weight
_DIRT_RAD = np.radians(30.0)  # of the share at oblique incidence half is lost there, if it is of dust and prints
_PASSER_BY_HEAD_ON = (0.4, 0.2)  # of what stood there for a moment
_FLAT = (0.99, 0.95, 0.9, 0.8, 0.6, 0.35, 0.2, 0.1, 0.03, 0.01)  # things, with gaps or without, and chance
_LEAKS = (1.0, 0.95, 0.9)  # of things at oblique incidence: beams pass their edges
_OBLIQUE_RAD = np.radians(25.0)


@dataclass(frozen=True)
class Counts:
    """What was seen of pieces of a line, by incidence."""

    returns: np.ndarray  # (L, INCIDENCES)
    passes: np.ndarray  # (L, INCIDENCES)
    seen_from_m: np.ndarray  # (L,) spread along the line of the places that saw returns near the normal

    def head_on(self, pieces: np.ndarray) -> int:
        """Returns near the normal, all pieces (K,) together."""
        return int(self.returns[pieces, :_NEAR_NORMAL].sum())

    def oblique(self, pieces: np.ndarray) -> int:
        """Passes at oblique incidence."""
        return int(self.passes[pieces, _NEAR_NORMAL:].sum())


def counts(scans: KeptScans, middle_m: np.ndarray, normal: np.ndarray, reach_m: float) -> Counts:
    """What all scans say of pieces of a line.

    Args:
        scans: the memory.
        middle_m: (L, 2) of the pieces.
        normal: (2,) of the line.
        reach_m: from farther away nothing is learnt.
    """
    laser = scans.map_from_laser
    low, high = middle_m.min(axis=0) - reach_m, middle_m.max(axis=0) + reach_m
    rows = np.flatnonzero(((laser[:, :2] >= low) & (laser[:, :2] <= high)).all(axis=1))
    shape = len(middle_m), INCIDENCES
    if not len(rows):
        return Counts(np.zeros(shape), np.zeros(shape), np.zeros(len(middle_m)))
    laser = laser[rows]
    to_piece = middle_m - laser[:, None, :2]  # (S, L, 2)
    away_m = np.hypot(to_piece[..., 0], to_piece[..., 1])
    bearing = np.arctan2(to_piece[..., 1], to_piece[..., 0]) - laser[:, 2, None]
    direction = kept_scans.direction_of(bearing)
    measured = scans.measured_m[rows[:, None], direction]
    mapped = scans.mapped_m[rows[:, None], direction]
    cos = np.abs(to_piece @ normal) / np.maximum(away_m, 1e-9)
    kind = np.searchsorted(_BOUNDS_RAD, np.arccos(np.clip(cos, 0.0, 1.0)), side="right") - 1
    with np.errstate(invalid="ignore"):
        beyond_m = (measured - away_m) * cos
        seen = (away_m <= reach_m) & (kind < INCIDENCES) & ~((mapped - away_m) * cos < -_MAP_BEFORE_M)
        returned = seen & (np.abs(beyond_m) <= _AT_M)
        lost = np.isposinf(measured) & (cos * scans.range_max_m[rows, None] ** 2 > 4.0 * away_m**2)
        passed = seen & (beyond_m > _BEHIND_M) & (np.isfinite(measured) | lost)
    piece = np.broadcast_to(np.arange(len(middle_m)), kind.shape)
    tables = [
        np.bincount(piece[which] * INCIDENCES + kind[which], minlength=shape[0] * INCIDENCES)
        .reshape(shape)
        .astype(float)
        for which in (returned, passed)
    ]
    tangent = np.array([normal[1], -normal[0]])
    place_m = laser[:, :2] @ tangent
    near = returned & (kind < _NEAR_NORMAL)
    spread = np.where(near, place_m[:, None], -np.inf).max(axis=0) - np.where(near, place_m[:, None], np.inf).min(
        axis=0
    )
    return Counts(tables[0], tables[1], np.where(np.isfinite(spread), spread, 0.0))


class Likelihoods:
    """How well pieces of a line agree with a pane, and with what else it may be."""

    def __init__(self, seen: Counts) -> None:
        share = _TEMPER * np.minimum(1.0, _MOST / np.maximum(seen.returns + seen.passes, 1.0))
        returns, passes = share * seen.returns, share * seen.passes
        self._pane = returns @ np.log(_PANE).T + passes @ np.log1p(-_PANE).T  # (L, H)
        self._other = returns @ np.log(_OTHER).T + passes @ np.log1p(-_OTHER).T

    def pieces(self, sure: np.ndarray) -> np.ndarray:
        """(L,) log likelihood ratio of each piece; the lobe is the one that fits the sure pieces (L,) bool best."""
        best = np.argmax(self._pane[sure].sum(axis=0) + _PANE_LOG_WEIGHT)
        ratio: np.ndarray = self._pane[:, best] - _log_mean(self._other)
        return ratio

    def whole(self, pieces: np.ndarray) -> float:
        """Log likelihood ratio of some pieces (K,) as one pane."""
        pane, other = self._pane[pieces].sum(axis=0), self._other[pieces].sum(axis=0)
        return float(_log_sum(pane + _PANE_LOG_WEIGHT) - _log_sum(other - np.log(len(other))))


def _log_sum(values: np.ndarray) -> float:
    return float(np.logaddexp.reduce(values))


def _log_mean(values: np.ndarray) -> np.ndarray:
    """(N,) log of the mean of exp of the rows (N, M)."""
    top = values.max(axis=1)
    log_mean: np.ndarray = top + np.log(np.mean(np.exp(values - top[:, None]), axis=1))
    return log_mean


def _lobe(half_rad: float) -> np.ndarray:
    """(INCIDENCES,) 1 along the normal, 0 far from it."""
    lobe: np.ndarray = 0.5 ** ((_MIDDLE_RAD / half_rad) ** 4)
    return lobe


def _pane_shares() -> "Tuple[np.ndarray, np.ndarray]":
    """(H, INCIDENCES) share of the beams that a pane returns, by hypothesis, and (H,) the log of its weight."""
    shares, weights = [], []
    for half_rad in _HALF_RAD:
        for head_on in _PANE_HEAD_ON:
            for ratio, weight in _PANE_OBLIQUE.items():
                for oblique in (np.ones(INCIDENCES), 0.5 ** ((_MIDDLE_RAD / _DIRT_RAD) ** 2)):
                    lobe = _lobe(half_rad)
                    shares.append(head_on * (ratio * oblique * (1.0 - lobe) + lobe))
                    weights.append(weight)
    return np.clip(np.array(shares), 0.01, 0.99), np.log(np.array(weights) / np.sum(weights))


def _other_shares() -> np.ndarray:
    """(H, INCIDENCES) the same for things, chance and people."""
    leaks = [np.where(_MIDDLE_RAD > _OBLIQUE_RAD, leak, 1.0) for leak in _LEAKS]
    flat = [share * leak for share in _FLAT for leak in leaks]
    people = [
        head_on * (ratio + (1.0 - ratio) * _lobe(half_rad))
        for head_on in _PASSER_BY_HEAD_ON
        for ratio in (0.02, 0.15)
        for half_rad in _HALF_RAD
    ]
    return np.clip(np.array(flat + people), 0.01, 0.99)


(_PANE, _PANE_LOG_WEIGHT), _OTHER = _pane_shares(), _other_shares()
