"""Chooses the turn by a vote of the candidates.

Seed document global_localization_procedure.txt, "Traversing the match edge": the current candidates vote for right or
left. The document does not say what a candidate votes for. In vote_mode seed each votes for the side on which fewer
of the others expect the same as it does; the majority wins, and a tie goes right as in the document's example.

The default, vote_mode best, is the turn with the fewest expected survivors: each candidate may be the true one, and
after a turn those remain that expect what the true one shows. C candidates, R ranks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Set, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.topology.search.expected_views import DECISIVE, ExpectedViews
from glass_nav.topology.search.matching import Matcher

_POLLED = 100  # candidates whose expectations are compared pairwise: 2 ms of a step
_BACK = 0.999  # share of the gain of the way back
_MIN_GAIN = 0.01  # share of the doubt that a turn must remove to be worth taking
_LOOKED_FOR = 3  # places that the leading one is to be told from by driving farther
_LOOKED_AT = 8  # candidates whose views are compared pairwise
_BY_GRAPH_ALONE = 0.8  # chance that a difference of the graph is none where scans would show none: it was drawn so
_EQUAL = 1e-9  # survivors by which two turns differ only by rounding


@dataclass(frozen=True)
class Vote:
    """The candidates' expectations of each turn."""

    ranks: np.ndarray  # (R,)
    survivors: np.ndarray  # (R,) expected number of candidates left; of expected(): probability outside the first
    length_m: np.ndarray  # (R,) mean length of the edges
    rank: int  # of the turn that won
    splits: bool  # some turn leaves fewer candidates than there are
    removed: float = 0.0  # share of the doubt that the turn is expected to remove; of expected() only


def best(matcher: Matcher, dart: np.ndarray) -> Vote:
    """The turn with the fewest expected survivors, and the shortest of several; back only if no other turn splits.

    Args:
        matcher: of the atlas.
        dart: (C,) candidates at a meetpoint of one degree, two or more of them.
    """
    polled = _polled(dart)
    degree = int(matcher.atlas.degree[matcher.atlas.darts.node[dart[0]]])
    survivors, length = [], []
    for rank in range(degree):
        departure = matcher.departures(polled, rank)
        survivors.append(len(dart) * float(_alike(matcher, departure).mean()))
        length.append(float(matcher.length_m[departure >> 1].mean()))
    order = sorted(range(degree), key=lambda rank: (round(survivors[rank] / _EQUAL), rank == 0, length[rank]))
    return Vote(
        np.arange(degree),
        np.array(survivors),
        np.array(length),
        order[0],
        bool(survivors[order[0]] < len(dart) - _EQUAL * len(dart)),
    )


def expected(
    matcher: Matcher,
    dart: np.ndarray,
    share: np.ndarray,
    views: Optional[ExpectedViews] = None,
    poses: Optional[np.ndarray] = None,
) -> Vote:
    """The turn that is expected to leave the least probability outside the leading place per metre driven.

    Args:
        matcher: of the atlas.
        dart: (C,) candidates at a meetpoint of one degree, two or more of them, the likeliest first.
        share: (C,) probability of each, in any unit.
        views: scans at the next meetpoint are evidence, too; None: they are not.
        poses: (C, 3) of the robot at each candidate; None: as it arrives along its dart.
    """
    most = _POLLED if views is None else _LOOKED_AT
    dart, share = dart[:most], share[:most] / share[:most].sum()
    if views is not None:
        poses = views.at(dart) if poses is None else poses[:most]
    degree = int(matcher.atlas.degree[matcher.atlas.darts.node[dart[0]]])
    now = 1.0 - float(share.max())
    outside, length = np.zeros(degree), np.zeros(degree)
    for rank in range(degree):
        departure = matcher.departures(dart, rank)
        likelihood = _alike(matcher, departure).astype(float)  # (C, C) of the second if the first is true
        if views is not None:
            assert poses is not None
            first, second = np.nonzero(np.ones_like(likelihood))
            there = views.at(departure ^ 1)[first]
            nats = views.nats(there, carried(poses[first], there, poses[second]), poses[first])
            nats = np.where(views.has_room(departure[first] ^ 1), nats, 0.0)
            likelihood = np.maximum(likelihood, _BY_GRAPH_ALONE) * np.exp(-nats.reshape(likelihood.shape))
        left = (likelihood * share).max(axis=1) / (likelihood @ share)
        outside[rank] = float(share @ (1.0 - left))
        length[rank] = float(share @ matcher.length_m[departure >> 1])
    gain = (now - outside) / length
    gain[0] *= _BACK  # of equal turns another one
    rank = int(gain.argmax())
    removed = float(now - outside[rank]) / max(now, _EQUAL)
    return Vote(np.arange(degree), outside, length, rank, removed > _MIN_GAIN, removed)


