"""State and turn from the joint belief of scans and forest.

The robot is CONFIRMED at a place if the probability of all other places, and of elsewhere, is below the accepted
risk. It is LOST if only elsewhere is left, and AMBIGUOUS if nothing can tell the remaining places apart.
"""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import pose_tracker
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search import ambiguity, vote
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
_NODE_M, _EDGE_RAD = 0.7, 0.6  # from where a pose expects a meetpoint, and the directions of its edges in the mean
_WORTH = 0.25  # share of the doubt that a turn removes by itself; else a difference farther away is the better goal
_STILL_LIKELY = 0.3  # share of the likeliest place's probability
_MAX_SHOWN = 0.9995  # of a probability in words


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
            return self._estimate(SearchState.LOST, reason, depth, np.zeros(0, np.int64), None)
        return None

    def at_meetpoint(self, belief: Belief, depth: int) -> SearchEstimate:
        """The verdict after the last meetpoint of the forest."""
        final = self.final(belief, depth)
        if final is not None:
            return final
        here = self._forest.meetpoints[-1]
        left = belief.left(self._params.tolerances.risk)
        at = belief.dart[left].copy()
        unmatched = np.flatnonzero(at == NO_DART)[:_PLACED]
        at[unmatched] = darts_near(self._atlas, belief.poses[left[unmatched]], here)
        known, at = left[at != NO_DART], at[at != NO_DART]
        dart, first = np.unique(at, return_index=True)
        order = np.argsort(first)
        dart, known = dart[order], known[first[order]]
        places = f"{self._place(belief)}, {len(left)} place{'s' * (len(left) != 1)} left"
        if len(left) < 2 or not len(dart):
            state = SearchState.TENTATIVE if len(left) == 1 else SearchState.SEARCHING
            choice = TurnChoice(self._least_passed(here), here.degree)
            reason = f"{places}; next a new edge, to see more walls"
            return self._estimate(state, reason, depth, dart, choice)
        poses, share = belief.poses[known], belief.share[known]
        if self._views is not None and belief.odom_from_base is not None:
            self._views.arrive(belief.odom_from_base)
        voted = None
        if len(dart) > 1 and known[0] == left[0]:  # the likeliest place has a vote
            voted = vote.expected(self._matcher, dart, share, self._views, poses)
        is_worth = voted is not None and (self._views is None or voted.removed >= _WORTH)
        if voted is not None and voted.splits and is_worth:
            if self._views is not None:
                (there,) = self._views.at(self._matcher.departures(dart[:1], voted.rank) ^ 1)
                self._views.aim(se2.compose(se2.inverse(poses[0]), there))
            reason = f"{places}; next the turn that leaves the least doubt per metre"
            return self._estimate(SearchState.SEARCHING, reason, depth, dart, TurnChoice(voted.rank, here.degree))
        towards = None if is_worth else self._towards_difference(belief, left, known, dart, here)
        if towards is not None:
            rank, edges = towards
            reason = f"{places}; next towards the nearest difference, {edges} edge{'s' * (edges != 1)} away"
            return self._estimate(SearchState.SEARCHING, reason, depth, dart, TurnChoice(rank, here.degree))
        if len(dart) > 1 and 1.0 - belief.share[known].sum() < self._params.tolerances.risk:
            proof = ambiguity.prove(self._matcher, dart, views=self._views)
            if proof.ranks is not None and self._views is None:
                reason = f"{places}; next towards the nearest difference, {len(proof.ranks)} edges away"
                return self._estimate(
                    SearchState.SEARCHING, reason, depth, dart, TurnChoice(proof.ranks[0], here.degree)
                )
            if proof.indistinguishable and depth > 0:
                reason = f"{len(dart)} places match, and no turn can tell them apart"
                return self._estimate(SearchState.AMBIGUOUS, reason, depth, dart, None)
            if self._views is not None and not self._views.is_exhausted and self._has_passed_all(here):
                if self._views.has_looked_again:
                    reason = f"{len(dart)} places match, and two visits to where they differ did not tell them apart"
                    return self._estimate(SearchState.AMBIGUOUS, reason, depth, dart, None)
                self._views.look_again()
        reason = f"{places}; no turn is known to tell them apart; next a new edge"
        return self._estimate(
            SearchState.SEARCHING, reason, depth, dart, TurnChoice(self._least_passed(here), here.degree)
        )

    def _towards_difference(
        self, belief: Belief, left: np.ndarray, known: np.ndarray, dart: np.ndarray, here: Meetpoint
    ) -> Optional[Tuple[int, int]]:
        """The turn to where the followed place would look different from the other places left, and how many edges away
        that is; None: there is no such meetpoint where the robot has not been.

        Args:
            left: (L,) indices of the places left.
            known: (C,) those of them that have a dart.
            dart: (C,) which one.
        """
        if self._views is None:
            return None
        lead = left[self._followed(belief, belief.poses[left], belief.share[left])]
        along = dict(zip(known.tolist(), dart.tolist())).get(int(lead), NO_DART)
        begin = along if along != NO_DART else self._dart_beside(belief.poses[lead], here)
        if begin == NO_DART:
            lead = known[0]
            along = begin = int(dart[0])
        pose, others = belief.poses[lead], belief.poses[left[left != lead]]
        found = vote.towards_difference(self._matcher, self._views, begin, pose, others)
        if found is None:
            return None
        if len(found.ranks) == 1:
            self._views.aim(found.base_from_there)
        if along != NO_DART:
            return found.ranks[0], len(found.ranks)
        departure = self._matcher.ring_from(begin)[found.ranks[0]]  # the atlas has another degree here
        ahead = self._atlas.darts.bearing_rad[departure] - pose[2]
        return int(np.abs(angles.wrap(here.bearings_rad - ahead)).argmin()), len(found.ranks)

    def _dart_beside(self, pose: np.ndarray, here: Meetpoint) -> int:
        """A dart of the node where a robot with pose (3,) stands, whatever its degree; NO_DART: none is near."""
        if not len(here.bearings_rad):
            return NO_DART
        off_m = np.hypot(*(self._atlas.nodes.position_m - se2.transform_points(pose, here.centre_m)).T)
        node = int(off_m.argmin())
        ring = self._atlas.rings[node]
        return int(ring[0]) if len(ring) and off_m[node] < _NODE_M else NO_DART

    def _estimate(
        self,
        state: SearchState,
        reason: str,
        depth: int,
        dart: np.ndarray,
        choice: Optional[TurnChoice],
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


def darts_near(atlas: Atlas, poses: np.ndarray, meetpoint: Meetpoint) -> np.ndarray:
    """(K,) the dart that is the reference edge of a meetpoint where a robot with pose (K, 3) stands, by its place and the
    directions of its edges alone; NO_DART where no node of that degree is near.
    """
    bearings = meetpoint.bearings_rad if len(meetpoint.bearings_rad) else np.array([np.pi])
    dart = np.full(len(poses), NO_DART, np.int64)
    for k, pose in enumerate(poses):
        off_m = np.hypot(*(atlas.nodes.position_m - se2.transform_points(pose, meetpoint.centre_m)).T)
        node = int(off_m.argmin())
        ring = atlas.rings[node]
        if off_m[node] >= _NODE_M or len(ring) != meetpoint.degree:
            continue
        turned = ring[(np.arange(len(ring))[:, None] + np.arange(len(bearings))) % len(ring)]
        off_rad = np.abs(angles.wrap(atlas.darts.bearing_rad[turned] - pose[2] - bearings)).mean(axis=1)
        if off_rad.min() < _EDGE_RAD:
            dart[k] = ring[off_rad.argmin()]
    return dart
