"""A belief over poses of the map: hypotheses, each with its evidence from scans.

The first scan is matched against every pose of the map. The poses where it fits move with odometry, are registered to
later scans, and gather evidence from the walls seen, each piece of wall once (new_walls.py): a piece supports the
pose if the map explains it, glass included, and opposes it otherwise. From time to time a scan is matched
everywhere again, because the true pose may have been missed. A new pose is traced back to the earlier scans, so that
all poses are judged by the same evidence.

Evidence is a log likelihood ratio to `elsewhere`: the robot is at none of these poses, but in another building or at
a pose that was missed. There the map explains as much as it does by chance. How much that is depends on the scan (two
parallel walls fit everywhere), so it is measured: it is what the tenth best of the distinct places of the map
explains. The tenth and not the second, because places that look alike are no evidence for elsewhere. The ratio of one
piece is bounded, since the pieces of one moved object are wrong together. A pose whose path crosses walls loses, too
(driven_path.py).

Between two poses of the map, what one of them contradicts says more: the beam went through furniture, or ended far
from all walls (scan_explanation.py). A near miss says less, since the map is drawn to a few cells.

The formulation is ours; the document (seed document global_localization_procedure.txt) has no scans. Multi-hypothesis
tracking: Jensfelt, Kristensen, Active global localization for a mobile robot using multiple hypothesis tracking
(2001). K poses, B beams, V views (scans that showed new walls).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import List, NamedTuple, Optional, Protocol, Tuple

import numpy as np
from scipy import special

from glass_nav.geometry import se2
from glass_nav.hypotheses import new_walls, pose_tracker
from glass_nav.hypotheses.driven_path import PIECE_M, DrivenPath
from glass_nav.hypotheses.new_walls import NewWalls
from glass_nav.hypotheses.scan_explanation import BeamsExplained
from glass_nav.sensing.scan import Scan

_NEAR_MISS = 0.5  # of the evidence of a piece that is given back between two poses: the map is drawn to a few cells
_THING = 2.0  # pieces of one thing that was moved
_UNCHANGED = 9.0  # things that were not moved for one that was, by the prior
_TYPICAL = 100.0  # pieces seen by the time that a robot has come to where places differ
_NATS = 0.5  # of a piece of wall that the map explains, to one that it does not; see above
_CHANCE, _MAX_CHANCE = 0.7, 0.9  # share that is explained elsewhere: at least, at most
_UNCHOSEN = 0.05  # less is explained by chance in a scan that did not choose the pose
_CHANCE_RANK = 10  # of the distinct places, by what the map explains: nobody expects so many copies of a place
_BLOCKED_NATS = 1.0  # that a piece of the path takes from a pose where walls block it
_TRACED_PIECES = int(3.0 / PIECE_M)  # of the path after a view, by which a new pose is judged: odometry drifts
_MIN_NEW = 4.0  # pieces of wall that make a view
_MIN_DISPUTED, _FEW = 1.0, 8  # ... that few likely poses do not agree about
_MOVED_M, _TURNED_RAD = 0.5, 0.5  # then poses slide to where the scan fits, new walls or not
_SLIDES_M, _SLIDES_RAD = 0.5, np.radians(15.0)  # a pose that is new
_OFF_M, _OFF_SHARE, _OFF_RAD = 0.2, 0.04, np.radians(10.0)  # a pose carried by odometry: at most, and per metre
_MAX_BEHIND = 14.0  # log likelihood ratio of the best pose to one that is dropped
_BY_SCANS = 7.0  # by scans alone; one that is less behind by them is kept, whatever else speaks against it
_MAX_POSES = 600
_AT_ONCE, _JUDGED_FIRST = 400, 2000  # poses found that are judged while one scan comes: 60 ms; of the first search
_TRACED = 40  # new poses that are traced back: up to 0.1 ms for each of the views
_AS_GOOD = 0.1  # share that a new pose explains less than the best: not worth tracing
_SEARCH_AGAIN_M, _SEARCH_SOON_M = 3.0, 1.0  # sooner where no pose is likely
_HOPELESS = -5.0  # log likelihood ratio of the best pose to elsewhere
_APART_M = 0.7  # places
NEW = -2  # label of a pose without a weight


class Search(Protocol):
    """A search of one scan in the whole map, such as hypotheses/place_search.py."""

    def advance(self) -> bool:
        """One slice; whether it is complete."""

    def places(self, odom_from_base: np.ndarray) -> np.ndarray:
        """(N, 3) poses of the robot at that odometry (3,), the best first."""


class MapScans(Protocol):
    """How a map would be seen; hypotheses/scan_explanation.py is one."""

    def search(self, scan: Scan, odom_from_base: np.ndarray) -> Optional[Search]:
        """Begins a search for poses where the scan fits; None: the scan is no evidence."""

    def beams(self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float) -> Optional[BeamsExplained]:
        """Poses (K, 3) slid by no more than that, with the beams explained from there; None: no evidence."""

    def seen_from(self, map_from_base: np.ndarray) -> Scan:
        """The scan that a robot at a pose (3,) would see if the map were right."""

    def is_free(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: by the map a robot may stand at points (..., 2) [m]."""


