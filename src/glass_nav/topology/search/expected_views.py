"""Tells by simulated scans whether a scan at a meetpoint would distinguish two places.

Places that the graph cannot tell apart may look different, such as rooms with different furniture. So a scan is
simulated in the map from one place, and compared with the map at the other; what the map does not explain there is
evidence against it. Each pair of views is compared once, and only a limited number in each step of a search. P pairs
of poses.
"""

from __future__ import annotations

from typing import Dict, List, Optional, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import pose_evidence
from glass_nav.hypotheses.map_scans import MapScans
from glass_nav.topology.atlas.atlas import Atlas

_COMPARED = 500  # new pairs for each step: 0.15 s
_DIFFERENT = 2.0  # nats that tell two places apart; copies of a room that are drawn at another angle differ by less
DECISIVE = 7.0  # ... so surely that a robot drives there to see it: a risk of 0.001
_ROOM_M = 0.5  # nearer to walls a scan depends on each centimetre, and the robot stops short of a dead end
_MAX_KEPT = 100_000  # pairs
_SAME_M = 0.7  # a meetpoint nearer than this to one where the robot was is that
_ROUNDED = np.array([0.1, 0.1, 0.04])  # poses in one such cell are compared once: they slide to where a scan fits

Pose = Tuple[int, ...]


class ExpectedViews:
    """The expected views of one atlas and its map."""

    def __init__(self, atlas: Atlas, scans: MapScans) -> None:
        self._atlas, self._scans = atlas, scans
        self._known: Dict[Tuple[Pose, Pose], float] = {}
        self._odom_from_base = np.zeros(3)  # at the last arrival
        self._been: List[np.ndarray] = []  # (3,) the same, at each arrival
        self._aimed: List[np.ndarray] = []  # (3,) the same, where the robot will have been at its next arrival
        self._left = _COMPARED
        self.has_looked_again = False

    def forget(self) -> None:
        """Start over for another search."""
        self.look_again()
        self.has_looked_again = False

    def look_again(self) -> None:
        """The robot is to go once more to where it has been: a lidar that does not see all round may have missed something."""
        self._been.clear()
        self._aimed.clear()
        self.has_looked_again = True

    def arrive(self, odom_from_base: np.ndarray) -> None:
        """The robot is at a meetpoint, at odometry (3,): what is seen there is known now, and told places apart or not."""
        self._odom_from_base = odom_from_base
        self._been += [odom_from_base, *self._aimed]
        self._aimed.clear()
        self._left = _COMPARED  # pairs for the next step
        if len(self._known) > _MAX_KEPT:
            self._known.clear()

    def aim(self, base_from_there: np.ndarray) -> None:
        """The robot drives to a pose (3,) in its frame, and sees at its next arrival what it can see there: it may find
        the way blocked, or its graph drawn otherwise than the atlas, and is not to try again for ever.
        """
        self._aimed.append(se2.compose(self._odom_from_base, base_from_there))

    @property
    def is_exhausted(self) -> bool:
        """Whether pairs of this step were not compared, and so passed for alike."""
        return self._left < 0

    def nats(self, first: np.ndarray, second: np.ndarray, here: Optional[np.ndarray] = None) -> np.ndarray:
        """(P,) log likelihood ratios of poses first (P, 3) to second (P, 3), by a scan seen at the first.

        0 for pairs that hardly differ or that there was no time to compare, and where the robot has been.

        Args:
            first, second: poses.
            here: (P, 3) of the robot now, if it will be at the first poses; None: it has been nowhere.
        """
        been = np.zeros(len(first), bool) if here is None else self._has_been(first, here).any(axis=1)
        first, second = _facing_east(first, second)
        pairs = [(_rounded(a), _rounded(b)) for a, b in zip(first, second)]
        new: Dict[Pose, Dict[Pose, int]] = {}
        for index, (a, b) in enumerate(pairs):
            if a != b and not been[index] and (a, b) not in self._known and b not in new.get(a, {}):
                self._left -= 1
                if self._left >= 0:
                    new.setdefault(a, {})[b] = index
        for a, others in new.items():
            rows = list(others.values())
            found = pose_evidence.expected_nats(self._scans, first[rows[0]], second[rows])
            found = np.where(found < _DIFFERENT, 0.0, found)
            self._known.update(zip(((a, b) for b in others), found.tolist()))
        return np.where(been, 0.0, np.array([self._known.get(pair, 0.0) for pair in pairs]))

    def alike(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(P,) bool: neither of arrival darts (P,) would look different from the other; wherever the robot has been.

        Args:
            first, second: darts of two places, in either order.
        """
        a, b = self.at(first), self.at(second)
        return np.maximum(self.nats(a, b), self.nats(b, a)) < _DIFFERENT

    def differ(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(P,) bool: a scan at poses first (P, 3) would tell for certain that the robot is not at second (P, 3)."""
        return self.nats(first, second) >= DECISIVE

    def has_room(self, dart: np.ndarray) -> np.ndarray:
        """(C,) bool: at the meetpoints that arrival darts (C,) lead to, views can be relied on."""
        return self._atlas.nodes.r_m[self._atlas.darts.node[dart]] >= _ROOM_M

    def at(self, dart: np.ndarray) -> np.ndarray:
        """(C, 3) poses of a robot that came along darts (C,) to their meetpoints, looking away from them."""
        poses = np.array(self._atlas.map_from_dart(dart), float).reshape(-1, 3)
        poses[:, 2] += np.pi
        return poses

    def _has_been(self, there: np.ndarray, here: np.ndarray) -> np.ndarray:
        """(P, A) bool: at which of its A arrivals a robot that is here (P, 3) now was there (P, 3)."""
        if not self._been:
            return np.zeros((len(there), 0), bool)
        base_from_been = se2.compose(se2.inverse(self._odom_from_base), np.array(self._been))
        off = se2.transform_points(here[:, None], base_from_been[:, :2]) - there[:, None, :2]
        return np.hypot(off[..., 0], off[..., 1]) < _SAME_M


def _facing_east(first: np.ndarray, second: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Poses (P, 3) each, turned so that the first has yaw 0: a simulated scan looks all around, and where several edges meet
    the robot sees the same however it came.
    """
    facing, turned = first.copy(), second.copy()
    facing[:, 2] = 0.0
    turned[:, 2] = angles.wrap(second[:, 2] - first[:, 2])
    return facing, turned


def _rounded(pose: np.ndarray) -> Pose:
    return tuple(np.round(pose / _ROUNDED).astype(int).tolist())
