"""Localizes a robot in an atlas: meetpoint -> search forest -> vote -> turn.

Seed document: global_localization_procedure.txt. `vote_mode: seed` with `confirm_edges: 0` and `use_scans: false` is
its procedure: no edge angles, no detection errors, done at the first single candidate. This rule alone reports a
place even for many robots that are not in the atlas. By default, edges must confirm the place, ambiguity is proved
instead of driving for ever, and the result is LOST rather than a guess. With scans and odometry, scans and forest
share one belief (joint_belief.py), which finds most robots before their first edge; the forest helps where places
look alike.
"""

from __future__ import annotations

from dataclasses import replace
from typing import List, Optional, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses.map_scans import MapScans
from glass_nav.sensing.scan import Scan
from glass_nav.topology.atlas.atlas import Atlas, Visits
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search import learnt_atlas
from glass_nav.topology.search.belief import Belief
from glass_nav.topology.search.expected_views import ExpectedViews
from glass_nav.topology.search.graph_verdict import GraphVerdict
from glass_nav.topology.search.joint_belief import JointBelief
from glass_nav.topology.search.joint_verdict import JointVerdict
from glass_nav.topology.search.matching import Matcher, poses_at
from glass_nav.topology.search.passed_edges import PassedEdges
from glass_nav.topology.search.search_estimate import SearchEstimate
from glass_nav.topology.search.search_forest import SearchForest
from glass_nav.topology.search.search_params import SearchParams

_CARRIED_M, _CARRIED_SHARE, _CARRIED_RAD = 0.7, 0.1, np.radians(25.0)  # a candidate carried by dead reckoning is off
# by less; per metre of the chord, since the robot wandered


