"""MEETPOINT -> FOREST -> VOTE -> TURN: where in the atlas is a robot that woke up somewhere?

Seed document: global_localization_procedure.txt. `vote_mode: seed` with `confirm_edges: 0` is its procedure: no edge
angles, no errors of the detector, done at the first single candidate. Its rule alone claims a place for many robots
that are not in the atlas at all; the default asks for edges that confirm it, proves ambiguity instead of driving for
ever, and answers LOST rather than guess. Where there are scans and odometry, poses are followed beside the graph
(followed_poses.py): they find the robot where the atlas has not the meetpoints that are there.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import List, Optional, Set, Tuple

import numpy as np

from glass_nav.geometry import angles
from glass_nav.topology.atlas.atlas import Atlas, Visits
from glass_nav.topology.observations import Meetpoint, Traversal, turn_name
from glass_nav.topology.search import ambiguity, vote
from glass_nav.topology.search.edge_segments import SegmentTest
from glass_nav.topology.search.followed_poses import MAX_LEAD, FollowedPoses, MapScans, Standing
from glass_nav.topology.search.matching import Explained, Matcher, Tolerances, poses_at
from glass_nav.topology.search.passed_edges import PassedEdges
from glass_nav.topology.search.search_forest import SearchForest
from glass_nav.vocabulary import SEARCH_IS_OVER, SearchState

VOTE_MODES = ("best", "seed")

_TREE_EDGES = 2000  # searched for an edge that was not driven yet
_AGREE_M, _AGREE_RAD = 0.7, np.radians(20.0)  # a pose of the graph and a followed one are the same place


@dataclass(frozen=True)
class SearchParams:
    """How the search is done."""

    vote_mode: str = "best"  # best: what tells most; seed: the document's procedure
    confirm_edges: int = 2  # edges that must match after one candidate is left
    max_detection_errors: int = 2  # meetpoints missed or seen where there are none; not with vote_mode seed
    use_edge_angles: bool = True  # as evidence; not with vote_mode seed
    tolerances: Tolerances = field(default_factory=Tolerances)
    segments: SegmentTest = field(default_factory=SegmentTest)
    least_explained: float = 0.6  # share of a scan that the map must explain from a candidate; where scans are judged
    searches: int = 6  # begun anew where nothing fits any more, before LOST; where scans are judged
    follow_places: int = 4  # where scans were made, that a followed pose must explain; 0: none is followed
    follow_lead: float = 0.15  # share of the scans by which all other poses must be behind, in the mean

    def __post_init__(self) -> None:
        if self.vote_mode not in VOTE_MODES:
            raise ValueError(f"~vote_mode must be {' or '.join(VOTE_MODES)}, got {self.vote_mode!r}")
        if self.confirm_edges < 0:
            raise ValueError(f"~confirm_edges must be >= 0, got {self.confirm_edges}")
        if not 0 <= self.max_detection_errors <= 2:
            raise ValueError(f"~max_detection_errors must be 0, 1 or 2, got {self.max_detection_errors}")
        if not 0.0 <= self.least_explained < 1.0:
            raise ValueError(f"~least_explained must be in [0, 1), got {self.least_explained}")
        if self.searches < 1:
            raise ValueError(f"~searches must be >= 1, got {self.searches}")
        if self.follow_places < 0:
            raise ValueError(f"~follow_places must be >= 0, got {self.follow_places}")
        if not 0.0 < self.follow_lead <= MAX_LEAD:
            raise ValueError(f"~follow_lead must be in (0, {MAX_LEAD:g}], got {self.follow_lead}")

    @property
    def document(self) -> bool:
        """Whether the document's procedure is asked for."""
        return self.vote_mode == "seed"


@dataclass(frozen=True)
class TurnChoice:
    """By which edge to leave the meetpoint."""

    rank: int
    degree: int

    @property
    def name(self) -> str:
        return turn_name(self.rank, self.degree)


