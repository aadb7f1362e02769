"""One belief from scans and meetpoints.

Hypotheses are poses. They come from the scans (hypotheses/pose_belief.py: everywhere in the map where the scans fit)
and from the forest (darts). For each, both kinds of evidence add up: the walls seen by scans, and the meetpoints on
its path (node_evidence.py), each of which counts once however often the robot comes back to it.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.hypotheses.map_scans import MapScans
from glass_nav.hypotheses.pose_belief import PoseBelief
from glass_nav.hypotheses.pose_evidence import NEW
from glass_nav.sensing.scan import Scan
from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search import belief
from glass_nav.topology.search.belief import NO_DART, Belief, RuledOut
from glass_nav.topology.search.matching import Matcher, poses_at
from glass_nav.topology.search.node_evidence import NO_NODE, NodeEvidence, SeenAt
from glass_nav.topology.search.search_forest import SearchForest

_REMEMBERED = 20  # meetpoints that a new pose is weighed by
_SAME_M, _SAME_SHARE = 0.7, 0.02  # meetpoints nearer than that are one; more per metre driven in between
_DRIFT_SHARE = 0.04  # of odometry per metre, when a pose is traced back to a meetpoint
_MAX_DARTS = 200  # of the forest that are followed as poses; the search over scans finds those of larger rows
_KEPT_ODOMETRY = 200  # scans
_AGAIN = 0.2  # of the evidence of a meetpoint that the atlas lacks as it lacked the one before: one thing was moved
_LISTED = 100  # hypotheses that were ruled out


@dataclass(frozen=True)
class _Arrival:
    """The robot at a meetpoint, with the poses from which it is judged."""

    node: NodeEvidence
    driven_m: float  # until then
    place: int  # the same as that of another arrival: the robot came back


class JointBelief:
    """see() every scan, arrive() at every meetpoint."""

    def __init__(self, scans: MapScans, matcher: Matcher) -> None:
        self._matcher = matcher
        self._poses = PoseBelief(scans)
        self.forget()

    def forget(self) -> None:
        """Start over."""
        self._poses.forget()
        self._nodes: List[_Arrival] = []
        self._odometry: Dict[int, np.ndarray] = {}  # at the last scans, by stamp [ns]
        self._ruled_out: Tuple[RuledOut, ...] = ()
        self._belief: Optional[Belief] = None

    @property
    def belief(self) -> Optional[Belief]:
        """None: no scan has been evidence yet."""
        if not self._poses.searches:
            return None
        if self._belief is None:
            self._belief = self._made()
        return self._belief

    def see(self, scan: Scan, odom_from_base: np.ndarray) -> bool:
        """A scan with odometry (3,) at its stamp; whether the belief is another one now."""
        if self._odometry and scan.stamp_ns <= max(self._odometry):
            return False
        self._odometry[scan.stamp_ns] = np.array(odom_from_base, float)
        if len(self._odometry) > _KEPT_ODOMETRY:
            del self._odometry[min(self._odometry)]
        before = self.belief
        judged = self._poses.see(scan, odom_from_base)
        self._belief = None
        if judged:
            self._weigh_new()
            self._ruled_out = self._gone(before, "scan", 1.0)
        return judged

    def arrive(self, meetpoint: Meetpoint, forest: SearchForest) -> None:
        """A meetpoint, the last one of the forest."""
        odom_from_base = self._odometry.get(meetpoint.stamp_ns, meetpoint.odom_from_base)  # the driver's has no drift,
        # that of the scans has: they differ
        if odom_from_base is None:
            self.forget()
            return
        if meetpoint.scan is not None:
            self.see(meetpoint.scan, odom_from_base)
        before = self.belief
        self._poses.carry(odom_from_base)
        path, errors = forest.candidates()
        node = NodeEvidence.of(self._matcher, meetpoint, odom_from_base, path, errors)
        if len(path) <= _MAX_DARTS:
            self._poses.propose(poses_at(self._matcher.atlas, path, meetpoint))
        self._weigh_new()
        self._nodes = [*self._nodes, self._arrival(node)][-_REMEMBERED:]
        last, poses = len(self._nodes) - 1, self._poses.poses
        nats, dart = self._evidence_of(last, poses)
        visits = [k for k in range(last) if self._nodes[k].place == self._nodes[last].place]
        if visits:  # a place counts by the mean of its visits
            nats = (nats - np.mean([self._evidence_of(k, poses)[0] for k in visits], axis=0)) / (len(visits) + 1)
        elif last:
            missed = (dart == NO_DART) & (self._poses.evidence.label == NO_DART)
            nats = np.where(missed, _AGAIN * nats, nats)
        self._poses.weigh(nats, dart)
        self._belief = None
        self._ruled_out = self._gone(before, "degree", float(meetpoint.degree))

    def _arrival(self, node: NodeEvidence) -> _Arrival:
        """Of a meetpoint where the robot is: at a place where it was before, or at another one."""
        driven_m = self._poses.driven_m
        for known in self._nodes:
            near_m = _SAME_M + _SAME_SHARE * (driven_m - known.driven_m)
            if np.hypot(*(known.node.centre_m - node.centre_m)) < near_m:
                return _Arrival(node, driven_m, known.place)
        return _Arrival(node, driven_m, 1 + max((known.place for known in self._nodes), default=-1))

    def _evidence_of(self, k: int, poses: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """(K,) nats of the k-th meetpoint for poses (K, 3) at the last scan, and (K,) the darts there."""
        seen = self._seen_at(self._nodes[k], poses)
        path_nats = seen.path_nats
        if k > 0:  # only an error that is new is evidence
            before = self._seen_at(self._nodes[k - 1], poses)
            path_nats = np.where(before.dart == NO_DART, path_nats, np.minimum(path_nats - before.path_nats, 0.0))
        return np.maximum(seen.nats + path_nats, NO_NODE), seen.dart

    def _seen_at(self, arrival: _Arrival, poses: np.ndarray) -> SeenAt:
        """From poses (K, 3) at the last scan, traced back."""
        here = self._poses.odom_from_base
        assert here is not None
        back = se2.compose(poses, se2.compose(se2.inverse(here), arrival.node.odom_from_base))
        return arrival.node.at(back, _DRIFT_SHARE * (self._poses.driven_m - arrival.driven_m))

    def _weigh_new(self) -> None:
        """Poses that were not followed at earlier meetpoints are traced back to them."""
        label = self._poses.evidence.label
        new = np.flatnonzero(label == NEW)
        if not len(new):
            return
        nats, label = np.zeros(len(label)), label.copy()
        label[new] = NO_DART
        visits = Counter(arrival.place for arrival in self._nodes)
        for k, arrival in enumerate(self._nodes):
            of_node, label[new] = self._evidence_of(k, self._poses.poses[new])
            nats[new] += of_node / visits[arrival.place]
        self._poses.weigh(nats, label)

    def _made(self) -> Belief:
        evidence, poses = self._poses.evidence, self._poses.poses
        first, share, elsewhere = belief.places(poses, evidence.nats, evidence.other_nats, evidence.between_nats)
        return Belief(
            self._poses.odom_from_base,
            poses[first],
            share,
            elsewhere,
            evidence.nats[first],
            evidence.checked_nats[first],
            evidence.other_nats[first],
            evidence.share[first],
            evidence.label[first],
            self._poses.driven_m,
            self._poses.searches,
            self._ruled_out,
        )

    def _gone(self, before: Optional[Belief], test: str, expected: float) -> Tuple[RuledOut, ...]:
        """Hypotheses of an earlier belief that are no longer followed."""
        here, after = self._poses.odom_from_base, self._poses.poses
        if before is None or here is None or before.odom_from_base is None:
            return ()
        now = se2.compose(before.poses, se2.compose(se2.inverse(before.odom_from_base), here))
        gone: List[RuledOut] = []
        for k, pose in enumerate(now):
            if len(gone) < _LISTED and not (np.hypot(*(after[:, :2] - pose[:2]).T) < 1.0).any():
                gone.append(RuledOut(pose, int(before.dart[k]), test, expected, float(before.explained[k]), ""))
        return tuple(gone)
