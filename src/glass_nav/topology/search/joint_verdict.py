"""State and turn from the joint belief of scans and forest.

The robot is CONFIRMED at a place if the probability of all other places, and of elsewhere, is below the accepted
risk. It is LOST if only elsewhere is left, and AMBIGUOUS if nothing can tell the remaining places apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import pose_tracker
from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search import ambiguity, nearest_darts, vote
from glass_nav.topology.search.belief import NO_DART, Belief
from glass_nav.topology.search.expected_views import ExpectedViews
from glass_nav.topology.search.matching import Matcher
from glass_nav.topology.search.passed_edges import PassedEdges
from glass_nav.topology.search.search_estimate import SearchEstimate, TurnChoice
from glass_nav.topology.search.search_forest import SearchForest
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState

_MIN_CHECKED, _MIN_DRIVEN_M = 1.0, 1.0  # before a place is confirmed: nats by scans that did not choose it, which some
# 4 m of wall give, or a distance over which odometry agreed with it
_LOST_SEARCHES, _LOST_M = 3, 3.0  # of the whole map, and driven, before it is given up
_PLACED = 8  # places, the likeliest first, whose node is looked up though it does not match
_MIN_REMOVED = 0.25  # share of the doubt that a turn must remove; else a difference farther away is the better goal
_STILL_LIKELY = 0.3  # share of the likeliest place's probability
_MAX_SHOWN = 0.9995  # of a probability in words


@dataclass(frozen=True)
class _PlacesLeft:
    """What the rules look at: the places left when the robot is at a meetpoint, the likeliest first."""

    belief: Belief
    depth: int  # edges driven
    here: Meetpoint
    left: np.ndarray  # (L,) indices of the places left in the belief
    known: np.ndarray  # (C,) those of them that the atlas has, one for each dart
    dart: np.ndarray  # (C,) along which the robot came there

    @property
    def poses(self) -> np.ndarray:
        """(C, 3) of the robot at the known places."""
        return np.asarray(self.belief.poses[self.known])

    @property
    def share(self) -> np.ndarray:
        """(C,) probabilities of the known places."""
        return np.asarray(self.belief.share[self.known])


class JointVerdict:
    """The verdict of one search at a time."""

    def __init__(
        self,
        matcher: Matcher,
        forest: SearchForest,
        passed: PassedEdges,
        params: SearchParams,
        views: Optional[ExpectedViews] = None,
    ) -> None:
        self._atlas = matcher.atlas
        self._matcher, self._forest, self._passed, self._params = matcher, forest, passed, params
        self._views = views
        self._map_from_odom: Optional[np.ndarray] = None  # (3,) by the place that the last plan was for

    def begin(self) -> None:
        """Start over for another search."""
        self._map_from_odom = None

    def final(self, belief: Belief, depth: int) -> Optional[SearchEstimate]:
        """CONFIRMED or LOST, wherever the robot is; None: not yet."""
        risk = self._params.tolerances.risk
        if not len(belief):
            return None
        share = belief.share[0]
        explained = belief.explained[0]
        if (
            1.0 - share < risk
            and belief.scan_nats[0] + belief.graph_nats[0] > -np.log(risk)  # the place itself, not the map as a whole
            and (belief.checked_nats[0] >= _MIN_CHECKED or belief.driven_m >= _MIN_DRIVEN_M)
            and (np.isnan(explained) or explained >= self._params.least_explained)
        ):
            dart = self._on_path(belief.dart[:1])
            reason = f"{self._place(belief)}; it explains {explained:.0%} of the walls seen"
            return self._estimate(SearchState.CONFIRMED, reason, depth, dart, None, belief.poses[0].copy())
        if 1.0 - belief.elsewhere < risk and belief.searches >= _LOST_SEARCHES and belief.driven_m >= _LOST_M:
            reason = f"no place in the map explains what was seen: the best one {explained:.0%} of the walls"
            return self._estimate(SearchState.LOST, reason, depth, np.zeros(0, np.int64))
        return None

    def at_meetpoint(self, belief: Belief, depth: int) -> SearchEstimate:
        """The verdict after the last meetpoint of the forest: that of the first rule which applies."""
        final = self.final(belief, depth)
        if final is not None:
            return final
        at = self._places_left(belief, depth)
        if len(at.left) < 2 or not len(at.dart):
            return self._alone(at)
        if self._views is not None and belief.odom_from_base is not None:
            self._views.arrive(belief.odom_from_base)
        return (
            self._by_vote(at)
            or self._towards_difference(at)
            or self._by_proof(at)
            or self._new_edge(at, SearchState.SEARCHING, "no turn is known to tell them apart; next a new edge")
        )

    # -- the rules

    def _places_left(self, belief: Belief, depth: int) -> _PlacesLeft:
        """The places left, with the darts of those that the atlas has at the last meetpoint."""
        here = self._forest.meetpoints[-1]
        left = belief.left(self._params.tolerances.risk)
        at = belief.dart[left].copy()
        unmatched = np.flatnonzero(at == NO_DART)[:_PLACED]
        at[unmatched] = nearest_darts.like(self._atlas, belief.poses[left[unmatched]], here)
        known, at = left[at != NO_DART], at[at != NO_DART]
        dart, first = np.unique(at, return_index=True)
        order = np.argsort(first)
        return _PlacesLeft(belief, depth, here, left, known[first[order]], dart[order])

    def _alone(self, at: _PlacesLeft) -> SearchEstimate:
        """One place is left, or the atlas has none of those left: only more walls can confirm one."""
        state = SearchState.TENTATIVE if len(at.left) == 1 else SearchState.SEARCHING
        return self._new_edge(at, state, "next a new edge, to see more walls")

    def _by_vote(self, at: _PlacesLeft) -> Optional[SearchEstimate]:
        """The turn that leaves the least doubt, if it removes enough of it by itself."""
        if len(at.dart) < 2 or at.known[0] != at.left[0]:  # the likeliest place has no vote
            return None
        voted = vote.expected(self._matcher, at.dart, at.share, self._views, at.poses)
        if not voted.splits:
            return None
        if self._views is not None:
            if voted.removed < _MIN_REMOVED:
                return None
            (there,) = self._views.at(self._matcher.departures(at.dart[:1], voted.rank) ^ 1)
            self._views.aim(se2.compose(se2.inverse(at.poses[0]), there))
        return self._turn(at, voted.rank, "the turn that leaves the least doubt per metre")

    def _towards_difference(self, at: _PlacesLeft) -> Optional[SearchEstimate]:
        """The turn to where the followed place would look different from the other places left; None: there is no such
        meetpoint where the robot has not been.
        """
        if self._views is None:
            return None
        belief, left = at.belief, at.left
        lead = left[self._followed(belief, belief.poses[left], belief.share[left])]
        along = dict(zip(at.known.tolist(), at.dart.tolist())).get(int(lead), NO_DART)
        begin = along if along != NO_DART else nearest_darts.beside(self._atlas, belief.poses[lead], at.here)
        if begin == NO_DART:
            lead = at.known[0]
            along = begin = int(at.dart[0])
        pose, others = belief.poses[lead], belief.poses[left[left != lead]]
        found = vote.towards_difference(self._matcher, self._views, begin, pose, others)
        if found is None:
            return None
        edges = len(found.ranks)
        if edges == 1:
            self._views.aim(found.base_from_there)
        rank = found.ranks[0]
        if along == NO_DART:  # the atlas has another degree here
            ahead = self._atlas.darts.bearing_rad[self._matcher.ring_from(begin)[rank]] - pose[2]
            rank = int(np.abs(angles.wrap(at.here.bearings_rad - ahead)).argmin())
        return self._turn(at, rank, f"towards the nearest difference, {edges} edge{'s' * (edges != 1)} away")

    def _by_proof(self, at: _PlacesLeft) -> Optional[SearchEstimate]:
        """AMBIGUOUS if nothing can tell the places apart; without scans also the way to what can."""
        if len(at.dart) < 2 or 1.0 - at.share.sum() >= self._params.tolerances.risk:
            return None
        proof = ambiguity.prove(self._matcher, at.dart, views=self._views)
        if proof.ranks is not None and self._views is None:
            return self._turn(at, proof.ranks[0], f"towards the nearest difference, {len(proof.ranks)} edges away")
        match = f"{len(at.dart)} places match, and"
        if proof.indistinguishable and at.depth > 0:
            return self._estimate(SearchState.AMBIGUOUS, f"{match} no turn can tell them apart", at.depth, at.dart)
        if self._views is not None and not self._views.is_exhausted and self._has_passed_all(at.here):
            if self._views.has_looked_again:
                reason = f"{match} two visits to where they differ did not tell them apart"
                return self._estimate(SearchState.AMBIGUOUS, reason, at.depth, at.dart)
            self._views.look_again()
        return None

    def _turn(self, at: _PlacesLeft, rank: int, towards: str) -> SearchEstimate:
        choice = TurnChoice(rank, at.here.degree)
        return self._estimate(SearchState.SEARCHING, f"{self._in_words(at)}; next {towards}", at.depth, at.dart, choice)

    def _new_edge(self, at: _PlacesLeft, state: SearchState, why: str) -> SearchEstimate:
        choice = TurnChoice(self._least_passed(at.here), at.here.degree)
        return self._estimate(state, f"{self._in_words(at)}; {why}", at.depth, at.dart, choice)

    # -- what they need

    def _in_words(self, at: _PlacesLeft) -> str:
        return f"{self._place(at.belief)}, {len(at.left)} place{'s' * (len(at.left) != 1)} left"

    def _estimate(
        self,
        state: SearchState,
        reason: str,
        depth: int,
        dart: np.ndarray,
        choice: Optional[TurnChoice] = None,
        pose: Optional[np.ndarray] = None,
    ) -> SearchEstimate:
        return SearchEstimate(state, reason, depth, dart, np.zeros(len(dart), np.int64), choice, pose)

    def _followed(self, belief: Belief, poses: np.ndarray, share: np.ndarray) -> int:
        """Index of the place for which the robot drives to a difference: the same as before as long as it is likely, or
        else the robot would turn round whenever another one leads.
        """
        odom_from_base = belief.odom_from_base
        if odom_from_base is None:
            return 0
        lead = 0
        if self._map_from_odom is not None:
            before = pose_tracker.same_place(poses, se2.compose(self._map_from_odom, odom_from_base))
            likely = np.flatnonzero(before & (share > _STILL_LIKELY * share[0]))
            lead = int(likely[0]) if len(likely) else 0
        self._map_from_odom = se2.compose(poses[lead], se2.inverse(odom_from_base))
        return lead

    def _place(self, belief: Belief) -> str:
        share = belief.share[0]
        return (
            f"the best place has {'over 99.9' if share > _MAX_SHOWN else f'{100.0 * share:.1f}'} % of the probability"
        )

    def _on_path(self, dart: np.ndarray) -> np.ndarray:
        """The darts to which the forest has a path."""
        return dart[np.isin(dart, self._forest.candidates()[0])] if self._forest.depth >= 0 else dart[:0]

    def _has_passed_all(self, here: Meetpoint) -> bool:
        """Whether the robot has driven along every edge of a meetpoint where several meet."""
        times = self._passed.times(here)
        return times is not None and len(times) > 1 and bool(times.min() > 0)

    def _least_passed(self, here: Meetpoint) -> int:
        """Rank of the edge that was passed least often; the edge back only if it is the only one."""
        times = self._passed.times(here)
        if times is None:
            return here.degree // 2
        least = np.flatnonzero(times == times.min())
        return int(least[len(least) // 2]) if least[0] > 0 or len(least) == 1 else int(least[-1])