@dataclass(frozen=True)
class SearchEstimate:
    """What is known after a meetpoint."""

    state: SearchState
    reason: str  # why, in one sentence
    depth: int  # edges driven so far
    dart: np.ndarray  # (C,) candidates: where the edge that the robot came along leads back
    errors: np.ndarray  # (C,) errors of the detector that each takes
    choice: Optional[TurnChoice]  # None: nothing more to find out
    map_from_base: Optional[np.ndarray] = None  # (3,) CONFIRMED by the scans: the pose; dart is empty where the graph
    # does not have it

    @property
    def done(self) -> bool:
        """Whether the search is over."""
        return self.state in SEARCH_IS_OVER


class AtlasLocalizer:
    """One search at a time; start() and update() with what the robot reports, drive as the estimate says."""

    def __init__(
        self,
        atlas: Atlas,
        params: SearchParams,
        explained: Optional[Explained] = None,
        scans: Optional[MapScans] = None,
    ) -> None:
        """Args:
        atlas: of the building.
        params: of the search.
        explained: judges candidates by the scan of a meetpoint, if it has one; not with vote_mode seed.
        scans: of the map, by which poses are followed where meetpoints have scan and odometry; not with vote_mode
            seed.
        """
        self._atlas = atlas
        self._params = params
        self._matcher = Matcher(
            atlas,
            params.tolerances,
            params.use_edge_angles and not params.document,
            None if params.document else params.segments,
            None if params.document else explained,
            params.least_explained,
        )
        self._forest = SearchForest(self._matcher, 0 if params.document else params.max_detection_errors)
        self._followed: Optional[FollowedPoses] = None
        if scans is not None and params.follow_places > 0 and not params.document:
            self._followed = FollowedPoses(scans)
        self._passed = PassedEdges()
        self._seen_places = 0  # by the followed poses, when the last search began
        self._claim: Optional[_Claim] = None
        self._estimate: Optional[SearchEstimate] = None
        self._edges_before = 0  # driven in searches in which nothing fitted at last
        self._search = 1

    @property
    def atlas(self) -> Atlas:
        return self._atlas

    @property
    def params(self) -> SearchParams:
        return self._params

    @property
    def forest(self) -> SearchForest:
        return self._forest

    @property
    def matcher(self) -> Matcher:
        return self._matcher

    @property
    def estimate(self) -> Optional[SearchEstimate]:
        """The last one; None before the first meetpoint."""
        return self._estimate

    @property
    def standing(self) -> Optional[Standing]:
        """What the scans say of the poses that are followed; None: nothing yet, or none is followed."""
        return None if self._followed is None else self._followed.standing

    def start(self, meetpoint: Meetpoint) -> SearchEstimate:
        """Begin a search; what was known before is forgotten."""
        self._edges_before, self._search, self._seen_places = 0, 1, 0
        self._passed.begin(meetpoint)
        if self._followed is not None:
            self._followed.begin(meetpoint)
        return self._begin(meetpoint)

    def update(self, traversal: Traversal, meetpoint: Meetpoint) -> SearchEstimate:
        """Take in an edge and the meetpoint at its end.

        Raises:
            ObservationError: the meetpoint it left has no such edge; nothing is changed.
        """
        self._forest.step(traversal, meetpoint)
        self._passed.way(traversal.rank, meetpoint, traversal.length_m)
        if self._followed is not None:
            self._followed.follow(meetpoint, traversal.length_m)
        return self._judged()

    def map_from_base(self, dart: np.ndarray) -> np.ndarray:
        """(C, 3) poses of the robot at the last meetpoint if it came along darts (C,): as it reported where it stood
        there, or else at the meetpoint with the edge behind it.
        """
        return poses_at(self._atlas, dart, self._forest.meetpoints[-1])

    def poses(self, estimate: SearchEstimate, most: Optional[int] = None) -> np.ndarray:
        """(C, 3) map_from_base at the last meetpoint, of the first so many candidates of the last estimate; if scans
        confirmed one, where it fits them.
        """
        if estimate.map_from_base is not None:
            return estimate.map_from_base[None]
        return self.map_from_base(estimate.dart[:most])

    def path(self, dart: int) -> np.ndarray:
        """Darts (K,) by which a candidate came there, reference dart of the beginning first."""
        return np.array([found for _, found, _ in self._forest.path(dart)], np.int64)

    def count_visits(self, visits: Visits) -> None:
        """What was measured on the way of the confirmed candidate, into the statistics of the atlas.

        Edges and meetpoints that the detector erred about are left out; nothing is counted where only scans found it.
        """
        assert self._estimate is not None
        if not len(self._estimate.dart):
            return
        (dart,) = self._estimate.dart
        nodes: List[Tuple[int, float]] = []
        edges: List[Tuple[int, float]] = []
        for depth, passed, plain in self._forest.path(int(dart)):
            nodes.append((int(self._atlas.darts.node[passed]), self._forest.meetpoints[depth].r_m))
            if plain:
                edges.append((passed >> 1, self._forest.traversals[depth - 1].length_m))
        visits.add_nodes(np.array([n for n, _ in nodes], np.int64), np.array([r for _, r in nodes]))
        visits.add_edges(np.array([e for e, _ in edges], np.int64), np.array([length for _, length in edges]))

    # -- judgement

    def _begin(self, meetpoint: Meetpoint) -> SearchEstimate:
        self._claim = None
        self._forest.begin(meetpoint)
        return self._judged()

    def _judged(self) -> SearchEstimate:
        dart, errors = self._forest.candidates()
        if not len(dart):
            self._claim = None
            self._estimate = self._without_candidates(dart, errors)
        elif len(dart) == 1:
            self._estimate = self._claimed(dart, errors)
        else:
            self._estimate = self._among_several(dart, errors)
        self._estimate = replace(self._estimate, depth=self._edges_before + self._forest.depth)
        standing = self.standing
        if standing is not None:
            self._estimate = self._with_followed(self._estimate, standing)
        judged = self._matcher.judges_scans and self._forest.meetpoints[-1].scan is not None
        if (
            self._estimate.state == SearchState.LOST
            and judged
            and self._search < self._params.searches
            and self._forest.depth > 0
        ):
            self._search += 1
            self._edges_before += self._forest.depth
            begun = self._begin(self._forest.meetpoints[-1])
            if not begun.done:
                begun = replace(
                    begun,
                    reason=f"search {self._search} of {self._params.searches}, nothing fitted any more: {begun.reason}",
                )
            self._estimate = begun
        if self._edges_before and self._followed is not None and self._estimate.choice is not None:
            self._estimate = replace(self._estimate, choice=self._least_passed(self._estimate.choice))
        return self._estimate

    def _least_passed(self, by_graph: TurnChoice) -> TurnChoice:
        """Where the graph was wrong once, its candidates do not know which turn tells most: to what is new."""
        times = self._passed.times(self._forest.meetpoints[-1])
        if times is None or times[by_graph.rank] == times.min():
            return by_graph
        least = np.flatnonzero(times == times.min())
        return TurnChoice(int(least[-1]), by_graph.degree)  # back only if there is no other

    def _with_followed(self, by_graph: SearchEstimate, standing: Standing) -> SearchEstimate:
        """What the graph and the followed poses say together."""
        least, lead = self._params.least_explained, self._params.follow_lead
        if standing.share >= least and standing.places > self._seen_places:
            self._seen_places, self._search = standing.places, 1  # it gets on: searches count from here
        found = (
            standing.places >= self._params.follow_places
            and standing.share >= least
            and standing.lead >= lead
            and standing.share_now >= least
            and standing.lead_now >= -lead
        )
        if not found:
            return by_graph
        off = self.map_from_base(by_graph.dart) - standing.map_from_base
        agree = np.flatnonzero(
            (np.hypot(off[:, 0], off[:, 1]) < _AGREE_M) & (np.abs(angles.wrap(off[:, 2])) < _AGREE_RAD)
        )
        if by_graph.state in (SearchState.CONFIRMED, SearchState.AMBIGUOUS):
            if len(agree):
                return by_graph
            return replace(
                by_graph, state=SearchState.LOST, reason="graph and scans contradict each other", choice=None
            )
        next_best = standing.share - min(standing.lead, MAX_LEAD)
        reason = (
            f"one pose explains {standing.share:.0%} of the scans of {standing.places} places, the next best "
            f"{next_best:.0%}{' or less' * (standing.lead > MAX_LEAD)}"
        )
        return replace(
            by_graph,
            state=SearchState.CONFIRMED,
            reason=reason,
            choice=None,
            dart=by_graph.dart[agree[:1]],
            errors=by_graph.errors[agree[:1]],
            map_from_base=standing.map_from_base,
        )

    def _without_candidates(self, dart: np.ndarray, errors: np.ndarray) -> SearchEstimate:
        if self._forest.between_meetpoints():
            here = self._forest.meetpoints[-1]
            return SearchEstimate(
                SearchState.SEARCHING,
                "no place fits, unless this meetpoint is none",
                self._forest.depth,
                dart,
                errors,
                TurnChoice(_straight_on(here), here.degree),
            )
        allowed = self._forest.errors
        but = f", not even with {allowed} error{'s' * (allowed > 1)} of the detector" if allowed else ""
        return SearchEstimate(
            SearchState.LOST, f"no place of the atlas fits what was seen{but}", self._forest.depth, dart, errors, None
        )

    def _among_several(self, dart: np.ndarray, errors: np.ndarray) -> SearchEstimate:
        depth, count = self._forest.depth, len(dart)
        if self._params.document:
            self._claim = None
            nodes = len(np.unique(self._atlas.darts.node[dart]))
            return SearchEstimate(
                SearchState.SEARCHING,
                f"{nodes if depth == 0 else count} candidates",
                depth,
                dart,
                errors,
                self._choice(vote.seed(self._matcher, dart), dart),
            )
        voted = vote.best(self._matcher, dart)
        if voted.splits or depth == 0:
            self._claim = None
            reason = f"{count} candidates, {voted.survivors[voted.rank]:.3g} expected after this turn"
            return SearchEstimate(SearchState.SEARCHING, reason, depth, dart, errors, self._choice(voted.rank, dart))
        if self._claim is not None and self._claim.holds(self._forest.path(int(dart[0])), count):
            return self._claimed(dart, errors)  # proved already, and all moved on by one turn
        proof = ambiguity.prove(self._matcher, dart)
        if proof.indistinguishable:
            return self._claimed(dart, errors)
        self._claim = None
        if proof.ranks is None:
            rank = self._towards_new_edges(int(dart[0]))
            return SearchEstimate(
                SearchState.SEARCHING,
                f"{count} candidates, alike for {proof.pairs} pairs of places",
                depth,
                dart,
                errors,
                self._choice(rank, dart),
            )
        reason = f"{count} candidates, the next difference is {len(proof.ranks)} edges away"
        return SearchEstimate(SearchState.SEARCHING, reason, depth, dart, errors, self._choice(proof.ranks[0], dart))

    def _claimed(self, dart: np.ndarray, errors: np.ndarray) -> SearchEstimate:
        """One candidate, or several that nothing tells apart: more edges must confirm it."""
        depth, count = self._forest.depth, len(dart)
        path = self._forest.path(int(dart[0]))
        driven = {passed >> 1 for _, passed, _ in path[1:]}
        if self._claim is None or not self._claim.holds(path, count):
            self._claim = _Claim(depth, dart, driven)
        needed = self._params.confirm_edges + (0 if self._params.document else int(errors[0]))
        confirmed = self._claim.confirmed(driven, depth)
        rival = (
            confirmed >= needed > 0 and self._params.max_detection_errors > 0 and self._forest.has_rival(int(dart[0]))
        )
        if (confirmed < needed or rival) and not self._all_driven(int(dart[0]), driven):
            rank = self._towards_new_edges(int(dart[0]))
            if rival:
                reason = "one candidate, but if a meetpoint was missed just now it is the next"
                return SearchEstimate(
                    SearchState.TENTATIVE if count == 1 else SearchState.SEARCHING,
                    reason,
                    depth,
                    dart,
                    errors,
                    self._choice(rank, dart),
                )
            if count == 1:
                reason = f"one candidate, {needed - confirmed} edges must confirm it"
                return SearchEstimate(SearchState.TENTATIVE, reason, depth, dart, errors, self._choice(rank, dart))
            reason = f"{count} candidates, proved alike; {needed - confirmed} edges must confirm them"
            return SearchEstimate(SearchState.SEARCHING, reason, depth, dart, errors, self._choice(rank, dart))
        if count == 1:
            reason = f"the only place that fits, confirmed by {confirmed} edges"
            return SearchEstimate(SearchState.CONFIRMED, reason, depth, dart, errors, None)
        return SearchEstimate(
            SearchState.AMBIGUOUS, f"{count} places fit that no turn can tell apart", depth, dart, errors, None
        )

    def _choice(self, rank: int, dart: np.ndarray) -> TurnChoice:
        return TurnChoice(rank, int(self._atlas.degree[self._atlas.darts.node[dart[0]]]))

    def _all_driven(self, dart: int, driven: Set[int]) -> bool:
        """No edge is left that could confirm anything: the component is small, and was driven all over."""
        return self._first_turn_to_new_edge(dart, driven) is None

    def _towards_new_edges(self, dart: int) -> int:
        """Rank of the turn that leads soonest to an edge that was not driven."""
        driven = {int(passed) >> 1 for passed in self.path(dart)[1:]}
        found = self._first_turn_to_new_edge(dart, driven)
        return 0 if found is None else found

    def _first_turn_to_new_edge(self, dart: int, driven: Set[int]) -> Optional[int]:
        """Breadth first over the few edges around; None if there is no new one. Back only if nothing else is near."""
        seen, queue = {dart}, [(dart, -1)]
        for at, first in queue:  # grows
            ring = self._atlas.rings[int(self._atlas.darts.node[at])]
            degree = len(ring)
            for rank in [*range(1, degree), 0]:
                departure = int(ring[(int(self._atlas.rank[at]) + rank) % degree])
                begun = rank if first < 0 else first
                if departure >> 1 not in driven:
                    return begun
                arrival = departure ^ 1
                if arrival not in seen and len(seen) < _TREE_EDGES:
                    seen.add(arrival)
                    queue.append((arrival, begun))
        return None


@dataclass(frozen=True)
class _Claim:
    """When the candidates were first down to a place, or to places that nothing tells apart."""

    depth: int
    dart: np.ndarray  # (C,)
    driven: Set[int]  # edges by then

    def holds(self, path: List[Tuple[int, int, bool]], count: int) -> bool:
        """Whether as many candidates, one of which came by this path, come from what was claimed."""
        return count == len(self.dart) and any(depth == self.depth and dart in self.dart for depth, dart, _ in path)

    def confirmed(self, driven: Set[int], depth: int) -> int:
        """Edges that have matched since then and were new; at most one for each step."""
        return min(len(driven - self.driven), depth - self.depth)


def _straight_on(meetpoint: Meetpoint) -> int:
    """Rank of the edge most nearly opposite to the one the robot came along."""
    if not len(meetpoint.bearings_rad):
        return meetpoint.degree // 2
    return int(np.argmin(np.abs(meetpoint.gaps_rad - np.pi)))
