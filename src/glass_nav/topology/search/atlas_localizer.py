"""MEETPOINT -> FOREST -> VOTE -> TURN: where in the atlas is a robot that woke up somewhere?

Seed document: global_localization_procedure.txt. `vote_mode: seed` with `confirm_edges: 0` is its procedure: no edge
angles, no detection errors, done at the first single candidate. Its rule alone claims a place for many robots that are
not in the atlas at all; the default asks for edges that confirm it, proves ambiguity instead of driving for ever, and
answers LOST rather than guess. Where there are scans and odometry, poses are followed beside the graph
(followed_poses.py): they find the robot where the atlas lacks the meetpoints that are there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import List, Optional, Tuple

import numpy as np

from glass_nav.geometry import angles
from glass_nav.hypotheses.followed_poses import MAX_LEAD, FollowedPoses, MapScans, Standing
from glass_nav.topology.atlas.atlas import Atlas, Visits
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search import learnt_atlas
from glass_nav.topology.search.graph_verdict import GraphVerdict
from glass_nav.topology.search.matching import Explained, Matcher, poses_at
from glass_nav.topology.search.passed_edges import PassedEdges
from glass_nav.topology.search.search_estimate import SearchEstimate, TurnChoice
from glass_nav.topology.search.search_forest import SearchForest
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState

_AGREE_M, _AGREE_RAD = 0.7, np.radians(20.0)  # a pose of the graph and a followed one are the same place


class AtlasLocalizer:
    """One search at a time: start() and update() with what the robot reports, then drive as the estimate says."""

    def __init__(
        self,
        atlas: Atlas,
        params: SearchParams,
        explained: Optional[Explained] = None,
        scans: Optional[MapScans] = None,
    ) -> None:
        """
        Args:
            atlas: of the building.
            params: of the search.
            explained: judges candidates by the scan of a meetpoint, if it has one; not with vote_mode seed.
            scans: of the map, by which poses are followed where meetpoints have scan and odometry; not with vote_mode
                seed.
        """
        self._atlas = atlas
        self._params = params
        self._matcher = Matcher(
            learnt_atlas.of(atlas, params.tolerances),
            params.tolerances,
            params.use_edge_angles and not params.document,
            None if params.document else params.segments,
            None if params.document else explained,
            params.least_explained,
        )
        self._forest = SearchForest(self._matcher, 0 if params.document else params.max_detection_errors)
        self._by_graph = GraphVerdict(self._matcher, self._forest, params)
        self._followed: Optional[FollowedPoses] = None
        if scans is not None and params.follow_places > 0 and not params.document:
            self._followed = FollowedPoses(scans)
        self._passed = PassedEdges()
        self._seen_places = 0  # by the followed poses, when the last search began
        self._estimate: Optional[SearchEstimate] = None
        self._edges_before = 0  # driven in searches that ended LOST and were restarted
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
        """How the best followed pose compares; None: no evidence yet, or no pose is followed."""
        return None if self._followed is None else self._followed.standing

    def start(self, meetpoint: Meetpoint) -> SearchEstimate:
        """Begin a search; what was known before is forgotten."""
        self._edges_before, self._search, self._seen_places = 0, 1, 0
        self._passed.begin(meetpoint)
        if self._followed is not None:
            self._followed.begin(meetpoint.odom_from_base, meetpoint.scan)
        return self._begin(meetpoint)

    def update(self, traversal: Traversal, meetpoint: Meetpoint) -> SearchEstimate:
        """Take in an edge and the meetpoint at its end.

        Raises:
            ObservationError: the meetpoint it left has no such edge; nothing is changed.
        """
        self._forest.step(traversal, meetpoint)
        self._passed.add(traversal.rank, meetpoint, traversal.length_m)
        if self._followed is not None:
            self._followed.follow(meetpoint.odom_from_base, meetpoint.scan, traversal.length_m)
        return self._judged()

    def map_from_base(self, dart: np.ndarray) -> np.ndarray:
        """(C, 3) poses of the robot at the last meetpoint if it came along darts (C,).

        As it reported to stand there, or else at the meetpoint with the edge behind it.
        """
        return poses_at(self._atlas, dart, self._forest.meetpoints[-1])

    def poses(self, estimate: SearchEstimate, most: Optional[int] = None) -> np.ndarray:
        """(C, 3) map_from_base at the last meetpoint, of the first candidates of the last estimate, or the pose that
        scans confirmed.
        """
        if estimate.map_from_base is not None:
            return estimate.map_from_base[None]
        return self.map_from_base(estimate.dart[:most])

    def node(self, estimate: SearchEstimate) -> Optional[int]:
        """Of the first candidate; None without one, as where only scans found the place."""
        return int(self._atlas.darts.node[estimate.dart[0]]) if len(estimate.dart) else None

    @property
    def environment_from_base(self) -> Optional[np.ndarray]:
        """(3,) dead reckoning at the last meetpoint, if it was reported."""
        return self._forest.meetpoints[-1].odom_from_base

    def path(self, dart: int) -> np.ndarray:
        """Darts (K,) along the path of a candidate, the reference dart of the first meetpoint first."""
        return np.array([found for _, found, _ in self._forest.path(dart)], np.int64)

    def count_visits(self, visits: Visits) -> None:
        """Add what was measured on the path of the confirmed candidate to the statistics of the atlas, and what was
        missed on it.

        Edges with detection errors are left out; nothing is counted if only scans found the place.
        """
        assert self._estimate is not None
        if not len(self._estimate.dart):
            return
        (dart,) = self._estimate.dart
        nodes: List[Tuple[int, float]] = []
        edges: List[Tuple[int, float]] = []
        before = -1
        for depth, passed, plain in self._forest.path(int(dart)):
            nodes.append((int(self._atlas.darts.node[passed]), self._forest.meetpoints[depth].r_m))
            if (
                plain and self._atlas.darts.node[passed ^ 1] == before
            ):  # not joined at a meetpoint that is usually missed
                edges.append((passed >> 1, self._forest.traversals[depth - 1].length_m))
            before = nodes[-1][0]
        visits.add_nodes(np.array([n for n, _ in nodes], np.int64), np.array([r for _, r in nodes]))
        visits.add_edges(np.array([e for e, _ in edges], np.int64), np.array([length for _, length in edges]))
        visits.add_misses(np.array(self._forest.missed_along(int(dart)), np.int64))

    # -- judgement

    def _begin(self, meetpoint: Meetpoint) -> SearchEstimate:
        self._by_graph.begin()
        self._forest.begin(meetpoint)
        return self._judged()

    def _judged(self) -> SearchEstimate:
        estimate = replace(self._by_graph.estimate(), depth=self._edges_before + self._forest.depth)
        standing = self.standing
        if standing is not None:
            estimate = self._with_followed(estimate, standing)
        if estimate.state == SearchState.LOST and self._may_restart():
            estimate = self._restarted()
        if self._edges_before and self._followed is not None and estimate.choice is not None:
            estimate = replace(estimate, choice=self._least_passed(estimate.choice))
        self._estimate = estimate
        return estimate

    def _may_restart(self) -> bool:
        """Where scans are judged, the meetpoint at which nothing matches may be the first of another search."""
        judged = self._matcher.judges_scans and self._forest.meetpoints[-1].scan is not None
        return judged and self._search < self._params.searches and self._forest.depth > 0

    def _restarted(self) -> SearchEstimate:
        self._search += 1
        self._edges_before += self._forest.depth
        begun = self._begin(self._forest.meetpoints[-1])
        if begun.done:
            return begun
        which = f"search {self._search} of {self._params.searches}, as nothing matched any more"
        return replace(begun, reason=f"{which}: {begun.reason}")

    def _least_passed(self, by_graph: TurnChoice) -> TurnChoice:
        """Where the graph was wrong once, its vote is not trusted: the edge that was passed least often instead."""
        times = self._passed.times(self._forest.meetpoints[-1])
        if times is None or times[by_graph.rank] == times.min():
            return by_graph
        least = np.flatnonzero(times == times.min())
        return TurnChoice(int(least[-1]), by_graph.degree)  # back only if there is no other

    def _with_followed(self, by_graph: SearchEstimate, standing: Standing) -> SearchEstimate:
        """The estimate by the graph, with the evidence of the followed poses."""
        least, lead = self._params.least_explained, self._params.follow_lead
        if standing.share >= least and standing.places > self._seen_places:
            self._seen_places, self._search = standing.places, 1  # there is progress: searches count from here
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
