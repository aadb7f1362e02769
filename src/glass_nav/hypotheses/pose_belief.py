"""A belief over poses of the map: hypotheses, each with its evidence from scans.

The first scan is matched against every pose of the map. The poses where it fits move with odometry, are registered to
later scans, and gather evidence from the walls seen, each piece of wall once (new_walls.py): a piece supports the
pose if the map explains it, glass included, and opposes it otherwise. From time to time a scan is matched
everywhere again, because the true pose may have been missed. A new pose is traced back to the earlier scans, so that
all poses are judged by the same evidence.

Evidence is a log likelihood ratio to `elsewhere`: the robot is at none of these poses, but in another building or at
a pose that was missed (pose_evidence.py). There the map explains as much as it does by chance. How much that is depends on
the scan (two parallel walls fit everywhere), so it is measured: it is what the tenth best of the distinct places of the
map explains. The tenth and not the second, because places that look alike are no evidence for elsewhere. A pose whose
path crosses walls loses, too (driven_path.py).

The formulation is ours; the document (seed document global_localization_procedure.txt) has no scans. Multi-hypothesis
tracking: Jensfelt, Kristensen, Active global localization for a mobile robot using multiple hypothesis tracking
(2001). K poses, B beams, V views (scans that showed new walls).
"""

from __future__ import annotations

from dataclasses import replace
from typing import List, Optional, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.hypotheses import new_walls, pose_evidence, pose_tracker, view_pieces
from glass_nav.hypotheses.driven_path import PIECE_M, DrivenPath
from glass_nav.hypotheses.map_scans import MapScans
from glass_nav.hypotheses.new_walls import NewWalls
from glass_nav.hypotheses.pose_evidence import OFF_M, OFF_RAD, Evidence, OfView, View
from glass_nav.hypotheses.scan_explanation import BeamsExplained
from glass_nav.hypotheses.searched_scan import AT_ONCE, SearchedScan
from glass_nav.sensing.scan import Scan

_CHANCE, _MAX_CHANCE = 0.7, 0.9  # share that is explained elsewhere: at least, at most
_UNCHOSEN = 0.05  # less is explained by chance in a scan that did not choose the pose
_TRACED_PIECES = int(3.0 / PIECE_M)  # of the path after a view, by which a new pose is judged: odometry drifts
_MIN_NEW = 4.0  # pieces of wall that make a view
_MIN_DISPUTED = 1.0  # ... that few likely poses do not agree about
_MOVED_M, _TURNED_RAD = 0.5, 0.5  # then poses slide to where the scan fits, new walls or not
_OFF_SHARE = 0.04  # by which a pose is off farther for each metre that odometry has carried it
_MAX_BEHIND = 14.0  # log likelihood ratio of the best pose to one that is dropped
_BY_SCANS = 7.0  # by scans alone; one that is less behind by them is kept, whatever else speaks against it
_MAX_POSES = 600
_JUDGED_FIRST = 2000  # poses found by the first search that are judged
_TRACED = 40  # new poses that are traced back: up to 0.1 ms for each of the views
_AS_GOOD = 0.1  # share that a new pose explains less than the best: not worth tracing
_SEARCH_AGAIN_M, _SEARCH_SOON_M = 3.0, 1.0  # sooner where no pose is likely
_HOPELESS = -5.0  # log likelihood ratio of the best pose to elsewhere


