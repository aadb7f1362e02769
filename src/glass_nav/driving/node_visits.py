"""The nodes of the atlas that a localized robot passed, with what it measured there.

A searching robot learns from the meetpoints where it stops; a robot that drives to a goal passes many more. They are
detected by edge_tracking/passing.py. A node counts as missed only if none of the graphs made near it had it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict, List, Optional

import numpy as np

from glass_nav.driving.edge_tracking.passing import PassedNode, PassingObserver, PassingParams
from glass_nav.geometry import se2
from glass_nav.sensing.scan import Scan
from glass_nav.topology.atlas.atlas import RING_MARKER, Atlas

_MATCH_M = 0.5  # what was seen belongs to a node of the atlas so near
_WITHIN_R = 0.9  # times r around a node nothing stands: the robot sees it
_AFTER_M = 0.5  # so much farther away than it is watched the robot has left a node
_KEPT_SCANS = 600  # poses of the last scans


@dataclass(frozen=True)
class NodeVisit:
    """A node that the robot passed."""

    node: int  # of the atlas
    r_m: float  # as it was seen; NaN: it was missed


class VisitWatch:
    """see() every scan of a drive, then take() what was passed."""

    def __init__(self, atlas: Atlas) -> None:
        self._atlas, self._p = atlas, PassingParams()
        self._reset()

    def _reset(self) -> None:
        self._observer: Optional[PassingObserver] = None  # made with the first scan: its map is large
        self._taken = 0  # nodes of the observer
        self._poses: Dict[int, np.ndarray] = {}  # (3,) map_from_base by stamp
        self._near: Dict[
            int, List[PassedNode]
        ] = {}  # what was seen at the nodes that the robot passed and has not left
        self._visits: List[NodeVisit] = []

    def see(self, scan: Scan, odom_from_base: np.ndarray, map_from_base: np.ndarray) -> None:
        """A scan, with the pose (3,) in odom and in the map at its stamp."""
        self._poses[scan.stamp_ns] = np.array(map_from_base, float)
        if len(self._poses) > _KEPT_SCANS:
            del self._poses[min(self._poses)]
        if self._observer is None:
            self._observer = PassingObserver(self._p)
        self._observer.see(scan, odom_from_base)
        self._follow(self._observer, np.asarray(map_from_base, float)[:2])

    def take(self) -> List[NodeVisit]:
        """The drive is over: the nodes that the robot left, in that order, each time."""
        visits = self._visits
        if self._observer is not None:
            self._reset()
        return visits

    def _follow(self, observer: PassingObserver, here_m: np.ndarray) -> None:
        nodes, p = self._atlas.nodes, self._p
        away_m = np.hypot(*(nodes.position_m - here_m).T)
        near_m = p.near(nodes.r_m)
        passed = (away_m < np.minimum(near_m, _WITHIN_R * nodes.r_m)) & (nodes.kind != RING_MARKER)
        for node in np.flatnonzero(passed).tolist():
            self._near.setdefault(node, [])
        self._note_seen(observer)
        left = [node for node in self._near if away_m[node] > near_m[node] + p.linger_m + _AFTER_M]
        for node in left:
            self._visits += self._visit(observer, node, self._near.pop(node))

    def _note_seen(self, observer: PassingObserver) -> None:
        """Assign the observer's meetpoints since the last scan to nodes of the atlas."""
        new = observer.passed[self._taken :]
        self._taken += len(new)
        for each in new:
            pose = self._poses.get(each.stamp_ns)
            if pose is None or not self._near:
                continue
            nodes = list(self._near)
            at = se2.transform_points(pose, each.in_base_m)
            off_m = np.hypot(*(self._atlas.nodes.position_m[nodes] - at).T)
            if off_m.min() < _MATCH_M:
                self._near[nodes[int(off_m.argmin())]].append(each)

    def _visit(self, observer: PassingObserver, node: int, seen: List[PassedNode]) -> List[NodeVisit]:
        """The visit: r is NaN if nothing was seen there; empty if what was seen is not certainly the node."""
        if not seen:
            return [NodeVisit(node, math.nan)]
        degree = int(self._atlas.degree[node])
        sure = [each for each in seen if observer.counts(each) and each.degree == degree]
        return [NodeVisit(node, sure[-1].r_m)] if sure else []
