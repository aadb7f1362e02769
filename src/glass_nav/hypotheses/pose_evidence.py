"""The evidence for poses from what a robot sees: log likelihood ratios to `elsewhere`, and of one pose to another.

A piece of wall supports a pose if the map explains it from there, glass included, and opposes it otherwise. Elsewhere the
map explains as much as it does by chance. The ratio of one piece is bounded, since the pieces of one moved object are
wrong together. Between two poses of the map, what one of them contradicts says more: the beam went through furniture, or
ended far from all walls (scan_explanation.py). A near miss says less, since the map is drawn to a few cells.

K poses, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import special

from glass_nav.hypotheses import new_walls
from glass_nav.hypotheses.map_scans import MapScans
from glass_nav.hypotheses.scan_explanation import BeamsExplained
from glass_nav.sensing.scan import Scan

NEW = -2  # label of a pose without a weight
OFF_M, OFF_RAD = 0.2, np.radians(10.0)  # a pose that odometry has carried is off by this at most
_NATS = 0.5  # of a piece of wall that the map explains, to one that it does not
_NEAR_MISS = 0.5  # of the evidence of a piece that is given back between two poses
_BLOCKED_NATS = 1.0  # that a piece of the path takes from a pose where walls block it
_THING = 2.0  # pieces of one thing that was moved
_UNCHANGED = 9.0  # things that were not moved for one that was, by the prior
_TYPICAL = 100.0  # pieces seen by the time that a robot has come to where places differ


@dataclass(frozen=True)
class View:
    """A scan that showed new walls."""

    scan: Scan
    odom_from_base: np.ndarray  # (3,)
    driven_m: float
    pieces: np.ndarray  # (B,) new walls that each beam shows
    chance: float  # share that is explained elsewhere

    @property
    def most(self) -> float:
        """Evidence of a pose from which the map explains all of it."""
        return _NATS * (1.0 - self.chance) * float(self.pieces.sum())


@dataclass(frozen=True)
class Evidence:
    """The evidence for K poses."""

    nats: np.ndarray  # (K,) log likelihood ratios to elsewhere, by the scans and the path
    checked_nats: np.ndarray  # (K,) the part of them by scans that did not choose the pose
    explained: np.ndarray  # (K,) pieces of wall that the map explains
    seen: np.ndarray  # (K,) pieces of wall that it should
    missed: np.ndarray  # (K,) pieces of wall that it neither explains nor contradicts: near misses
    contradicted: np.ndarray  # (K,) pieces of wall that it contradicts
    other_nats: np.ndarray  # (K,) log likelihood ratios by what is not a scan
    label: np.ndarray  # (K,) int, given by the caller; NEW: not weighted yet

    @classmethod
    def none(cls, count: int) -> Evidence:
        nothing = np.zeros(count)
        label = np.full(count, NEW, np.int64)
        return cls(nothing, nothing, nothing, nothing, nothing, nothing, nothing, label)

    def __getitem__(self, chosen: np.ndarray) -> Evidence:
        return Evidence(*(values[chosen] for values in vars(self).values()))

    def then(self, more: Evidence) -> Evidence:
        """The evidence for these poses and for more of them."""
        return Evidence(*map(np.concatenate, zip(vars(self).values(), vars(more).values())))

    def with_view(self, view: OfView) -> Evidence:
        return replace(
            self,
            nats=self.nats + view.nats,
            checked_nats=self.checked_nats + view.nats,
            explained=self.explained + view.explained,
            seen=self.seen + view.seen,
            missed=self.missed + view.missed,
            contradicted=self.contradicted + view.contradicted,
        )

    def with_path(self, blocked: np.ndarray) -> Evidence:
        """Of which so many pieces (K,) are blocked."""
        nats = _BLOCKED_NATS * blocked
        return replace(self, nats=self.nats - nats, checked_nats=self.checked_nats - nats)

    @property
    def total(self) -> np.ndarray:
        """(K,) log likelihood ratios by all."""
        return self.nats + self.other_nats

    @property
    def between_nats(self) -> np.ndarray:
        """(K,) log likelihood ratios of the poses to each other, to be added to those to elsewhere.

        What the map contradicts tells more than a near miss.
        """
        return _NEAR_MISS * _NATS * self.missed + _surprise(self.contradicted, self.seen)

    @property
    def share(self) -> np.ndarray:
        """(K,) of the walls seen that the map explains; NaN: nothing was seen that it knows."""
        return np.where(self.seen > 0.0, self.explained / np.where(self.seen > 0.0, self.seen, 1.0), np.nan)


class OfView(NamedTuple):
    """What one view says of K poses; as of Evidence."""

    nats: np.ndarray
    explained: np.ndarray
    seen: np.ndarray
    missed: np.ndarray
    contradicted: np.ndarray


def expected_nats(scans: MapScans, map_from_base: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(K,) log likelihood ratios of a pose (3,) to others (K, 3) that a robot at the first one can expect of one scan.

    0 where nothing would be seen.
    """
    beams = scans.beams(scans.seen_from(map_from_base), np.concatenate([map_from_base[None], others]), OFF_M, OFF_RAD)
    if beams is None:
        return np.zeros(len(others))
    pieces = new_walls.pieces(beams.ends_m)
    missed = (beams.known & ~beams.explained & ~beams.contradicted) @ pieces
    contradicted = np.array([_pieces_at(beams, at) for at in beams.contradicted_at])
    nats = -_NATS * ((1.0 - _NEAR_MISS) * missed + contradicted) + _surprise(
        contradicted, np.full(len(missed), _TYPICAL)
    )
    return np.maximum(nats[0] - nats[1:], 0.0)


def _pieces_at(beams: BeamsExplained, at: np.ndarray) -> float:
    """Pieces of wall that the beams show at these shares (B,) of their lengths; NaN: nothing."""
    shown = ~np.isnan(at)
    return float(new_walls.pieces(beams.ends_m[shown] * at[shown, None]).sum())


def _surprise(contradicted: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(K,) log likelihood that the map contradicts so many (K,) of the pieces seen (K,), to that of none.

    It depends on how often that happens: where nothing was moved one cupboard in the wrong place says much, where many
    things were moved it says little. The rate is unknown, but has a prior; the likelihood is integrated over all rates.
    """
    things, all_things = contradicted / _THING, seen / _THING
    rates = special.betaln(1.0 + things, _UNCHANGED + np.maximum(all_things - things, 0.0))
    return rates - special.betaln(1.0, _UNCHANGED + all_things)


def of_view(beams: BeamsExplained, view: View) -> OfView:
    """What a view says of the poses of its beams."""
    seen, explained = beams.known @ view.pieces, beams.explained @ view.pieces
    nats = _NATS * (explained - view.chance * seen)
    missed = beams.known & ~beams.explained & ~beams.contradicted
    return OfView(nats, explained, seen, missed @ view.pieces, beams.contradicted @ view.pieces)
