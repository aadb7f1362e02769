"""Decides from the kept scans whether a line is a pane.

Pieces of the line are looked up in every scan that saw them: a beam returned there, passed, or ended before. A pane
returns beams along its normal and lets the others pass; other objects return beams from all directions; clutter and
people return few. The ends of a pane follow from all pieces together, since a single piece is seen head-on by only a
scan or two. Where the map has nothing behind a pane, its own weak echo may be the only one, so that it returns
oblique beams too; other objects return the same there and elsewhere. L pieces, S scans.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Tuple

import numpy as np

from glass_nav.panes import kept_scans
from glass_nav.panes.kept_scans import KeptScans

PIECE_M = 0.1
_BOUNDS_RAD = np.radians([0.0, 3.0, 6.0, 10.0, 15.0, 20.0, 30.0, 45.0, 65.0])  # of incidence
_MIDDLE_RAD = 0.5 * (_BOUNDS_RAD[1:] + _BOUNDS_RAD[:-1])
INCIDENCES = len(_MIDDLE_RAD)
_BINS = 2 * INCIDENCES  # of beams with something mapped behind the line, then of those without
_BEHIND, _OPEN = slice(INCIDENCES), slice(INCIDENCES, _BINS)
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
_PANE_BEFORE_NOTHING = (
    None,
    0.7,
    0.85,
    0.97,
)  # at oblique incidence where the map has nothing behind; None: as elsewhere
_DIRT_RAD = np.radians(30.0)  # of the share at oblique incidence half is lost there, if it is of dust and prints
_PASSER_BY_HEAD_ON = (0.4, 0.2)  # of what stood there for a moment
_FLAT = (0.99, 0.95, 0.9, 0.8, 0.6, 0.35, 0.2, 0.1, 0.03, 0.01)  # things, with gaps or without, and chance
_LEAKS = (1.0, 0.95, 0.9)  # of things at oblique incidence: beams pass their edges
_OBLIQUE_RAD = np.radians(25.0)
_NOTHING, _THING = (0.1, 0.03, 0.01), (0.99, 0.95, 0.9, 0.8)  # of _FLAT: what a line without glass goes through
_CHANGE = 3.4  # nats: a line changes from one kind to another once in 3 m


class Kind(IntEnum):
    """The kind of a piece of a line."""

    PANE = 0
    NOTHING = 1
    THING = 2  # a post, a pillar, furniture


@dataclass(frozen=True)
class Counts:
    """Returns and passes at pieces of a line, by incidence, in front of mapped surfaces and of nothing."""

    returns: np.ndarray  # (L, 2, INCIDENCES)
    passes: np.ndarray  # (L, 2, INCIDENCES)
    seen_from_m: np.ndarray  # (L,) spread along the line of the places that saw returns near the normal

    def head_on(self, pieces: np.ndarray) -> int:
        """Returns near the normal, all pieces (K,) together."""
        return int(self.returns[pieces, :, :_NEAR_NORMAL].sum())

    def oblique(self, pieces: np.ndarray) -> int:
        """Passes at oblique incidence."""
        return int(self.passes[pieces, :, _NEAR_NORMAL:].sum())


def counts(scans: KeptScans, middle_m: np.ndarray, normal: np.ndarray, reach_m: float) -> Counts:
    """Counts returns and passes of all scans at pieces of a line.

    Args:
        scans: the memory.
        middle_m: (L, 2) of the pieces.
        normal: (2,) of the line.
        reach_m: from farther away nothing is learnt.
    """
    laser = scans.map_from_laser
    low, high = middle_m.min(axis=0) - reach_m, middle_m.max(axis=0) + reach_m
    rows = np.flatnonzero(((laser[:, :2] >= low) & (laser[:, :2] <= high)).all(axis=1))
    shape = len(middle_m), 2, INCIDENCES
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
    cell = (2 * np.arange(len(middle_m)) + np.isposinf(mapped)) * INCIDENCES + kind
    tables = [
        np.bincount(cell[which], minlength=np.prod(shape)).reshape(shape).astype(float) for which in (returned, passed)
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
        self._returns, self._passes = ((share * count).reshape(-1, _BINS) for count in (seen.returns, seen.passes))
        self._pane, self._other = self._of(_PANE), self._of(_OTHER)

    def _of(self, shares: np.ndarray, bins: slice = slice(None)) -> np.ndarray:
        """(L, H) log likelihood of each piece, for shares (H, _BINS) of beams that return."""
        shares = shares[:, bins]
        log_likelihoods: np.ndarray = (
            self._returns[:, bins] @ np.log(shares).T + self._passes[:, bins] @ np.log1p(-shares).T
        )
        return log_likelihoods

    def kinds(self, sure: np.ndarray, mapped: np.ndarray) -> np.ndarray:
        """(L,) Kind of each piece: the most probable sequence (Viterbi).

        Args:
            sure: (L,) bool pieces that returned beams head-on; the glass is the one that fits them best. How much of it
                returns before nothing differs from piece to piece, and does not tell it from a thing.
            mapped: (L,) bool pieces that belong to something on the map: they say nothing.
        """
        hypotheses = len(_PANE) // len(_PANE_BEFORE_NOTHING), len(_PANE_BEFORE_NOTHING)
        fits = self._pane[sure].reshape(int(sure.sum()), *hypotheses).max(axis=2).sum(axis=0)
        best = np.argmax(fits + _PANE_LOG_WEIGHT.reshape(hypotheses)[:, 0])
        glass = _PANE.reshape(*hypotheses, _BINS)[best]
        before_nothing = _log_mean(self._of(glass, _OPEN))
        pane = self._of(glass[:1], _BEHIND)[:, 0] + before_nothing
        thing = _log_mean(self._of(_OPAQUE, _BEHIND)) + before_nothing
        likelihoods = np.stack([pane, _log_mean(self._of(_EMPTY)), thing], axis=1)
        return _most_probable(np.where(mapped[:, None], 0.0, likelihoods))

    def whole(self, pieces: np.ndarray) -> float:
        """Log likelihood ratio of some pieces (K,) as one pane."""
        pane, other = self._pane[pieces].sum(axis=0), self._other[pieces].sum(axis=0)
        return float(_log_sum(pane + _PANE_LOG_WEIGHT) - _log_sum(other - np.log(len(other))))


def _most_probable(log_likelihoods: np.ndarray) -> np.ndarray:
    """(L,) the sequence of states with the highest likelihood, of (L, K) by state; each change costs the same."""
    came_from = np.zeros(log_likelihoods.shape, int)
    score, stay = np.zeros(log_likelihoods.shape[1]), np.arange(log_likelihoods.shape[1])
    for piece, likelihood in enumerate(log_likelihoods):
        best = int(np.argmax(score))
        changes = score < score[best] - _CHANGE
        came_from[piece] = np.where(changes, best, stay)
        score = np.maximum(score, score[best] - _CHANGE) + likelihood
    states = np.zeros(len(log_likelihoods), int)
    state = int(np.argmax(score))
    for piece in range(len(states) - 1, -1, -1):
        states[piece] = state
        state = came_from[piece, state]
    return states


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
    """(H, _BINS) share of the beams that a pane returns, by hypothesis, and (H,) the log of its weight."""
    shares, weights = [], []
    for half_rad in _HALF_RAD:
        lobe = _lobe(half_rad)
        for head_on in _PANE_HEAD_ON:
            for ratio, weight in _PANE_OBLIQUE.items():
                for oblique in (np.ones(INCIDENCES), 0.5 ** ((_MIDDLE_RAD / _DIRT_RAD) ** 2)):
                    for open_ratio in _PANE_BEFORE_NOTHING:
                        before = ratio * oblique, ratio * oblique if open_ratio is None else open_ratio
                        shares.append(np.concatenate([head_on * (each * (1.0 - lobe) + lobe) for each in before]))
                        weights.append(weight)
    return np.clip(np.array(shares), 0.01, 0.99), np.log(np.array(weights) / np.sum(weights))


def _other_shares() -> np.ndarray:
    """(H, _BINS) the same for things, chance and people."""
    people = [
        np.tile(head_on * (ratio + (1.0 - ratio) * _lobe(half_rad)), 2)
        for head_on in _PASSER_BY_HEAD_ON
        for ratio in (0.02, 0.15)
        for half_rad in _HALF_RAD
    ]
    return np.clip(np.concatenate([_flat_shares(_FLAT), people]), 0.01, 0.99)


def _flat_shares(shares: "Tuple[float, ...]") -> np.ndarray:
    """(H, _BINS) the same from all directions, except for beams that leak past the edges."""
    leaks = [np.tile(np.where(_MIDDLE_RAD > _OBLIQUE_RAD, leak, 1.0), 2) for leak in _LEAKS]
    return np.clip(np.array([share * leak for share in shares for leak in leaks]), 0.01, 0.99)


(_PANE, _PANE_LOG_WEIGHT), _OTHER = _pane_shares(), _other_shares()
_EMPTY, _OPAQUE = _flat_shares(_NOTHING), _flat_shares(_THING)
