"""State and turn from the candidates of the search forest alone, without scans."""

from __future__ import annotations

from dataclasses import replace
from typing import Optional, Set

import numpy as np

from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search import ambiguity, claim, vote
from glass_nav.topology.search.claim import Claim
from glass_nav.topology.search.matching import Matcher
from glass_nav.topology.search.search_estimate import SearchEstimate, TurnChoice
from glass_nav.topology.search.search_forest import SearchForest
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState


class GraphVerdict:
    """Of one search at a time. C candidates: darts (C,) and the detection errors (C,) that each takes."""

    def __init__(self, matcher: Matcher, forest: SearchForest, params: SearchParams) -> None:
        self._matcher, self._atlas = matcher, matcher.atlas
        self._forest, self._params = forest, params
        self._claim: Optional[Claim] = None

    def begin(self) -> None:
        """Start over for another search."""
        self._claim = None

    def estimate(self) -> SearchEstimate:
        """To be called once after each row of the forest."""
        dart, errors = self._forest.candidates()
        if not len(dart):
            self._claim = None
            return self._without_candidates(dart, errors)
        if len(dart) == 1:
            return self._claimed(dart, errors)
        if self._params.document:
            return self._by_document(dart, errors)
        return self._among_several(dart, errors)

    def _without_candidates(self, dart: np.ndarray, errors: np.ndarray) -> SearchEstimate:
        depth, allowed = self._forest.depth, self._forest.errors
        if self._forest.between_meetpoints():
            here = self._forest.meetpoints[-1]
            choice = TurnChoice(_straight_on(here), here.degree)
            reason = "no node matches; this may not be a real meetpoint"
            return SearchEstimate(SearchState.SEARCHING, reason, depth, dart, errors, choice)
        reason = "no node of the atlas matches what was seen"
        if allowed:
            reason += f", even with {allowed} detection error{'s' * (allowed > 1)} allowed"
        return SearchEstimate(SearchState.LOST, reason, depth, dart, errors, None)

    def _by_document(self, dart: np.ndarray, errors: np.ndarray) -> SearchEstimate:
        self._claim = None
        nodes = None if self._forest.depth else len(np.unique(self._atlas.darts.node[dart]))
        count = len(dart) if nodes is None else nodes
        estimate = self._searching(f"{count} candidates", dart, errors, vote.seed(self._matcher, dart))
        return replace(estimate, node_count=nodes)

    def _among_several(self, dart: np.ndarray, errors: np.ndarray) -> SearchEstimate:
        depth, count = self._forest.depth, len(dart)
        voted = vote.best(self._matcher, dart)
        if voted.splits or depth == 0:
            self._claim = None
            reason = f"{count} candidates, {voted.survivors[voted.rank]:.3g} expected after this turn"
            return self._searching(reason, dart, errors, voted.rank)
        if self._claim is not None and self._claim.holds(self._forest.path(int(dart[0])), count):
            return self._claimed(dart, errors)  # proved already, and all moved on by one turn
        proof = ambiguity.prove(self._matcher, dart)
        if proof.indistinguishable:
            return self._claimed(dart, errors)
        self._claim = None
        if proof.ranks is None:
            reason = f"{count} candidates, no difference found between {proof.pairs} pairs of places"
            return self._searching(reason, dart, errors, self._turn_to_new_edge(dart) or 0)
        reason = f"{count} candidates, the next difference is {len(proof.ranks)} edges away"
        return self._searching(reason, dart, errors, proof.ranks[0])

    def _claimed(self, dart: np.ndarray, errors: np.ndarray) -> SearchEstimate:
        """State for one candidate, or for several that cannot be told apart: to be confirmed by more edges."""
        depth, count = self._forest.depth, len(dart)
        path, driven = self._forest.path(int(dart[0])), self._driven(dart)
        if self._claim is None or not self._claim.holds(path, count):
            self._claim = Claim(depth, dart, driven)
        needed = self._params.confirm_edges + (0 if self._params.document else int(errors[0]))
        confirmed = self._claim.confirmed(driven, depth)
        rival = (
            confirmed >= needed > 0 and self._params.max_detection_errors > 0 and self._forest.has_rival(int(dart[0]))
        )
        rank = self._turn_to_new_edge(dart) if confirmed < needed or rival else None
        if rank is not None:
            missing = f"to be confirmed by {needed - confirmed} more edges"
            if rival:
                reason = "one candidate; another one matches if a meetpoint was just missed"
            elif count == 1:
                reason = f"one candidate, {missing}"
            else:
                reason = f"{count} candidates, proved indistinguishable, {missing}"
            state = SearchState.TENTATIVE if count == 1 else SearchState.SEARCHING
            return SearchEstimate(state, reason, depth, dart, errors, self._choice(rank, dart))
        if count == 1:
            reason = f"the only place that matches, confirmed by {confirmed} edges"
            return SearchEstimate(SearchState.CONFIRMED, reason, depth, dart, errors, None)
        reason = f"{count} places match, and no turn can tell them apart"
        return SearchEstimate(SearchState.AMBIGUOUS, reason, depth, dart, errors, None)

    def _searching(self, reason: str, dart: np.ndarray, errors: np.ndarray, rank: int) -> SearchEstimate:
        depth = self._forest.depth
        return SearchEstimate(SearchState.SEARCHING, reason, depth, dart, errors, self._choice(rank, dart))

    def _choice(self, rank: int, dart: np.ndarray) -> TurnChoice:
        return TurnChoice(rank, int(self._atlas.degree[self._atlas.darts.node[dart[0]]]))

    def _driven(self, dart: np.ndarray) -> Set[int]:
        """Edges on the path of this candidate."""
        return {passed >> 1 for _, passed, _ in self._forest.path(int(dart[0]))[1:]}

    def _turn_to_new_edge(self, dart: np.ndarray) -> Optional[int]:
        """None where the component is small and was driven all over: no edge is left that could confirm anything."""
        return claim.turn_to_new_edge(self._atlas, int(dart[0]), self._driven(dart))


def _straight_on(meetpoint: Meetpoint) -> int:
    """Rank of the edge most nearly opposite to the one along which the robot arrived."""
    if not len(meetpoint.bearings_rad):
        return meetpoint.degree // 2
    return int(np.argmin(np.abs(meetpoint.gaps_rad - np.pi)))