@dataclass(frozen=True)
class _View:
    """A scan that showed new walls."""

    scan: Scan
    odom_from_base: np.ndarray  # (3,)
    driven_m: float
    pieces: np.ndarray  # (B,) new walls that each beam shows
    chance: float  # share that is explained elsewhere

    @property
    def most(self) -> float:
        """Evidence of a pose from which the map explains all of it."""
        return _NATS * (1.0 - self.chance) * float(self.pieces.sum())


@dataclass(frozen=True)
class Evidence:
    """The evidence for K poses."""

    nats: np.ndarray  # (K,) log likelihood ratios to elsewhere, by the scans and the path
    checked_nats: np.ndarray  # (K,) the part of them by scans that did not choose the pose
    explained: np.ndarray  # (K,) pieces of wall that the map explains
    seen: np.ndarray  # (K,) pieces of wall that it should
    missed: np.ndarray  # (K,) pieces of wall that it neither explains nor contradicts: near misses
    contradicted: np.ndarray  # (K,) pieces of wall that it contradicts
    other_nats: np.ndarray  # (K,) log likelihood ratios by what is not a scan
    label: np.ndarray  # (K,) int, given by the caller; NEW: not weighted yet

    @classmethod
    def none(cls, count: int) -> Evidence:
        nothing = np.zeros(count)
        label = np.full(count, NEW, np.int64)
        return cls(nothing, nothing, nothing, nothing, nothing, nothing, nothing, label)

    def __getitem__(self, chosen: np.ndarray) -> Evidence:
        return Evidence(*(values[chosen] for values in vars(self).values()))

    def then(self, more: Evidence) -> Evidence:
        """The evidence for these poses and for more of them."""
        return Evidence(*map(np.concatenate, zip(vars(self).values(), vars(more).values())))

    def with_view(self, view: OfView) -> Evidence:
        return replace(
            self,
            nats=self.nats + view.nats,
            checked_nats=self.checked_nats + view.nats,
            explained=self.explained + view.explained,
            seen=self.seen + view.seen,
            missed=self.missed + view.missed,
            contradicted=self.contradicted + view.contradicted,
        )

    def with_path(self, blocked: np.ndarray) -> Evidence:
        """Of which so many pieces (K,) are blocked."""
        nats = _BLOCKED_NATS * blocked
        return replace(self, nats=self.nats - nats, checked_nats=self.checked_nats - nats)

    @property
    def total(self) -> np.ndarray:
        """(K,) log likelihood ratios by all."""
        return self.nats + self.other_nats

    @property
    def between_nats(self) -> np.ndarray:
        """(K,) log likelihood ratios of the poses to each other, to be added to those to elsewhere.

        What the map contradicts tells more than a near miss.
        """
        return _NEAR_MISS * _NATS * self.missed + _surprise(self.contradicted, self.seen)

    @property
    def share(self) -> np.ndarray:
        """(K,) of the walls seen that the map explains; NaN: nothing was seen that it knows."""
        return np.where(self.seen > 0.0, self.explained / np.where(self.seen > 0.0, self.seen, 1.0), np.nan)


