"""Scans at some places, odometry between them -> the pose that explains them all, if only one does.

A map is never quite right: furniture was moved, a door is shut, and then there are meetpoints and edges that no atlas
has. A pose can be judged all the same. Each pose of the map from which a scan may have been taken is carried to the
next scan by odometry, slides to where that scan fits best, and is judged by how much of it the map explains; whether
the atlas has a meetpoint there is not asked. Most of what a robot sees is as it was mapped, so the true pose explains
much everywhere; a pose that explains one scan by chance does not explain the next, seen from somewhere else.

The true pose may be missed at first, so every scan proposes poses anew. A new one that no followed pose leads to is
traced back to all the places where the robot was before: so all poses are judged by the same scans. Scans of a place
that was seen before are no new evidence, and only move the poses. The formulation is ours; the document (seed document
global_localization_procedure.txt) has no map but the atlas. K poses, P places.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Protocol, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import pose_tracker
from glass_nav.hypotheses.pose_tracker import PoseTracker
from glass_nav.sensing.scan import Scan

_PROPOSED_FIRST, _FIRST = 4000, 1000  # by the first scan, before they slide; followed of these
_PROPOSED, _NEW = 1000, 100  # by others
_MAX_POSES = 1000
MAX_LEAD = 0.3  # that can be reported: what is further behind is dropped at last
_MAX_BEHIND = 0.35  # share of the beams, in the mean, that a pose explains less than the best
_SLIDES_M, _SLIDES_RAD = 0.5, np.radians(15.0)  # a proposed pose
_OFF_M, _OFF_SHARE, _OFF_RAD = 0.2, 0.04, np.radians(10.0)  # a pose carried by odometry: at most, and per metre
_APART_M, _APART_SHARE = 1.5, 0.03  # another place, from where things look otherwise: at least, and per metre driven


class MapScans(Protocol):
    """How a map would be seen; hypotheses/scan_explanation.py is one."""

    def places(self, scan: Scan, most: int) -> np.ndarray:
        """(K, 3) poses from which the scan may have been taken, the best first."""

    def fitted(
        self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float
    ) -> Tuple[np.ndarray, np.ndarray]:
        """(K, 3) poses slid by no more than that to where the scan fits best, (K,) shares that the map explains."""


@dataclass(frozen=True)
class Standing:
    """How the pose that explains most compares."""

    map_from_base: np.ndarray  # (3,) at the last scan
    places: int  # that it is judged by
    share: float  # of the beams explained, mean over the places
    lead: float  # of that share over the next best pose; inf: no other pose
    share_now: float  # of the last scan
    lead_now: float  # of that share over all other poses; negative: one of them explains more


@dataclass(frozen=True)
class _Place:
    """Where a scan was taken that all poses are judged by."""

    scan: Scan
    odom_from_base: np.ndarray  # (3,)
    distance_m: float  # driven until then


class FollowedPoses:
    """begin() at one place, follow() to each next one."""

    def __init__(self, scans: MapScans) -> None:
        self._scans = scans
        self._forget()

    def _forget(self) -> None:
        self._places: List[_Place] = []
        self._tracker = PoseTracker(_MAX_BEHIND, _MAX_POSES)
        self._shares = np.zeros((0, 0))  # (K, P)
        self._now = np.zeros(0)  # (K,) of the last scan; NaN: it was no evidence
        self._tried = np.zeros((0, 3)), np.zeros(0)  # all poses of the last scan with their shares, also those dropped
        self._has_odometry = False  # at the last place
        self._distance_m = 0.0  # driven since the first

    @property
    def standing(self) -> Optional[Standing]:
        """None: no scan has been evidence yet."""
        poses = self._tracker.poses
        if not len(poses):
            return None
        means = self._shares.mean(axis=1)
        best = int(means.argmax())
        lead = pose_tracker.lead(poses[best], means[best], poses, means)
        lead_now = pose_tracker.lead(poses[best], self._now[best], *self._tried)
        return Standing(
            poses[best].copy(), len(self._places), float(means[best]), lead, float(self._now[best]), lead_now
        )

    def begin(self, odom_from_base: Optional[np.ndarray], scan: Optional[Scan]) -> None:
        """Nothing is known any more but what is seen here.

        Args:
            odom_from_base: (3,) of the robot at the scan; None: poses cannot be followed from here.
            scan: None: nothing was seen.
        """
        self._forget()
        if odom_from_base is None:
            return
        self._has_odometry = True
        self._tracker.carry(odom_from_base)
        if scan is not None:
            self._take(scan, odom_from_base, 0.0)

    def follow(self, odom_from_base: Optional[np.ndarray], scan: Optional[Scan], distance_m: float) -> None:
        """The next place, so many metres after the last; all begins anew where there is no odometry."""
        if not self._has_odometry or odom_from_base is None:
            self.begin(odom_from_base, scan)
            return
        self._distance_m += distance_m
        self._tracker.carry(odom_from_base)
        if scan is not None:
            self._take(scan, odom_from_base, distance_m)

    # -- a scan

    def _take(self, scan: Scan, odom_from_base: np.ndarray, distance_m: float) -> None:
        off_m = _OFF_M + _OFF_SHARE * distance_m
        moved, shares = self._fitted(scan, self._tracker.poses, off_m, _OFF_RAD)
        new, new_shares = self._proposed(scan)
        if not len(new):  # the scan is no evidence
            self._now = np.full(len(self._tracker), np.nan)
            return
        history = np.concatenate([self._shares, self._history(new, new_shares, shares, off_m, odom_from_base)])
        self._tracker.poses = moved
        self._tracker.add(new)
        shares = np.concatenate([shares, new_shares])
        self._tried = self._tracker.poses, shares
        if self._is_new_place(odom_from_base):
            self._places.append(_Place(scan, odom_from_base, self._distance_m))
            history = np.column_stack([history, shares])
        chosen = self._tracker.keep_distinct(history.mean(axis=1))
        self._shares, self._now = history[chosen], shares[chosen]

    def _fitted(self, scan: Scan, poses: np.ndarray, most_m: float, most_rad: float) -> Tuple[np.ndarray, np.ndarray]:
        """As of MapScans; where the map cannot judge, it explains nothing."""
        poses, shares = self._scans.fitted(scan, poses, most_m, most_rad)
        return poses, np.nan_to_num(shares)

    def _is_new_place(self, odom_from_base: np.ndarray) -> bool:
        for place in self._places:
            off = odom_from_base[:2] - place.odom_from_base[:2]
            if float(np.hypot(*off)) < _APART_M + _APART_SHARE * (self._distance_m - place.distance_m):
                return False
        return True

    def _proposed(self, scan: Scan) -> Tuple[np.ndarray, np.ndarray]:
        """(N, 3) poses and (N,) shares: from where the map explains most of this scan."""
        tried, most = (_PROPOSED, _NEW) if self._places else (_PROPOSED_FIRST, _FIRST)
        poses, shares = self._fitted(scan, self._scans.places(scan, tried), _SLIDES_M, _SLIDES_RAD)
        order = np.argsort(-shares, kind="stable")
        order = order[pose_tracker.first_of_each_cell(poses[order])][:most]
        return poses[order], shares[order]

    def _history(
        self,
        poses: np.ndarray,
        shares: np.ndarray,
        followed_shares: np.ndarray,
        off_m: float,
        odom_from_base: np.ndarray,
    ) -> np.ndarray:
        """(N, P) shares of the places before that poses (N, 3), which explain shares (N,) of this scan, explain.

        Those of the best followed pose that may have come there and explains less where it slid to; without one, those
        found by tracing the pose back.
        """
        history = np.full((len(poses), len(self._places)), np.nan)
        if not self._places:
            return history
        followed, means = self._tracker.poses, self._shares.mean(axis=1)
        for index, pose in enumerate(poses):
            off = followed - pose
            near = np.flatnonzero(
                (np.hypot(off[:, 0], off[:, 1]) < off_m)
                & (np.abs(angles.wrap(off[:, 2])) < _OFF_RAD)
                & (followed_shares < shares[index])
            )
            if len(near):
                history[index] = self._shares[near[means[near].argmax()]]
        orphans = np.flatnonzero(np.isnan(history[:, 0]))
        back, here, distance_m = poses[orphans], odom_from_base, self._distance_m
        for number in range(len(self._places) - 1, -1, -1):
            place = self._places[number]
            back = se2.compose(back, se2.compose(se2.inverse(here), place.odom_from_base))
            off_m = _OFF_M + _OFF_SHARE * (distance_m - place.distance_m)
            back, history[orphans, number] = self._fitted(place.scan, back, off_m, _OFF_RAD)
            here, distance_m = place.odom_from_base, place.distance_m
        return history
