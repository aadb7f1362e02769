"""Proves that no turns can tell candidates apart, or finds turns that do.

Two darts are indistinguishable if robots that take the same turns from them always see the same. The search runs over
pairs of darts, beginning with the candidates, and follows every turn. If all pairs that it reaches are alike, the
first ones are proved indistinguishable. Otherwise the first pair that is not alike gives the shortest sequence of
turns that tells them apart. Two darts are alike if a robot without measurement errors would not rule out one of them
at the other (Matcher.alike_along).

If a and b, and b and c are proved indistinguishable, so are a and c by assumption; if a and c differ after all, a
turn splits the candidates and no proof is needed. So a symmetric floor of n darts costs about n pairs and not n^2. C
candidates, P pairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Tuple

import numpy as np

from glass_nav.topology.search.expected_views import ExpectedViews
from glass_nav.topology.search.matching import Matcher

MAX_PAIRS = 200_000  # of one search; a torus of 40,000 darts takes 40,000 pairs


@dataclass(frozen=True)
class Proof:
    """The result of the search over pairs."""

    indistinguishable: bool  # all candidates are
    ranks: Optional[List[int]]  # turns that tell two of them apart; None: proved, or the search was stopped
    pairs: int  # searched


def prove(
    matcher: Matcher,
    dart: np.ndarray,
    max_pairs: int = MAX_PAIRS,
    views: Optional[ExpectedViews] = None,
) -> Proof:
    """Whether candidates can be told apart.

    Args:
        matcher: of the atlas.
        dart: (C,) candidates at meetpoints that are alike.
        max_pairs: the search stops after this number.
        views: scans at meetpoints tell them apart, too; None: they do not.
    """
    group = np.arange(len(dart))
    searched, known = 0, np.zeros((0, 2), np.int64)
    while True:
        apart = np.flatnonzero(group != group[0])
        if not len(apart):
            return Proof(views is None or not views.is_exhausted, None, searched)
        met, ranks = _search(matcher, dart[0], dart[apart[0]], max_pairs - searched, views)
        searched += len(met)
        if ranks is not None or searched >= max_pairs:
            return Proof(False, ranks, searched)
        known = np.concatenate([known, met])
        group = _groups(known, dart)


def _groups(pairs: np.ndarray, dart: np.ndarray) -> np.ndarray:
    """(C,) label of each dart; pairs (P, 2) connect darts of the same label."""
    from scipy.sparse import coo_matrix, csgraph  # slow to import

    names, compact = np.unique(np.concatenate([pairs.ravel(), dart]), return_inverse=True)
    links = compact[: pairs.size].reshape(-1, 2)
    graph = coo_matrix((np.ones(len(links), np.int8), (links[:, 0], links[:, 1])), shape=(len(names),) * 2)
    return csgraph.connected_components(graph, directed=False)[1][compact[pairs.size :]]


def _search(
    matcher: Matcher,
    first: int,
    second: int,
    max_pairs: int,
    views: Optional[ExpectedViews],
) -> Tuple[np.ndarray, Optional[List[int]]]:
    """The pairs (P, 2) that turns lead to from one pair, level by level, and the turns to the first that differs."""
    count = len(matcher.atlas.darts)
    start = np.array([_key(np.array([first]), np.array([second]), count)[0]])
    levels: List[Tuple[np.ndarray, np.ndarray, np.ndarray]] = []  # keys, index in the level before, rank
    frontier, visited = start, start
    while len(frontier) and len(visited) <= max_pairs:
        a, b = np.divmod(frontier, count)
        keys, parents, turned = [], [], []
        degree = matcher.atlas.degree[matcher.atlas.darts.node[a]]  # that of b as well: the pair is alike
        for rank in range(int(degree.max())):
            able = np.flatnonzero(degree > rank)
            one, other = (
                matcher.atlas.clockwise(a[able], np.array(rank)),
                matcher.atlas.clockwise(b[able], np.array(rank)),
            )
            alike = matcher.alike_along(one, other) & matcher.alike_along(other, one)
            if views is not None:
                alike[alike] = views.alike(one[alike] ^ 1, other[alike] ^ 1)
            bad = np.flatnonzero(~alike)
            if len(bad):
                return _pairs(visited, count), _turns(levels, int(able[bad[0]]), rank)
            keys.append(_key(one ^ 1, other ^ 1, count))
            parents.append(able)
            turned.append(np.full(len(able), rank))
        key, index = np.unique(np.concatenate(keys), return_index=True)
        new = np.isin(key, visited, assume_unique=True, invert=True)
        frontier, index = key[new], index[new]
        levels.append((frontier, np.concatenate(parents)[index], np.concatenate(turned)[index]))
        visited = np.concatenate([visited, frontier])
    return _pairs(visited, count), None


def _key(a: np.ndarray, b: np.ndarray, count: int) -> np.ndarray:
    """(P,) one number for a pair; pairs have no order, the smaller dart comes first."""
    return np.minimum(a, b) * count + np.maximum(a, b)


def _pairs(key: np.ndarray, count: int) -> np.ndarray:
    return np.stack(np.divmod(key, count), axis=-1)


def _turns(levels: List[Tuple[np.ndarray, np.ndarray, np.ndarray]], index: int, last_rank: int) -> List[int]:
    """Ranks from the first pair to the one at this index of the last level, and the rank taken there."""
    ranks = [last_rank]
    for _, parents, turned in reversed(levels):
        ranks.append(int(turned[index]))
        index = int(parents[index])
    return ranks[::-1]