class OfView(NamedTuple):
    """What one view says of K poses; as of Evidence."""

    nats: np.ndarray
    explained: np.ndarray
    seen: np.ndarray
    missed: np.ndarray
    contradicted: np.ndarray


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
        self._views: List[_View] = []
        self._odom_from_base: Optional[np.ndarray] = None  # at the last scan
        self._judged_at: Optional[np.ndarray] = None  # odometry
        self._judged_m = self._searched_m = 0.0  # distance driven
        self._search: Optional[_SearchedScan] = None
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
        off_m = _OFF_M + _OFF_SHARE * (self.driven_m - self._judged_m)
        beams = self._scans.beams(scan, self._tracker.poses, off_m, _OFF_RAD)
        if beams is None:
            return False
        view = self._view(scan, beams)
        if view is None and moved_m < _MOVED_M and turned_rad < _TURNED_RAD:
            return False
        self._judged_at, self._judged_m = self._odom_from_base, self.driven_m
        self._tracker.poses = beams.poses
        if view is not None:
            self._views.append(view)
            self.evidence = self.evidence.with_view(_of_view(beams, view))
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

    def _view(self, scan: Scan, beams: BeamsExplained) -> Optional[_View]:
        """None: too little of it is new."""
        assert self._odom_from_base is not None
        if not len(beams.poses):
            return None
        new = self._walls.of(beams.ends_m, self._odom_from_base, self.driven_m)
        total = self.evidence.total
        likely = total >= total.max() - _BY_SCANS
        pieces = _counted(beams, new, likely)
        disputed_m = _disputed(beams, likely)
        at = np.flatnonzero(~np.isnan(disputed_m[:, 0]))
        disputed = np.zeros(len(pieces))
        disputed[at] = self._disputed.of(disputed_m[at], self._odom_from_base, self.driven_m)
        if pieces.sum() < _MIN_NEW and disputed.sum() < _MIN_DISPUTED:
            return None
        self._walls.add(beams.ends_m, self._odom_from_base, self.driven_m)
        self._disputed.add(disputed_m[at], self._odom_from_base, self.driven_m)
        pieces = np.maximum(pieces, disputed)
        by_chance = _tenth(beams.poses, _share(beams, pieces))
        if by_chance is not None:
            self._chance = min(self._chance, max(by_chance, _CHANCE - _UNCHOSEN))
        return _View(scan, self._odom_from_base, self.driven_m, pieces, self._chance)

    # -- a scan that is looked for everywhere

    def _begin_search(self, scan: Scan) -> None:
        assert self._odom_from_base is not None
        search = self._scans.search(scan, self._odom_from_base)
        self._searched_m = self.driven_m
        if search is not None:
            most = _AT_ONCE if self.searches else _JUDGED_FIRST
            self._search = _SearchedScan(self._scans, search, scan, self._odom_from_base, self.driven_m, most)

    def _take_in(self, search: _SearchedScan, found: BeamsExplained) -> None:
        """The poses that a complete search found, at its scan."""
        assert self._odom_from_base is not None
        self._search, self.searches = None, self.searches + 1
        share = _share(found, new_walls.pieces(found.ends_m))
        order = np.argsort(-share, kind="stable")
        poses, share = found.poses[order], share[order]
        by_chance = _tenth(poses, share)
        chosen_by_chance = _CHANCE if by_chance is None else float(np.clip(by_chance, _CHANCE, _MAX_CHANCE))
        self._chance = chosen_by_chance - _UNCHOSEN
        now = se2.compose(poses, se2.compose(se2.inverse(search.odom_from_base), self._odom_from_base))
        if self.searches == 1:
            new = new_walls.pieces(found.ends_m)
            self._walls.add(found.ends_m, search.odom_from_base, search.driven_m)
            view = _View(search.scan, search.odom_from_base, search.driven_m, new, chosen_by_chance)
            self._views.append(view)
            self._judged_at, self._judged_m = search.odom_from_base, search.driven_m
            evidence = Evidence.none(len(now)).with_view(OfView(*(each[order] for each in _of_view(found, view))))
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
            off_m = _OFF_M + _OFF_SHARE * (driven_m - view.driven_m)
            here, driven_m = view.odom_from_base, view.driven_m
            if not len(kept):
                break
            beams = self._scans.beams(view.scan, back[kept], off_m, _OFF_RAD)
            assert beams is not None
            back[kept] = beams.poses
            of_view = OfView(*(np.zeros(len(poses)) for _ in OfView._fields))
            for whole, part in zip(of_view, _of_view(beams, view)):
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


class _SearchedScan:
    """A scan that is searched in the whole map: advance() until it is complete."""

    def __init__(
        self, scans: MapScans, search: Search, scan: Scan, odom_from_base: np.ndarray, driven_m: float, most: int
    ) -> None:
        self.scan, self.odom_from_base, self.driven_m = scan, odom_from_base, driven_m
        self._scans, self._search, self._most = scans, search, most
        self._left: Optional[np.ndarray] = None  # (N, 3) poses that are not judged yet; None: they are looked for
        self._judged: List[BeamsExplained] = []

    def advance(self) -> Optional[BeamsExplained]:
        """One slice; the poses found, once it is complete."""
        if self._left is None:
            if self._search.advance():
                self._left = self._search.places(self.odom_from_base)[: self._most]
            return None
        beams = self._scans.beams(self.scan, self._left[:_AT_ONCE], _SLIDES_M, _SLIDES_RAD)
        assert beams is not None
        self._judged.append(beams)
        self._left = self._left[_AT_ONCE:]
        if len(self._left):
            return None
        poses, explained, known, contradicted_at = (
            np.concatenate([getattr(part, name) for part in self._judged])
            for name in ("poses", "explained", "known", "contradicted_at")
        )
        return BeamsExplained(poses, beams.ends_m, explained, known, contradicted_at)


