"""The log likelihood ratio of a meetpoint at each of many poses, relative to a robot elsewhere.

Where the atlas has a meetpoint, it is expected as the atlas describes it: degree, equidistance, angles between the
edges, each with the tolerances of the matcher. Elsewhere a meetpoint is like any of the atlas, so properties that
many have in common are no evidence. The edge along which the robot came counts through the pose, which odometry moved
along it, and through the forest, whose tests it passed (length, chord, directions, walls). The latter belongs to the path
and not to the meetpoint: the path to the next meetpoint has the same errors. D darts, K poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search.belief import NO_DART
from glass_nav.topology.search.matching import Matcher, poses_at

_NEAR_M, _NEAR_RAD = 0.7, np.radians(20.0)  # of a pose: the dart belongs to it
NO_NODE = -1.9  # log of the probability that the robot finds a meetpoint where the atlas has none
_MAX_NATS = 4.0  # of one meetpoint
_NO_PATH = -1.5  # the forest has no path to the dart, or for each detection error on it


@dataclass(frozen=True)
class SeenAt:
    """A meetpoint, seen from K poses."""

    nats: np.ndarray  # (K,) log likelihood ratio to a robot elsewhere, without the path
    path_nats: np.ndarray  # (K,) ... by the path of the forest; 0 where the atlas has no such meetpoint
    dart: np.ndarray  # (K,) along which the robot came; NO_DART: the atlas has no such meetpoint there


@dataclass(frozen=True)
class NodeEvidence:
    """The evidence of one meetpoint."""

    odom_from_base: np.ndarray  # (3,) there
    centre_m: np.ndarray  # (2,) of the meetpoint in the frame of odometry
    dart: np.ndarray  # (D,) that match, by x of their poses
    poses: np.ndarray  # (D, 3) of the robot, if it came along them
    nats: np.ndarray  # (D,)
    path_nats: np.ndarray  # (D,)

    @classmethod
    def of(
        cls, matcher: Matcher, meetpoint: Meetpoint, odom_from_base: np.ndarray, path: np.ndarray, errors: np.ndarray
    ) -> NodeEvidence:
        """The evidence of a meetpoint where the robot stood at that odometry (3,).

        Args:
            matcher: of the atlas.
            meetpoint: that the robot reports.
            odom_from_base: there.
            path: (C,) darts to which the forest has a path.
            errors: (C,) detection errors on it.
        """
        dart = matcher.all_at(meetpoint)
        log_p = matcher.log_likelihood_at(dart, meetpoint)
        mean = np.logaddexp.reduce(log_p) - np.log(len(matcher.atlas.darts)) if len(dart) else 0.0
        off_path = np.full(len(matcher.atlas.darts), 2)
        off_path[path[::-1]] = np.minimum(errors[::-1], 2)
        nats, path_nats = np.minimum(log_p - mean, _MAX_NATS), _NO_PATH * off_path[dart]
        poses = poses_at(matcher.atlas, dart, meetpoint)
        order = np.argsort(poses[:, 0], kind="stable")
        centre_m = se2.transform_points(odom_from_base, meetpoint.centre_m)
        return cls(odom_from_base, centre_m, dart[order], poses[order], nats[order], path_nats[order])

    def at(self, poses: np.ndarray, more_m: float = 0.0) -> SeenAt:
        """The meetpoint from poses (K, 3) that the robot may have had there; more_m: how much they are off."""
        nats, dart = np.full(len(poses), NO_NODE), np.full(len(poses), NO_DART, np.int64)
        path_nats, all_nats = np.zeros(len(poses)), self.nats + self.path_nats
        near_m = _NEAR_M + more_m
        first = np.searchsorted(self.poses[:, 0], poses[:, 0] - near_m)
        last = np.searchsorted(self.poses[:, 0], poses[:, 0] + near_m)
        for k in np.flatnonzero(first < last).tolist():
            off = self.poses[first[k] : last[k]] - poses[k]
            near = np.flatnonzero(
                (np.hypot(off[:, 0], off[:, 1]) < near_m) & (np.abs(angles.wrap(off[:, 2])) < _NEAR_RAD)
            )
            if len(near):
                best = first[k] + int(near[np.argmax(all_nats[first[k] + near])])
                nats[k], path_nats[k], dart[k] = self.nats[best], self.path_nats[best], self.dart[best]
        return SeenAt(nats, path_nats, dart)