def carried(here: np.ndarray, there: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(P, 3) where a robot ends that is at other (P, 3) and believes to drive from here (P, 3) to there (P, 3)."""
    return se2.compose(other, se2.compose(se2.inverse(here), there))


@dataclass(frozen=True)
class Difference:
    """A meetpoint from which places look different."""

    ranks: List[int]  # turns that lead there
    base_from_there: np.ndarray  # (3,) where the robot will be


def towards_difference(
    matcher: Matcher, views: ExpectedViews, dart: int, pose: np.ndarray, others: np.ndarray
) -> Optional[Difference]:
    """The nearest meetpoint, by edges, where a robot would see for certain that it is not at one of the other
    places; if there is none, where it would see a difference at all.

    Args:
        matcher: of the atlas.
        views: of its map.
        dart: along which the robot came, if the leading place is right.
        pose: (3,) of the robot there.
        others: (C, 3) poses at the other places, the likeliest first; some of them are looked at.

    Returns:
        None: no difference was found, in as many comparisons as a step may take.
    """
    level: List[Tuple[int, List[int]]] = [(dart, [])]
    known: Set[int] = {dart}
    hint: Optional[Difference] = None
    others = others[:_LOOKED_FOR]
    while level and not views.is_exhausted:
        following = []
        for at, ranks in level:
            for rank, departure in enumerate(matcher.ring_from(at)):
                arrival = departure ^ 1
                if arrival not in known:
                    known.add(arrival)
                    following.append((arrival, [*ranks, rank]))
        if not following:
            break
        level = following
        arrivals = np.array([arrival for arrival, _ in following])
        looks = np.flatnonzero(views.has_room(arrivals))
        there = np.repeat(views.at(arrivals[looks]), len(others), axis=0)
        of_others = np.tile(others, (len(looks), 1))
        here = np.broadcast_to(pose, there.shape)
        nats = views.nats(there, carried(here, there, of_others), here)
        nats = nats.reshape(len(looks), len(others)).max(axis=1, initial=0.0)
        if nats.max(initial=0.0) >= (DECISIVE if hint is not None else _EQUAL):
            arrival, ranks = following[int(looks[nats.argmax()])]
            (map_from_there,) = views.at(np.array([arrival]))
            found = Difference(ranks, se2.compose(se2.inverse(pose), map_from_there))
            if nats.max() >= DECISIVE:
                return found
            hint = found
    return hint


def seed(matcher: Matcher, dart: np.ndarray) -> int:
    """The document's majority for left (rank 1) or right (the last rank); 0 where the robot can only turn back."""
    degree = int(matcher.atlas.degree[matcher.atlas.darts.node[dart[0]]])
    if degree <= 2:
        return degree - 1
    left, right = left_right_votes(matcher, dart)
    return 1 if left > right else degree - 1


def left_right_votes(matcher: Matcher, dart: np.ndarray) -> Tuple[int, int]:
    """How many of the candidates (C,) vote for left, and how many for right."""
    degree = int(matcher.atlas.degree[matcher.atlas.darts.node[dart[0]]])
    polled = _polled(dart)
    same: List[np.ndarray] = []
    for rank in (1, degree - 1):
        voter, other = matcher.departures(dart, rank), matcher.departures(polled, rank)
        same.append(_chunked(matcher, voter, other))
    left = int(np.count_nonzero(same[0] < same[1]))
    return left, len(dart) - left


def _chunked(matcher: Matcher, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(C,) how many of the second darts (P,) are like each of the first (C,), in pieces that fit the cache."""
    rows = max(1, 2_000_000 // max(len(second), 1))
    return np.concatenate(
        [matcher.alike_along(first[at : at + rows, None], second).sum(axis=1) for at in range(0, len(first), rows)]
    )


def _alike(matcher: Matcher, departure: np.ndarray) -> np.ndarray:
    return matcher.alike_along(departure[:, None], departure)


def _polled(dart: np.ndarray) -> np.ndarray:
    if len(dart) <= _POLLED:
        return dart
    return dart[np.linspace(0, len(dart) - 1, _POLLED).astype(np.int64)]