def expected_nats(scans: MapScans, map_from_base: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(K,) log likelihood ratios of a pose (3,) to others (K, 3) that a robot at the first one can expect of one scan.

    0 where nothing would be seen.
    """
    beams = scans.beams(scans.seen_from(map_from_base), np.concatenate([map_from_base[None], others]), _OFF_M, _OFF_RAD)
    if beams is None:
        return np.zeros(len(others))
    pieces = new_walls.pieces(beams.ends_m)
    missed = (beams.known & ~beams.explained & ~beams.contradicted) @ pieces
    contradicted = np.array([_pieces_at(beams, at) for at in beams.contradicted_at])
    nats = -_NATS * ((1.0 - _NEAR_MISS) * missed + contradicted) + _surprise(
        contradicted, np.full(len(missed), _TYPICAL)
    )
    return np.maximum(nats[0] - nats[1:], 0.0)


def _pieces_at(beams: BeamsExplained, at: np.ndarray) -> float:
    """Pieces of wall that the beams show at these shares (B,) of their lengths; NaN: nothing."""
    shown = ~np.isnan(at)
    return float(new_walls.pieces(beams.ends_m[shown] * at[shown, None]).sum())


def _surprise(contradicted: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(K,) log likelihood that the map contradicts so many (K,) of the pieces seen (K,), to that of none.

    It depends on how often that happens: where nothing was moved one cupboard in the wrong place says much, where many
    things were moved it says little. The rate is unknown, but has a prior; the likelihood is integrated over all rates.
    """
    things, all_things = contradicted / _THING, seen / _THING
    rates = special.betaln(1.0 + things, _UNCHANGED + np.maximum(all_things - things, 0.0))
    return rates - special.betaln(1.0, _UNCHANGED + all_things)


def _of_view(beams: BeamsExplained, view: _View) -> OfView:
    """What a view says of the poses of its beams."""
    seen, explained = beams.known @ view.pieces, beams.explained @ view.pieces
    nats = _NATS * (explained - view.chance * seen)
    missed = beams.known & ~beams.explained & ~beams.contradicted
    return OfView(nats, explained, seen, missed @ view.pieces, beams.contradicted @ view.pieces)


def _counted(beams: BeamsExplained, new: np.ndarray, likely: np.ndarray) -> np.ndarray:
    """(B,) pieces of wall that the beams are evidence of, of which they show (B,) for the first time.

    The whole scan is evidence, by the part of the walls explained that is new, at the likely pose ((K,) bool) that explains
    most of them. What is not explained there would be the wrong measure: beams that met a mirror or a person end
    somewhere else each time.
    """
    pieces = new_walls.pieces(beams.ends_m)
    explained = beams.explained[int(np.where(likely, beams.explained @ pieces, -1.0).argmax())]
    return pieces * ((new @ explained) / max(float(pieces @ explained), 1.0))


def _disputed(beams: BeamsExplained, likely: np.ndarray) -> np.ndarray:
    """(B, 2) in the robot's frame, where likely poses ((K,) bool) disagree about a beam, if they are few: the map explains it
    from one of them and contradicts it there from another. NaN: they do not disagree.

    What tells copies of a room apart is a piece of furniture beside walls that were seen through the door long before.
    """
    if not 1 < np.count_nonzero(likely) <= _FEW:
        return np.full(beams.ends_m.shape, np.nan)
    nearest = np.fmin.reduce(beams.contradicted_at[likely], axis=0)
    explained = beams.explained[likely].any(axis=0)
    return beams.ends_m * np.where(explained, nearest, np.nan)[:, None]


def _share(beams: BeamsExplained, pieces: np.ndarray) -> np.ndarray:
    """(K,) of the pieces of wall (B,) seen that the map explains; 0 where it knows none of them."""
    return (beams.explained @ pieces) / np.maximum(beams.known @ pieces, 1e-9)


def _tenth(poses: np.ndarray, share: np.ndarray) -> Optional[float]:
    """What the map explains where the robot is not: the share of the tenth best of the distinct places (K, 3); None: there
    are fewer.
    """
    order = np.argsort(-share, kind="stable")
    for _ in range(_CHANCE_RANK - 1):
        if not len(order):
            return None
        off_m = poses[order, :2] - poses[order[0], :2]
        order = order[np.hypot(off_m[:, 0], off_m[:, 1]) > _APART_M]
    return float(share[order[0]]) if len(order) else None
