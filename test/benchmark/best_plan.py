"""The best plan of a robot that knows the map, but not which of some places it is at: edges until it knows.

All places take the same turns. A scan at the end of an edge tells those apart that would look different there
(ExpectedViews), and so do meetpoints of another degree. An exhaustive search finds the turns with the fewest
edges in the mean over the places: of each set of places that are still alike, over all turns from all meetpoints that
it can reach. What the robot sees between meetpoints is not in the plan, so a robot may need fewer edges.
"""

from __future__ import annotations

import heapq
from typing import Dict, List, Tuple

import numpy as np

from glass_nav.topology.search import vote
from glass_nav.topology.search.expected_views import ExpectedViews
from glass_nav.topology.search.matching import Matcher

_MAX_STATES = 500  # of one set of places

State = Tuple[int, ...]  # darts, one of each place, along which the robot came
Plan = Dict[int, int]  # place -> edges


class BestPlan:
    """Of one first meetpoint."""

    def __init__(self, matcher: Matcher, views: ExpectedViews, dart: np.ndarray, poses: np.ndarray) -> None:
        """
        Args:
            matcher: of the atlas.
            views: of its map.
            dart: (C,) along which the robot came, for each place.
            poses: (C, 3) where it stands.
        """
        self._matcher, self._views, self._poses = matcher, views, poses
        self._plans: Dict[Tuple[Tuple[int, ...], State], Plan] = {}
        self._apart: Dict[Tuple[int, int], np.ndarray] = {}
        self._plan = self._best(tuple(range(len(dart))), tuple(dart.tolist()))

    def edges(self, place: int) -> int:
        """How many edges it takes if the robot is at this place; 0: no turns tell."""
        return self._plan.get(place, 0)

    def _best(self, places: Tuple[int, ...], start: State) -> Plan:
        """Of places that are alike, at these darts: the least sum of edges."""
        if len(places) == 1:
            return {places[0]: 0}
        known = self._plans.get((places, start))
        if known is not None:
            return known
        best: Plan = {}
        least = np.inf
        queue: List[Tuple[int, State]] = [(0, start)]
        seen = {start}
        while queue and len(seen) < _MAX_STATES:
            depth, state = heapq.heappop(queue)
            if (depth + 1) * len(places) >= least:  # whatever follows takes more
                break
            for rank in range(int(self._matcher.atlas.degree[self._matcher.atlas.darts.node[state[0]]])):
                after = tuple(int(dart) ^ 1 for dart in self._matcher.departures(np.array(state), rank))
                groups = self._told_apart(places, after)
                if len(groups) == 1:
                    if after not in seen:
                        seen.add(after)
                        heapq.heappush(queue, (depth + 1, after))
                    continue
                plan: Plan = {}
                for group in groups:
                    at = tuple(after[places.index(place)] for place in group)
                    plan.update({place: depth + 1 + more for place, more in self._best(group, at).items()})
                total = sum(plan.values())
                if len(plan) == len(places) and total < least:
                    best, least = plan, total
        self._plans[places, start] = best
        return best

    def _told_apart(self, places: Tuple[int, ...], after: State) -> List[Tuple[int, ...]]:
        """The sets of places that are still alike where the robot has come to."""
        degree = self._matcher.atlas.degree[self._matcher.atlas.darts.node[list(after)]]
        left = list(range(len(places)))
        groups: List[Tuple[int, ...]] = []
        while left:
            first = left[0]
            alike = [
                k
                for k in left
                if degree[k] == degree[first]
                and not self._differs_at(places[first], after[first])[places[k]]
                and not self._differs_at(places[k], after[k])[places[first]]
            ]
            groups.append(tuple(places[k] for k in alike))
            left = [k for k in left if k not in alike]
        return groups

    def _differs_at(self, place: int, dart: int) -> np.ndarray:
        """(C,) bool: a robot from this place that comes along a dart sees that it did not come from the others."""
        if (place, dart) not in self._apart:
            there = np.repeat(self._views.at(np.array([dart])), len(self._poses), axis=0)
            here = np.broadcast_to(self._poses[place], there.shape)
            self._views.arrive(np.zeros(3))  # as many comparisons as it takes
            differs = self._views.differ(there, vote.carried(here, there, self._poses))
            self._apart[place, dart] = differs & self._views.has_room(np.array([dart]))
        return self._apart[place, dart]
