"""Watches the tracked pose, detects that the robot was kidnapped or given a wrong pose, and finds the right one.

The particles of a kidnapped robot converge where the scan fits best nearby, with a small covariance. The symptom is
that scans fit worse than before. Then a global search (hypotheses/global_search.py) runs beside the filter, with the
tracked pose as a candidate that has a head start. If the robot is merely surrounded by people, the scans fit nowhere
else, and the pose stays. If another place fits better over some distance, the robot is there. The formulation is
ours.

After the pose was certain once, dead reckoning since then is a prior over places, with a heavy tail in case the robot
was carried away. Of two halls that look alike, odometry then decides, and a tracked pose that the scans have dragged
away from it has no advantage. If scans show that the robot was moved without driving (scan_continuity.py), neither
odometry nor the tracked pose is evidence, and the pose is contested until it leads over all other places.

A given pose may be wrong as well, although odometry continues it and scans fit near it. So it is compared with all
other places from the first scan on, until it leads over them, or none has overtaken it over some distance.
"""

from __future__ import annotations

import collections
from dataclasses import dataclass, replace
from functools import partial
from typing import Deque, Optional, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.hypotheses import global_search, pose_tracker
from glass_nav.hypotheses.global_search import Candidates, GlobalSearch, SearchParams
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.localization.integrity.dead_reckoning import DeadReckoning
from glass_nav.localization.integrity.scan_continuity import ScanContinuity
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea
from glass_nav.sensing.scan import Scan

_USUAL_FIT = 0.9  # of a right pose, until it is learnt
_USUAL_SPREAD = 0.02  # around that
_PRIOR_M = 1.0  # distance driven that these two are worth
_LEARN_M, _FORGET_M = 20.0, 0.5  # distance over which the usual and the present fit are averaged
_DELAY_M = 3.0  # distance driven without doubt before a fit is learnt
_MIN_STEP_M = 0.05  # distance that a scan counts for when the robot stands
_DOUBT = (0.06, 3.0)  # below the usual fit, as such and in deviations: search everywhere
_POOR = 0.7  # of the usual fit: not to be relied on, whatever there is elsewhere
_HEAD_START = 3.0  # log likelihood ratio of the tracked pose, or of where odometry leads, to all others: for doubts
_KEPT_START = (
    5.0  # the same where odometry has led to the tracked pose since it was sure, without a break in what is seen
)
_KEPT = 3.0  # deviations of dead reckoning within which it leads to the tracked pose
_CARRIED_AWAY = -10.0  # log likelihood ratio of any other place to where odometry leads: for a new pose
_TWINS_M = 20.0  # after this distance without an end, a given pose is believed though another place fits as well
_SETTLED_M = 6.0  # after this distance as the best candidate, the fit at the tracked pose is the usual one
_CALM_M = 2.0  # after this distance of usual fits nothing was wrong
_CLEAR = 3.0  # log likelihood ratio of the tracked pose to all others: it is trusted though the robot was moved
_POOR_LEAD = 2.0  # times the margin that a place needs where scans fit worse than they did
_OFF_MAP_M = 20.0  # where odometry leads off the map: distance over which a place elsewhere has to be the right one
_CLOSE = -1.0  # log likelihood ratio of another place to the tracked pose from which it may be the right one