class PoseBelief:
    """see() every scan; weigh() by what is not a scan."""

    def __init__(self, scans: MapScans) -> None:
        self._scans = scans
        self.forget()

    def forget(self) -> None:
        """Nothing is known any more."""
        self._tracker = pose_tracker.PoseTracker(_MAX_BEHIND, _MAX_POSES)
        self.evidence = Evidence.none(0)
        self.driven_m = 0.0
        self.searches = 0  # of the whole map, complete
        self._walls, self._disputed, self._path = NewWalls(), NewWalls(), DrivenPath()
        self._pieces = 0  # of the path that poses were judged by
        self._views: List[View] = []
        self._odom_from_base: Optional[np.ndarray] = None  # at the last scan
        self._judged_at: Optional[np.ndarray] = None  # odometry
        self._judged_m = self._searched_m = 0.0  # distance driven
        self._search: Optional[SearchedScan] = None
        self._chance = _CHANCE  # share that is explained elsewhere, of scans that did not choose the poses

    @property
    def poses(self) -> np.ndarray:
        """(K, 3) map_from_base at the last scan, the best first."""
        return self._tracker.poses

    @property
    def odom_from_base(self) -> Optional[np.ndarray]:
        """(3,) at the last scan; None: there was none."""
        return self._odom_from_base

    def carry(self, odom_from_base: np.ndarray) -> None:
        """The robot moved."""
        step = self._tracker.carry(odom_from_base)
        self._odom_from_base = np.array(odom_from_base, float)
        if step is not None:
            self.driven_m += float(se2.travelled(step)[0])
        self._path.add(odom_from_base, self.driven_m)

    def see(self, scan: Scan, odom_from_base: np.ndarray) -> bool:
        """Process a scan.

        Args:
            scan: one revolution of a lidar.
            odom_from_base: (3,) odometry at its stamp.

        Returns:
            Whether the poses were judged.
        """
        self.carry(odom_from_base)
        if self._search is not None:
            found = self._search.advance()
            if found is not None:
                self._take_in(self._search, found)
                return True
        elif not self.searches:
            self._begin_search(scan)
        return bool(self.searches) and self._judge_if_due(scan)

    def weigh(self, nats: np.ndarray, label: np.ndarray) -> None:
        """Add log likelihood ratios (K,) to the evidence of the poses, and label (K,) them."""
        self.evidence = replace(self.evidence, other_nats=self.evidence.other_nats + nats, label=label)
        self._keep_distinct()

    def propose(self, poses: np.ndarray) -> np.ndarray:
        """Follow poses (N, 3) of the robot at the last scan, too, as far as the views so far allow.

        Returns:
            Indices of those that are followed from now on.
        """
        if not self.searches or not len(poses):
            return np.zeros(0, np.int64)
        chosen = np.arange(len(poses))[:_TRACED]
        evidence, kept = self._traced(poses[chosen])
        self._append(poses[chosen][kept], evidence[kept])
        return chosen[kept]

    # -- a scan that the poses are judged by

    def _judge_if_due(self, scan: Scan) -> bool:
        assert self._odom_from_base is not None and self._judged_at is not None
        step = se2.compose(se2.inverse(self._judged_at), self._odom_from_base)
        moved_m, turned_rad = se2.travelled(step)
        if moved_m < 0.5 * _MOVED_M and turned_rad < 0.5 * _TURNED_RAD:
            return False
        off_m = OFF_M + _OFF_SHARE * (self.driven_m - self._judged_m)
        beams = self._scans.beams(scan, self._tracker.poses, off_m, OFF_RAD)
        if beams is None:
            return False
        view = self._view(scan, beams)
        if view is None and moved_m < _MOVED_M and turned_rad < _TURNED_RAD:
            return False
        self._judged_at, self._judged_m = self._odom_from_base, self.driven_m
        self._tracker.poses = beams.poses
        if view is not None:
            self._views.append(view)
            self.evidence = self.evidence.with_view(pose_evidence.of_view(beams, view))
        self._judge_path()
        self._keep_distinct()
        hopeless = self.evidence.total.max(initial=-np.inf) < _HOPELESS
        far = self.driven_m - self._searched_m >= (_SEARCH_SOON_M if hopeless else _SEARCH_AGAIN_M)
        if (far or not len(self._tracker)) and self._search is None:
            self._begin_search(scan)
        return True

    def _judge_path(self) -> None:
        assert self._odom_from_base is not None
        first, self._pieces = self._pieces, self._path.complete
        blocked = self._blocked(self._tracker.poses, self._odom_from_base, first, self._pieces)
        self.evidence = self.evidence.with_path(blocked)

    def _blocked(self, poses: np.ndarray, odom_from_base: np.ndarray, first: int, last: int) -> np.ndarray:
        return self._path.blocked(self._scans.is_free, poses, odom_from_base, first, last)

    def _view(self, scan: Scan, beams: BeamsExplained) -> Optional[View]:
        """None: too little of it is new."""
        assert self._odom_from_base is not None
        if not len(beams.poses):
            return None
        new = self._walls.of(beams.ends_m, self._odom_from_base, self.driven_m)
        total = self.evidence.total
        likely = total >= total.max() - _BY_SCANS
        pieces = view_pieces.counted(beams, new, likely)
        disputed_m = view_pieces.disputed(beams, likely)
        at = np.flatnonzero(~np.isnan(disputed_m[:, 0]))
        disputed = np.zeros(len(pieces))
        disputed[at] = self._disputed.of(disputed_m[at], self._odom_from_base, self.driven_m)
        if pieces.sum() < _MIN_NEW and disputed.sum() < _MIN_DISPUTED:
            return None
        self._walls.add(beams.ends_m, self._odom_from_base, self.driven_m)
        self._disputed.add(disputed_m[at], self._odom_from_base, self.driven_m)
        pieces = np.maximum(pieces, disputed)
        by_chance = view_pieces.by_chance(beams.poses, view_pieces.explained_share(beams, pieces))
        if by_chance is not None:
            self._chance = min(self._chance, max(by_chance, _CHANCE - _UNCHOSEN))
        return View(scan, self._odom_from_base, self.driven_m, pieces, self._chance)

    # -- a scan that is looked for everywhere

    def _begin_search(self, scan: Scan) -> None:
        assert self._odom_from_base is not None
        search = self._scans.search(scan, self._odom_from_base)
        self._searched_m = self.driven_m
        if search is not None:
            most = AT_ONCE if self.searches else _JUDGED_FIRST
            self._search = SearchedScan(self._scans, search, scan, self._odom_from_base, self.driven_m, most)

    def _take_in(self, search: SearchedScan, found: BeamsExplained) -> None:
        """The poses that a complete search found, at its scan."""
        assert self._odom_from_base is not None
        self._search, self.searches = None, self.searches + 1
        share = view_pieces.explained_share(found, new_walls.pieces(found.ends_m))
        order = np.argsort(-share, kind="stable")
        poses, share = found.poses[order], share[order]
        by_chance = view_pieces.by_chance(poses, share)
        chosen_by_chance = _CHANCE if by_chance is None else float(np.clip(by_chance, _CHANCE, _MAX_CHANCE))
        self._chance = chosen_by_chance - _UNCHOSEN
        now = se2.compose(poses, se2.compose(se2.inverse(search.odom_from_base), self._odom_from_base))
        if self.searches == 1:
            new = new_walls.pieces(found.ends_m)
            self._walls.add(found.ends_m, search.odom_from_base, search.driven_m)
            view = View(search.scan, search.odom_from_base, search.driven_m, new, chosen_by_chance)
            self._views.append(view)
            self._judged_at, self._judged_m = search.odom_from_base, search.driven_m
            evidence = Evidence.none(len(now)).with_view(
                OfView(*(each[order] for each in pose_evidence.of_view(found, view)))
            )
            self._append(now, replace(evidence, checked_nats=np.zeros(len(now))))
            self._keep_distinct()
            return
        worth = np.flatnonzero(share >= max(_CHANCE - _AS_GOOD, np.fmax.reduce(share, initial=0.0) - _AS_GOOD))
        self.propose(now[worth])
        self._keep_distinct()

    def _traced(self, poses: np.ndarray) -> Tuple[Evidence, np.ndarray]:
        """The evidence of poses (N, 3) at the last scan by all views, and the indices of those not far behind."""
        assert self._odom_from_base is not None
        evidence, kept = Evidence.none(len(poses)), self._unknown(poses)
        back, here, driven_m = poses, self._odom_from_base, self.driven_m
        least = self.evidence.nats.max(initial=0.0) - _MAX_BEHIND
        possible = sum(view.most for view in self._views)
        pieces = self._pieces
        for view in reversed(self._views):
            back = se2.compose(back, se2.compose(se2.inverse(here), view.odom_from_base))
            off_m = OFF_M + _OFF_SHARE * (driven_m - view.driven_m)
            here, driven_m = view.odom_from_base, view.driven_m
            if not len(kept):
                break
            beams = self._scans.beams(view.scan, back[kept], off_m, OFF_RAD)
            assert beams is not None
            back[kept] = beams.poses
            of_view = OfView(*(np.zeros(len(poses)) for _ in OfView._fields))
            for whole, part in zip(of_view, pose_evidence.of_view(beams, view)):
                whole[kept] = part
            evidence = evidence.with_view(of_view)
            possible -= view.most
            first = int(view.driven_m / PIECE_M)
            blocked = np.zeros(len(poses))
            blocked[kept] = self._blocked(back[kept], here, first, min(pieces, first + _TRACED_PIECES))
            evidence, pieces = evidence.with_path(blocked), first
            kept = kept[evidence.nats[kept] > least - possible]
        return evidence, kept

    def _unknown(self, poses: np.ndarray) -> np.ndarray:
        """Indices of the poses (N, 3) that are not followed."""
        return np.array(
            [k for k, pose in enumerate(poses) if not pose_tracker.same_place(self._tracker.poses, pose).any()],
            np.int64,
        )

    def _append(self, poses: np.ndarray, evidence: Evidence) -> None:
        self._tracker.add(poses)
        self.evidence = self.evidence.then(evidence)

    def _keep_distinct(self) -> None:
        nats = self.evidence.nats
        held_by_scans = nats >= nats.max(initial=-np.inf) - _BY_SCANS
        self.evidence = self.evidence[self._tracker.keep_distinct(self.evidence.total, held_by_scans)]
