"""The best plan of a robot that knows the map but not which of some places it is at: edges until only one is left.

An exhaustive search over turns, breadth first. A state is the dart along which the robot came to a meetpoint, and the
darts of the other places that it cannot tell from that one. An edge rules out a place if the atlas has another edge or
meetpoint there (Matcher.alike_along), or if a scan at its end would look different (ExpectedViews). What the robot sees
between meetpoints is not in the plan, so a robot may need fewer edges.
"""

from __future__ import annotations

from typing import List, Optional, Tuple

import numpy as np

from glass_nav.topology.search.expected_views import ExpectedViews
from glass_nav.topology.search.matching import Matcher

_MAX_STATES = 100_000


def edges(matcher: Matcher, views: ExpectedViews, true_dart: int, others: np.ndarray) -> Optional[int]:
    """How many edges it takes; None: no turns tell the places apart, or there are too many to try.

    Args:
        matcher: of the atlas.
        views: of its meetpoints.
        true_dart: along which the robot came.
        others: (C,) along which it would have come.
    """
    if not len(others):
        return 0
    start = (true_dart, *sorted(others.tolist()))
    level: List[Tuple[int, ...]] = [start]
    known, depth = {start}, 0
    while level and len(known) < _MAX_STATES:
        depth += 1
        following: List[Tuple[int, ...]] = []
        for state in level:
            degree = int(matcher.atlas.degree[matcher.atlas.darts.node[state[0]]])
            for rank in range(degree):
                after = _after(matcher, views, np.array(state), rank)
                if len(after) == 1:
                    return depth
                if after not in known:
                    known.add(after)
                    following.append(after)
        level = following
    return None


def _after(matcher: Matcher, views: ExpectedViews, dart: np.ndarray, rank: int) -> Tuple[int, ...]:
    """The state after a turn, that of the robot first."""
    departure = matcher.departures(dart, rank)
    true, others = departure[:1], departure[1:]
    left = matcher.alike_along(true, others) & matcher.alike_along(others, true)
    views.arrive(departure[:0])  # as many comparisons as it takes
    left[left] = views.alike(np.repeat(true ^ 1, left.sum()), others[left] ^ 1)
    return (int(true[0] ^ 1), *sorted((others[left] ^ 1).tolist()))