@dataclass(frozen=True)
class Verdict:
    """The verdict of the scans on the tracked pose."""

    fit: float  # present fit at it, 0..1; NaN: no scan has been evidence yet
    usual: float  # what it has been so far
    log_ratio: float  # log likelihood ratio of the best place elsewhere to it; <= 0: it is the best; -inf: no search
    doubted: bool  # the scans fit worse than they used to
    found: Optional[np.ndarray]  # (3,) the pose where the robot is instead
    candidates: Optional[Candidates]  # during a search
    elsewhere: Optional[np.ndarray] = None  # (3,) the best place that is not the tracked one, during a search
    moved: bool = False  # the robot was moved without driving, and is not known to be at the tracked pose again
    kept: bool = (
        False  # odometry leads from the last sure pose to this one, and the robot was not moved without driving
    )
    given: bool = False  # the tracked pose was not compared with all other places yet

    @property
    def fit_there(self) -> float:
        """Fit of the best candidate, 0..1; NaN: no search runs."""
        return float("nan") if self.candidates is None else self.candidates.fit

    @property
    def poor(self) -> bool:
        """The scans fit much worse than they used to, and odometry does not vouch for the pose."""
        return self.fit < _POOR * self.usual and not self.kept

    @property
    def losing(self) -> bool:
        """Scans have cost a given pose a third of its head start over another place."""
        return self.given and self.log_ratio > -2.0 / 3.0 * _HEAD_START

    @property
    def contested(self) -> bool:
        """The scans fit worse than they used to, or the robot was moved, and they fit about as well or better elsewhere.

        A given pose is contested by any place that has overtaken it.
        """
        return self.moved or (self.doubted and self.log_ratio > _CLOSE) or (self.given and self.log_ratio > 0.0)