class AtlasLocalizer:
    """One search at a time: begin(), then start() and update() with what the robot reports, look() with the scans in
    between, and drive as the estimate says.
    """

    def __init__(self, atlas: Atlas, params: SearchParams, scans: Optional[MapScans] = None) -> None:
        """
        Args:
            atlas: of the building.
            params: of the search.
            scans: of the map: they are evidence where there is odometry; not with vote_mode seed, nor without use_scans.
        """
        self._atlas = atlas
        self._params = params
        self._matcher = Matcher(
            learnt_atlas.of(atlas, params.tolerances),
            params.tolerances,
            params.use_edge_angles and not params.document,
            None if params.document else params.segments,
        )
        self._forest = SearchForest(self._matcher, 0 if params.document else params.max_detection_errors)
        self._by_graph = GraphVerdict(self._matcher, self._forest, params)
        self._passed = PassedEdges()
        self._joint: Optional[JointBelief] = None
        self._views: Optional[ExpectedViews] = None
        if scans is not None and params.use_scans and not params.document:
            self._joint = JointBelief(scans, self._matcher)
            self._views = ExpectedViews(self._matcher.atlas, scans)
        self._by_both = JointVerdict(self._matcher, self._forest, self._passed, params, self._views)
        self._estimate: Optional[SearchEstimate] = None
        self._edges_before = 0  # driven before the forest began anew

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
    def belief(self) -> Optional[Belief]:
        """The belief of scans and forest; None: no scan has been evidence yet."""
        return None if self._joint is None else self._joint.belief

    def begin(self) -> None:
        """Start a new search; scans may come before the first meetpoint."""
        self._estimate, self._edges_before = None, 0
        self._by_both.begin()
        if self._joint is not None:
            self._joint.forget()
        if self._views is not None:
            self._views.forget()

    def start(self, meetpoint: Meetpoint) -> SearchEstimate:
        """The first meetpoint. Scans since begin() stay what is known."""
        self._edges_before = 0
        self._passed.begin(meetpoint)
        self._by_graph.begin()
        self._forest.begin(meetpoint)
        return self._judged(meetpoint)

    def update(self, traversal: Traversal, meetpoint: Meetpoint) -> SearchEstimate:
        """Take in an edge and the meetpoint at its end.

        Where the robot came along no edge the forest begins anew, with what dead reckoning still knows.

        Raises:
            ObservationError: the meetpoint it left has no such edge; nothing is changed.
        """
        if not traversal.was_followed:
            among = self._carried(meetpoint)
            self._begin_forest(meetpoint, among if len(among) else None)
            self._passed.jump(meetpoint)
            return self._judged(meetpoint)
        self._forest.step(traversal, meetpoint)
        self._passed.add(traversal.rank, meetpoint, traversal.length_m)
        return self._judged(meetpoint)

    def look(self, scan: Scan, odom_from_base: np.ndarray) -> Tuple[bool, Optional[SearchEstimate]]:
        """Take in a scan from anywhere, with odometry (3,) at its stamp.

        Returns:
            Whether the belief is another one now, and the estimate with which the search ends; None: it goes on.
        """
        if self._joint is None or not self._joint.see(scan, odom_from_base):
            return False, None
        belief = self._joint.belief
        depth = self._edges_before + max(self._forest.depth, 0) if self._estimate is not None else 0
        final = None if belief is None else self._by_both.final(belief, depth)
        if final is not None:
            if self._estimate is None:  # no meetpoint yet: the forest is that of a search before
                final = replace(final, dart=final.dart[:0], errors=final.errors[:0])
            self._estimate = final
        return True, final

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
        if not len(estimate.dart):  # LOST, perhaps before the first meetpoint
            return np.zeros((0, 3))
        return self.map_from_base(estimate.dart[:most])

    def node(self, estimate: SearchEstimate) -> Optional[int]:
        """Node of the first candidate; None without one, as when only scans found the place."""
        return int(self._atlas.darts.node[estimate.dart[0]]) if len(estimate.dart) else None

    @property
    def environment_from_base(self) -> Optional[np.ndarray]:
        """(3,) dead reckoning where the last estimate holds, if it was reported."""
        belief = self.belief
        return self._forest.meetpoints[-1].odom_from_base if belief is None else belief.odom_from_base

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

    def _begin_forest(self, meetpoint: Meetpoint, among: Optional[np.ndarray] = None) -> None:
        """Start a new forest within the same search."""
        self._edges_before += self._forest.depth
        self._by_graph.begin()
        self._forest.begin(meetpoint, among)

    def _carried(self, meetpoint: Meetpoint) -> np.ndarray:
        """(D,) darts at a meetpoint to which dead reckoning leads from the candidates at the last one."""
        left, candidates = self._forest.meetpoints[-1], self._forest.candidates()[0]
        dart = self._matcher.all_at(meetpoint)
        if left.odom_from_base is None or meetpoint.odom_from_base is None or not len(candidates):
            return dart
        step = se2.compose(se2.inverse(left.odom_from_base), meetpoint.odom_from_base)
        carried = se2.compose(poses_at(self._atlas, candidates, left), step)
        near_m = _CARRIED_M + _CARRIED_SHARE * float(np.hypot(*step[:2]))
        off = poses_at(self._atlas, dart, meetpoint)[:, None] - carried
        near = (np.hypot(off[..., 0], off[..., 1]) < near_m) & (np.abs(angles.wrap(off[..., 2])) < _CARRIED_RAD)
        return dart[near.any(axis=1)]

    def _judged(self, meetpoint: Meetpoint) -> SearchEstimate:
        by_graph = self._by_graph.estimate()
        estimate = replace(by_graph, depth=self._edges_before + self._forest.depth)
        if self._joint is not None:
            self._joint.arrive(meetpoint, self._forest)
            belief = self._joint.belief
            if belief is not None:
                if by_graph.done and not len(by_graph.dart):  # the graph is wrong somewhere: the forest begins anew
                    self._begin_forest(meetpoint)
                estimate = self._by_both.at_meetpoint(belief, estimate.depth)
        self._estimate = estimate
        return estimate
