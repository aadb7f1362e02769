"""Scans at meetpoints, odometry between them -> the pose that explains them all, if only one does.

A map is never quite right: furniture was moved, a door is shut, and then there are meetpoints and edges that no atlas
has. A pose can be judged all the same. Each place of the map where the scan of a meetpoint could have been made is
followed from meetpoint to meetpoint by odometry, slides to where the new scan fits best, and is judged by how much of
that scan the map explains; whether the atlas has a meetpoint there is not asked. Most of what a robot sees is as it
was mapped, so the truth explains much everywhere; what explains one scan elsewhere by chance does not explain the
next, seen from somewhere else.

The truth may be missed at first, so the scan of every meetpoint proposes poses anew. A new one that no followed pose
leads to is followed backwards, to all the places where the robot was before: so all poses are judged by the same
scans. Scans of a place that was seen before tell nothing new, and only move the poses. The formulation is ours; the
document (seed document global_localization_procedure.txt) has no map but the atlas. K poses, P places.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Protocol, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.sensing.scan import Scan
from glass_nav.topology.observations import Meetpoint

_PROPOSED_FIRST, _FIRST = 4000, 1000  # by the scan of the first meetpoint, before they slide; followed of these
_PROPOSED, _NEW = 1000, 100  # at others
_MOST = 1000
MAX_LEAD = 0.3  # that can be told: who is further behind is dropped at last
_HOPELESS = 0.35  # of the beams, in the mean, less than the best explains
_SLIDES_M, _SLIDES_RAD = 0.5, np.radians(15.0)  # a proposed pose
_OFF_M, _OFF_SHARE, _OFF_RAD = 0.2, 0.04, np.radians(10.0)  # a pose that odometry moved: at most, and per metre
_APART_M, _APART_SHARE = 1.5, 0.03  # another place, from where things look otherwise
_SAME_CELL = np.array([0.3, 0.3, 0.15])  # poses in one cell are one [m, m, rad]
_SAME_M, _SAME_RAD = 0.7, 0.25  # poses nearer than that are no rivals


class MapScans(Protocol):
    """How a map would be seen; hypotheses/scan_explanation.py is one."""

    def places(self, scan: Scan, most: int) -> np.ndarray:
        """(K, 3) poses where the scan may have been made, the best first."""

    def fitted(
        self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float
    ) -> Tuple[np.ndarray, np.ndarray]:
        """(K, 3) poses slid by no more than that to where the scan fits best, (K,) shares that the map explains."""


@dataclass(frozen=True)
class Standing:
    """How the pose that explains most compares."""

    map_from_base: np.ndarray  # (3,) at the last meetpoint
    places: int  # that it is judged by
    share: float  # of the beams explained, mean over the places
    lead: float  # by so much of that the next best pose is behind; inf: there is none
    share_now: float  # of the last scan
    lead_now: float  # by so much of that all other poses are behind; negative: before it


@dataclass(frozen=True)
class _Place:
    """Where a scan was made that all poses are judged by."""

    scan: Scan
    odom_from_base: np.ndarray  # (3,)
    way_m: float  # driven until then


class FollowedPoses:
    """begin() with a meetpoint, follow() to each next one."""

    def __init__(self, scans: MapScans) -> None:
        self._scans = scans
        self._forget()

    def _forget(self) -> None:
        self._places: List[_Place] = []
        self._poses = np.zeros((0, 3))
        self._shares = np.zeros((0, 0))  # (K, P)
        self._now = np.zeros(0)  # (K,) of the last scan; NaN: it told nothing
        self._tried = np.zeros((0, 3)), np.zeros(0)  # all poses of the last scan with their shares, also those dropped
        self._odom_from_base: Optional[np.ndarray] = None  # at the last meetpoint
        self._way_m = 0.0

    @property
    def standing(self) -> Optional[Standing]:
        """None: no scan has told anything yet."""
        if not len(self._poses):
            return None
        means = self._shares.mean(axis=1)
        best = int(means.argmax())
        lead, lead_now = (
            float(own - values[~_same_place(poses, self._poses[best])].max(initial=-np.inf))
            for own, poses, values in ((means[best], self._poses, means), (self._now[best], *self._tried))
        )
        return Standing(
            self._poses[best].copy(), len(self._places), float(means[best]), lead, float(self._now[best]), lead_now
        )

    def begin(self, meetpoint: Meetpoint) -> None:
        """Nothing is known any more but this meetpoint."""
        self._forget()
        if meetpoint.odom_from_base is None:
            return
        self._odom_from_base = meetpoint.odom_from_base
        if meetpoint.scan is not None:
            self._take(meetpoint.scan, meetpoint.odom_from_base, 0.0)

    def follow(self, meetpoint: Meetpoint, way_m: float) -> None:
        """The next meetpoint, so many metres of way behind the last; all begins anew where there is no odometry."""
        before, after = self._odom_from_base, meetpoint.odom_from_base
        if before is None or after is None:
            self.begin(meetpoint)
            return
        self._odom_from_base = after
        self._way_m += way_m
        self._poses = se2.compose(self._poses, se2.compose(se2.inverse(before), after))
        if meetpoint.scan is not None:
            self._take(meetpoint.scan, after, way_m)

    # -- a scan

    def _take(self, scan: Scan, odom_from_base: np.ndarray, way_m: float) -> None:
        off_m = _OFF_M + _OFF_SHARE * way_m
        moved, shares = self._fitted(scan, self._poses, off_m, _OFF_RAD)
        new, new_shares = self._proposed(scan)
        if not len(new):  # it tells nothing
            self._now = np.full(len(self._poses), np.nan)
            return
        history = np.concatenate([self._shares, self._history(new, new_shares, shares, off_m, odom_from_base)])
        poses, shares = np.concatenate([moved, new]), np.concatenate([shares, new_shares])
        self._tried = poses, shares
        if self._is_new_place(odom_from_base):
            self._places.append(_Place(scan, odom_from_base, self._way_m))
            history = np.column_stack([history, shares])
        self._keep_distinct(poses, history, shares)

    def _fitted(self, scan: Scan, poses: np.ndarray, most_m: float, most_rad: float) -> Tuple[np.ndarray, np.ndarray]:
        """As of MapScans; where the map cannot judge, it explains nothing."""
        poses, shares = self._scans.fitted(scan, poses, most_m, most_rad)
        return poses, np.nan_to_num(shares)

    def _is_new_place(self, odom_from_base: np.ndarray) -> bool:
        for place in self._places:
            off = odom_from_base[:2] - place.odom_from_base[:2]
            if float(np.hypot(*off)) < _APART_M + _APART_SHARE * (self._way_m - place.way_m):
                return False
        return True

    def _proposed(self, scan: Scan) -> Tuple[np.ndarray, np.ndarray]:
        """(N, 3) poses and (N,) shares: from where the map explains most of this scan."""
        tried, most = (_PROPOSED, _NEW) if self._places else (_PROPOSED_FIRST, _FIRST)
        poses, shares = self._fitted(scan, self._scans.places(scan, tried), _SLIDES_M, _SLIDES_RAD)
        order = np.argsort(-shares, kind="stable")
        order = order[_first_of_each_cell(poses[order])][:most]
        return poses[order], shares[order]

    def _history(
        self,
        poses: np.ndarray,
        shares: np.ndarray,
        followed_shares: np.ndarray,
        off_m: float,
        odom_from_base: np.ndarray,
    ) -> np.ndarray:
        """(N, P) what poses (N, 3), that explain shares (N,) of this scan, explain of the places before: as the best
        followed pose that may have come there and explains less where it slid to; or else looked up backwards.
        """
        history = np.full((len(poses), len(self._places)), np.nan)
        if not self._places:
            return history
        means = self._shares.mean(axis=1)
        for index, pose in enumerate(poses):
            off = self._poses - pose
            near = np.flatnonzero(
                (np.hypot(off[:, 0], off[:, 1]) < off_m)
                & (np.abs(angles.wrap(off[:, 2])) < _OFF_RAD)
                & (followed_shares < shares[index])
            )
            if len(near):
                history[index] = self._shares[near[means[near].argmax()]]
        orphans = np.flatnonzero(np.isnan(history[:, 0]))
        back, here, way_m = poses[orphans], odom_from_base, self._way_m
        for number in range(len(self._places) - 1, -1, -1):
            place = self._places[number]
            back = se2.compose(back, se2.compose(se2.inverse(here), place.odom_from_base))
            off_m = _OFF_M + _OFF_SHARE * (way_m - place.way_m)
            back, history[orphans, number] = self._fitted(place.scan, back, off_m, _OFF_RAD)
            here, way_m = place.odom_from_base, place.way_m
        return history

    def _keep_distinct(self, poses: np.ndarray, shares: np.ndarray, now: np.ndarray) -> None:
        means = shares.mean(axis=1)
        order = np.argsort(-means, kind="stable")
        order = order[means[order] >= means[order[0]] - _HOPELESS]
        chosen = order[_first_of_each_cell(poses[order])][:_MOST]
        self._poses, self._shares, self._now = poses[chosen], shares[chosen], now[chosen]


def _same_place(poses: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """(K,) bool: poses (K, 3) so near to a pose (3,) that they are no rivals of it."""
    return (np.hypot(*(poses[:, :2] - pose[:2]).T) < _SAME_M) & (np.abs(angles.wrap(poses[:, 2] - pose[2])) < _SAME_RAD)


def _first_of_each_cell(poses: np.ndarray) -> np.ndarray:
    """Ascending indices of the poses (K, 3) that are the first in their cell of _SAME_CELL; yaw goes round."""
    if not len(poses):  # which numpy 1.17 cannot
        return np.zeros(0, np.int64)
    cells = np.round(np.column_stack([poses[:, :2], angles.wrap(poses[:, 2])]) / _SAME_CELL).astype(np.int64)
    return np.sort(np.unique(cells, axis=0, return_index=True)[1])