class KidnapDetector:
    """Remembers how well scans fit at the tracked pose, and searches elsewhere when they no longer do."""

    def __init__(
        self,
        field: DistanceField,
        matcher: Optional[ScanMatcher],
        params: SearchParams,
        usual_fit: Optional[float] = None,
        area: Optional[KnownArea] = None,
        given: bool = False,
    ) -> None:
        """
        Args:
            field: of the map.
            matcher: searches everywhere. None: the map has no free cell.
            params: whether and when another place is accepted.
            usual_fit: of scans at the pose; None: not known yet.
            area: where the map knows something; None: everywhere.
            given: somebody gave the pose; False: it comes from a comparison of all places.
        """
        self._field, self._matcher, self._params, self._area = field, matcher, params, area
        self._usual, self._spread = _USUAL_FIT if usual_fit is None else usual_fit, _USUAL_SPREAD
        self._learnt_m = _PRIOR_M
        self._fit = float("nan")
        self._recent: Deque[Tuple[float, float]] = collections.deque()  # fit and distance of scans not learnt from yet
        self._recent_m = 0.0
        self._search: Optional[GlobalSearch] = None
        self._search_m = self._calm_m = 0.0
        self._search_fit_m = 0.0  # sum of fit times distance during the search
        self._elsewhere_m = 0.0  # distance over which another place has been the right one, as far as scans can tell
        self._odom_from_base: Optional[np.ndarray] = None
        self._continuity = ScanContinuity()
        self._moved = False  # without driving, since the last search that found the tracked pose right
        self._given = given
        self._verdict = Verdict(float("nan"), self._usual, -np.inf, False, None, None)

    def reconfigure(self, params: SearchParams) -> None:
        """Use other limits from the next scan on."""
        self._params = params
        if self._search is not None:
            self._search.reconfigure(params)

    @property
    def _tolerance(self) -> float:
        """How far a fit may be below the usual one without doubt."""
        return max(_DOUBT[0], _DOUBT[1] * self._spread)

    @property
    def is_matching(self) -> bool:
        """A search has begun, and its first scan has not been matched everywhere yet: more scans advance that."""
        return self._search is not None and self._verdict.candidates is None

    def observe(
        self,
        scan: Scan,
        odom_from_base: np.ndarray,
        map_from_base: np.ndarray,
        dead_reckoning: Optional[DeadReckoning] = None,
        period_s: Optional[float] = None,
    ) -> Verdict:
        """Process a scan and the tracked pose after it; with too few returns the verdict stays.

        Args:
            scan: one revolution of a lidar.
            odom_from_base: (3,) odometry at its stamp.
            map_from_base: (3,) the tracked pose.
            dead_reckoning: from the last sure pose to this scan; None: no pose was sure yet.
            period_s: from one scan to the next; None: not known.
        """
        step_m = self._distance(odom_from_base)
        points = global_search.evidence_points(scan)
        if points is None:
            return self._verdict
        fit = self._fit_at(points, map_from_base)
        if fit is not None:
            self._fit = fit if np.isnan(self._fit) else self._fit + (fit - self._fit) * -np.expm1(-step_m / _FORGET_M)
        elif self._search is None:  # what ends where the map knows nothing agrees with every pose
            return self._verdict
        doubted = self._usual - self._fit > self._tolerance
        matcher = self._matcher if self._params.recover_when_lost else None
        if matcher is not None and self._continuity.observe(scan, odom_from_base, map_from_base):
            self._moved, self._search = True, None  # what a search gathered before is about another place
        if matcher is None:  # nothing can be compared
            self._given = False
        kept = dead_reckoning is not None and bool(dead_reckoning.mahalanobis(map_from_base[None])[0] < _KEPT)
        if self._moved or self._given:
            dead_reckoning, kept = None, False
        if matcher is not None and self._search is None and (doubted or self._moved or self._given):
            self._begin_search(matcher, map_from_base, dead_reckoning)
        if self._search is None:
            if not doubted and fit is not None:
                self._learn(fit, step_m)
            self._verdict = Verdict(
                self._fit,
                self._usual,
                -np.inf,
                doubted,
                None,
                None,
                kept=kept,
                given=self._given,
            )
        else:
            self._search_m += step_m
            self._search_fit_m += step_m * (self._fit if fit is None else fit)
            self._calm_m = 0.0 if doubted else self._calm_m + step_m
            prior = None if dead_reckoning is None else partial(dead_reckoning.log_likelihood, least=_CARRIED_AWAY)
            candidates = self._search.update(scan, odom_from_base, log_prior=prior, period_s=period_s)
            verdict = self._compare(candidates, points, map_from_base, doubted, dead_reckoning, kept, fit is not None)
            self._elsewhere_m = 0.0 if verdict.found is None else self._elsewhere_m + step_m
            if self._elsewhere_m < _OFF_MAP_M and self._is_off_map(dead_reckoning, points, verdict.found):
                verdict = replace(verdict, found=None)
            self._verdict = verdict
            if self._search is not None:
                self._search.correct(map_from_base)
        return self._verdict

    def _begin_search(
        self, matcher: ScanMatcher, map_from_base: np.ndarray, dead_reckoning: Optional[DeadReckoning]
    ) -> None:
        self._search = GlobalSearch(matcher, self._field, self._params, self._area)
        self._search_m = self._calm_m = self._search_fit_m = self._elsewhere_m = 0.0
        if dead_reckoning is None:
            self._search.add(map_from_base, 0.0 if self._moved else _HEAD_START)
        else:
            self._search.add(map_from_base, 0.0)
            self._search.add(dead_reckoning.map_from_base, 0.0)
        self._recent.clear()
        self._recent_m = 0.0

    def _compare(
        self,
        candidates: Candidates,
        points: np.ndarray,
        map_from_base: np.ndarray,
        doubted: bool,
        dead_reckoning: Optional[DeadReckoning],
        kept: bool,
        on_map: bool,
    ) -> Verdict:
        """The tracked pose with the best place elsewhere."""
        if np.isnan(candidates.fit):  # the first scan has not been matched everywhere yet
            return Verdict(self._fit, self._usual, -np.inf, doubted, None, None, None, self._moved, kept, self._given)
        here = pose_tracker.same_place(candidates.poses, map_from_base)
        with np.errstate(divide="ignore"):
            log_w = np.log(candidates.weights)
        if dead_reckoning is not None:  # doubts need less than a new pose
            likelihood = dead_reckoning.log_likelihood(candidates.poses)
            least = -_KEPT_START if kept else -_HEAD_START
            log_w = log_w - np.maximum(likelihood, _CARRIED_AWAY) + np.maximum(likelihood, least)
        elsewhere = None if here.all() else int(np.flatnonzero(~here)[np.argmax(log_w[~here])])
        log_there = -np.inf if elsewhere is None else log_w[elsewhere]
        log_ratio = float(log_there - log_w[here].max()) if here.any() else np.inf
        fit_during_search = self._search_fit_m / self._search_m
        steady = self._fit > fit_during_search - _DOUBT[0]
        clear = log_ratio <= -_CLEAR  # scans speak for the tracked pose, whatever it started with
        settled = clear or (log_ratio <= 0.0 and not self._moved and (not self._given or self._search_m > _TWINS_M))
        best_here = steady and (log_ratio < -self._params.search_margin or (settled and self._search_m > _SETTLED_M))
        calm = not self._moved and self._calm_m > _CALM_M and log_ratio < self._params.search_margin
        if best_here and doubted:  # scans fit like this here, until they fit better again
            self._usual, self._learnt_m = fit_during_search, _PRIOR_M
        elif self._learnt_m <= _PRIOR_M and clear:  # nowhere else do they fit as well
            self._usual = min(self._usual, max(self._fit, candidates.fit))
        contested = self._moved and log_ratio > -_CLEAR
        given = self._given
        if best_here or (not given and (calm or (log_ratio <= 0.0 and not doubted and not self._moved))):
            self._search = None
            self._moved = self._given = False
        found = (
            candidates.poses[0]
            if candidates.found and not here[0] and self.is_fit_for(candidates, points, on_map)
            else None
        )
        there = None if elsewhere is None else candidates.poses[elsewhere]
        return Verdict(self._fit, self._usual, log_ratio, doubted, found, candidates, there, contested, kept, given)

    def is_fit_for(self, candidates: Candidates, points: np.ndarray, on_map: bool = True) -> bool:
        """Scans fit at the best place as they did before, or no other comes near it.

        Where they fit worse, the map lacks a part of what there is to see: the right place may be none of the candidates.

        Args:
            candidates: the best of them first.
            points: (B, 2) end points [m] of the present scan, in the robot's frame.
            on_map: the map knows something where the beams end at the tracked pose; else the robot may have left it, and
                no lead over that pose counts.
        """
        fit = self._fit_at(points, candidates.poses[0])
        usual = fit is not None and fit >= self._usual - self._tolerance
        return usual or (on_map and candidates.lead > _POOR_LEAD * self._params.search_margin)

    def _is_off_map(
        self, dead_reckoning: Optional[DeadReckoning], points: np.ndarray, found: Optional[np.ndarray]
    ) -> bool:
        """Odometry leads off the map, where a scan may look like any place of it, and not to the place found (3,)."""
        if dead_reckoning is None or self._area is None or found is None:
            return False
        there = dead_reckoning.map_from_base
        unmapped = bool(self._area.is_unmapped(there[:2])) or self._fit_at(points, there) is None
        return unmapped and bool(dead_reckoning.mahalanobis(found[None])[0] >= _KEPT)

    def _fit_at(self, points: np.ndarray, map_from_base: np.ndarray) -> Optional[float]:
        """Fit of the points (B, 2) that end in mapped space, at a pose (3,); None: too few points."""
        known = points if self._area is None else points[self._area.ends(points, map_from_base[None])[0]]
        if len(known) < global_search.MIN_BEAMS:
            return None
        return float(global_search.fit(self._field, known, map_from_base[None])[0])

    def _learn(self, fit: float, step_m: float) -> None:
        """How well scans fit where the pose is right, and how much that varies."""
        self._recent.append((fit, step_m))
        self._recent_m += step_m
        while self._recent_m > _DELAY_M:
            fit, step_m = self._recent.popleft()
            self._recent_m -= step_m
            self._learnt_m = min(self._learnt_m + step_m, _LEARN_M)
            share = min(1.0, step_m / self._learnt_m)
            self._usual += share * (fit - self._usual)
            self._spread += share * (1.2533 * abs(fit - self._usual) - self._spread)  # mean deviation -> standard one

    def _distance(self, odom_from_base: np.ndarray) -> float:
        """Distance since the last scan [m]; a turn counts as the distance that brings as much into view."""
        before, self._odom_from_base = self._odom_from_base, np.array(odom_from_base, float)
        if before is None:
            return _FORGET_M
        step_m, turn_rad = se2.travelled(se2.compose(se2.inverse(before), odom_from_base))
        return max(step_m + 0.5 * turn_rad, _MIN_STEP_M)
