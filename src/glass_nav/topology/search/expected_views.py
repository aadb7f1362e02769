"""Darts, the map -> would the scan at a meetpoint tell a robot there from one at another?

Places that the graph cannot tell apart may look different: a room of one wing is furnished otherwise. So a scan is
simulated in the map from where the robot would stand, and looked at from the other place: what the map does not explain
there is evidence against it. Views are compared once, and only so many for each step of a search. P pairs of darts.
"""

from __future__ import annotations

from typing import Dict, Set, Tuple

import numpy as np

from glass_nav.hypotheses import pose_belief
from glass_nav.hypotheses.pose_belief import MapScans
from glass_nav.topology.atlas.atlas import Atlas

_COMPARED = 300  # new pairs for each step: 0.1 s
_DIFFERENT = 3.0  # nats that tell two places apart
_MAX_KEPT = 100_000  # pairs


class ExpectedViews:
    """Of one atlas and its map."""

    def __init__(self, atlas: Atlas, scans: MapScans) -> None:
        self._atlas, self._scans = atlas, scans
        self._known: Dict[Tuple[int, int], float] = {}
        self._seen: Set[Tuple[int, int]] = set()  # pairs of nodes
        self._left = _COMPARED

    def forget(self) -> None:
        """Another search: nothing was seen."""
        self._seen.clear()

    def arrive(self, dart: np.ndarray) -> None:
        """The robot has come along one of darts (C,): what is seen there is known now, and told them apart or not."""
        node = self._atlas.darts.node[dart].tolist()
        self._seen.update((a, b) for a in node for b in node)
        self._left = _COMPARED  # pairs for the next step
        if len(self._known) > _MAX_KEPT:
            self._known.clear()

    @property
    def is_exhausted(self) -> bool:
        """Whether pairs of this step were not compared, and so passed for alike."""
        return self._left < 0

    def nats(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(P,) log likelihood ratios of arrival darts first (P,) to second (P,), by a scan seen at the first.

        0 for pairs that there was no time to compare, and where the robot has been.
        """
        node = self._atlas.darts.node
        pairs = list(zip(first.tolist(), second.tolist()))
        new: Dict[int, "list[int]"] = {}
        for a, b in pairs:
            seen = (int(node[a]), int(node[b])) in self._seen
            if a != b and not seen and (a, b) not in self._known and b not in new.get(a, []):
                self._left -= 1
                if self._left >= 0:
                    new.setdefault(a, []).append(b)
        for a, others in new.items():
            found = pose_belief.expected_nats(self._scans, self._pose(a), np.stack([self._pose(b) for b in others]))
            self._known.update(zip(((a, b) for b in others), found.tolist()))
        nats = np.array([self._known.get(pair, 0.0) for pair in pairs])
        seen_nodes = np.array([(a, b) in self._seen for a, b in zip(node[first].tolist(), node[second].tolist())], bool)
        return np.where(seen_nodes, 0.0, nats)

    def alike(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(P,) bool: neither would look different from the other."""
        return np.maximum(self.nats(first, second), self.nats(second, first)) < _DIFFERENT

    def _pose(self, dart: int) -> np.ndarray:
        """(3,) of a robot that came along the dart to its meetpoint, looking away from it."""
        pose = np.array(self._atlas.map_from_dart(np.array(dart)), float)
        pose[2] += np.pi
        return pose
