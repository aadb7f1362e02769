"""The belief about the robot's place: possible poses, their probabilities, and the evidence for each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np

from glass_nav.hypotheses import pose_tracker

NO_DART = -1
_MOST_BY_GRAPH = 2.0  # nats by which meetpoints may put one place ahead of another: as many as a missing one takes
# Nats by which what the map contradicts may: enough between places that explain as much. Each by which it contradicts
# the best place itself is one less: then it is wrong about the rest, too, or beams were mirrored.
_MOST_BETWEEN = 10.0


@dataclass(frozen=True)
class RuledOut:
    """A hypothesis that went."""

    map_from_base: np.ndarray  # (3,) where the robot would stand
    dart: int  # along which it would have come; NO_DART: the atlas has no meetpoint there
    test: str  # that it failed: "degree", "r", "length", "chord", "angles", "turn", "segments" or "scan"
    expected: float  # of this pose by map or atlas
    seen: float  # by the robot
    unit: str  # of both: "m", "rad" or ""


@dataclass(frozen=True)
class Belief:
    """Poses, each place once, the likeliest first."""

    odom_from_base: Optional[np.ndarray]  # (3,) dead reckoning at which the poses hold; None: it is not known
    poses: np.ndarray  # (K, 3) map_from_base
    share: np.ndarray  # (K,) probability; with elsewhere the sum is 1
    elsewhere: float  # probability that the robot is at none of them
    scan_nats: np.ndarray  # (K,) log likelihood ratio to elsewhere by all scans
    checked_nats: np.ndarray  # (K,) ... by those that did not choose the pose
    graph_nats: np.ndarray  # (K,) ... by meetpoints and edges
    explained: np.ndarray  # (K,) share of the walls seen that the map explains; NaN: none was seen
    dart: np.ndarray  # (K,) along which the robot came to the last meetpoint; NO_DART: the atlas has none there
    driven_m: float = 0.0  # since the first scan
    searches: int = 0  # of the whole map, complete
    ruled_out: Tuple[RuledOut, ...] = ()  # by the last scan or meetpoint, the likeliest first

    def __len__(self) -> int:
        return len(self.poses)

    def left(self, risk: float) -> np.ndarray:
        """Ascending indices of the places that are not ruled out: no less likely than the first by that factor."""
        return np.flatnonzero(self.share > risk * self.share[0]) if len(self) else np.zeros(0, np.int64)


def places(
    poses: np.ndarray, scan_nats: np.ndarray, graph_nats: np.ndarray, between_nats: np.ndarray
) -> Tuple[np.ndarray, np.ndarray, float]:
    """Shares of distinct places.

    All evidence tells whether the robot is in the map at all. Between two places of it scans must have their part:
    meetpoints of two copies of a room may differ by how their graph was drawn, and a spurious one speaks for whichever
    has a node there. What the map contradicts tells copies of a room apart, but not a room in which much was moved from
    one that explains far less.

    Args:
        poses: (N, 3) hypotheses; those that are no rivals of each other are one place.
        scan_nats: (N,) log likelihood ratios to elsewhere, as likely as one place before there was evidence, by scans.
        graph_nats: (N,) ... by meetpoints and edges.
        between_nats: (N,) log likelihood ratios to each other, which say nothing of elsewhere.

    Returns:
        (K,) indices of the best pose of each place, the likeliest first; (K,) shares; share of elsewhere.
    """
    if not len(poses):
        return np.zeros(0, np.int64), np.zeros(0), 1.0
    nats = scan_nats + graph_nats
    left = np.argsort(-nats, kind="stable")
    first, log_mass = [], []
    while len(left):
        same = pose_tracker.same_place(poses[left], poses[left[0]])
        first.append(int(left[0]))
        log_mass.append(float(np.logaddexp.reduce(nats[left[same]])))
        left = left[~same]
    in_map = float(np.logaddexp.reduce(log_mass))
    total = np.logaddexp(in_map, 0.0)
    best = between_nats[first].max()
    between = np.maximum(between_nats[first], best - np.clip(_MOST_BETWEEN + best, 0.0, _MOST_BETWEEN))
    among = log_mass + between + np.maximum(graph_nats[first[0]] - graph_nats[first] - _MOST_BY_GRAPH, 0.0)
    order = np.argsort(-among, kind="stable")
    share = np.exp(among[order] - np.logaddexp.reduce(among) + in_map - total)
    return np.array(first, np.int64)[order], share, float(np.exp(-total))
