"""Scans, odometry -> the one place of the map where they fit, with no initial pose.

Multi-hypothesis tracking over an exhaustive search. The first scan is matched against every pose of the map
(scan_matcher.py); each place where it fits becomes a candidate. Odometry moves the candidates, every scan aligns them
as far as odometry allows, and each gathers evidence. From time to time a scan is matched everywhere again, because the
true place may have been missed (people, wheels that slipped). A place is found when all others are behind by a margin.

The formulation is ours. Evidence is the log likelihood of Thrun, Burgard, Fox, Probabilistic Robotics (2005), sec. 6.4,
much flattened: scans taken close to each other have the same errors, and so has a map that has changed since.
Therefore evidence grows with the distance driven, not with the number of scans, and it distinguishes places
by differences of decimetres. A particle filter finds a place only if a particle falls near it; here every place is tried,
and places that look alike remain candidates until a scan distinguishes them. K candidates, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Optional, Sequence, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import bearing_weights, pose_tracker, scan_alignment
from glass_nav.hypotheses.bearing_weights import BearingMixture
from glass_nav.hypotheses.pose_tracker import PoseTracker
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.params import number
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import Scan, spread_evenly
from glass_nav.world.landmark_map import LandmarkMap

_BEAMS = 60
_MIN_BEAMS = 10  # with fewer a scan is no evidence
_PLACES = 4000  # of an exhaustive search, before they are aligned
_SLIDE_M = 0.6  # that an alignment may move a match
_MAX_CANDIDATES = 1500  # that are followed
_EVIDENCE_SCALE_M = 0.2  # a beam that ends this far from a wall fits by one half
_FULL_FIT = 20.0  # log likelihood ratio of a place where all beams end on walls to one where none does, in one view
_VIEW_M = 2.0  # after this distance the surroundings are seen anew
_MAX_BEHIND = 40.0  # log likelihood ratio of the best candidate to one that is dropped
_SEARCH_AGAIN_M = 2.0
_POOR_FIT = 0.75  # of the best candidate's usual fit: it may be wrong, search again at once
_STEP_NOISE = np.array(
    [
        [0.03, 0.1, 0.0],  # deviations of odometry: a base, per metre, per radian of the step
        [0.03, 0.1, 0.0],  # (x, y [m]; yaw [rad])
        [0.02, 0.03, 0.1],
    ]
)
_BEAM_VARIANCE = 0.03  # [m2] of a beam of 60 that are worth 20 independent ones of 0.1 m
_MAX_PENALTY = 1.0  # of log likelihood for a step that odometry does not explain: wheels slip
# Flat: candidates are right to decimetres, and one bearing, which adds 5.4 at most, may be a mirror's: it needs a second.
_BEARINGS = BearingMixture(bearing_wrong_share=0.1, bearing_sigma_floor=0.1)


@dataclass(frozen=True)
class SearchParams:
    """When a place is accepted as found."""

    search_margin: float = number(8.0, 0.0, 1000.0)  # log likelihood ratio of the place to all others
    search_least_fit: float = number(0.5, 0.0, 1.0)  # scan fit at the place, mean since it is followed, 0..1
    recover_when_lost: bool = True  # search everywhere when the scans contradict the pose

    def __post_init__(self) -> None:
        if not 0.0 < self.search_margin < np.inf:
            raise ValueError(f"~search_margin must be finite and > 0, got {self.search_margin}")
        if not 0.0 <= self.search_least_fit <= 1.0:
            raise ValueError(f"~search_least_fit must be in [0, 1], got {self.search_least_fit}")


@dataclass(frozen=True)
class Candidates:
    """Poses that are still possible, the best first."""

    poses: np.ndarray  # (K, 3) map_from_base at the last scan
    weights: np.ndarray  # (K,) sum 1
    fit: float  # mean fit of the best since it is followed, 0..1; NaN: no scan has been evidence yet
    lead: float  # log likelihood ratio of the best to its best rival; inf: it has none
    found: bool  # the robot is at the best

    @property
    def covariance(self) -> np.ndarray:
        """(3, 3) over x [m], y [m], yaw [rad] of all of them, around the best."""
        off = self.poses - self.poses[0]
        off[:, 2] = angles.wrap(off[:, 2])
        return (off * self.weights[:, None]).T @ off


class GlobalSearch:
    """Follows all candidates until one is far ahead."""

    def __init__(self, matcher: ScanMatcher, field: DistanceField, params: SearchParams) -> None:
        """
        Args:
            matcher: of the whole map or a part.
            field: of the map.
            params: when a place is accepted.
        """
        self._matcher, self._field, self._params = matcher, field, params
        self._tracker = PoseTracker(_MAX_BEHIND, _MAX_CANDIDATES)
        self._evidence = np.zeros(0)  # (K,) log likelihoods
        self._fit_sum = np.zeros(0)  # (K,) of fit times the share of a view
        self._views = np.zeros(0)  # (K,) of these shares
        self._noise = _STEP_NOISE[:, 0]  # (3,) deviations of the last step
        self._searched = False
        self._since_search_m = 0.0  # distance since the last search everywhere
        self._driven_m = 0.0  # since the first scan
        self._counted_at_m: Dict[str, float] = {}  # id of a landmark -> distance driven when its bearing last counted

    def decide_by(self, params: SearchParams) -> None:
        """Other limits from the next scan on."""
        self._params = params

    def update(
        self, scan: Scan, odom_from_base: np.ndarray, bearings: Sequence[Tuple[LandmarkBearings, LandmarkMap]] = ()
    ) -> Candidates:
        """One more scan; a scan with too few returns only moves the candidates.

        Args:
            scan: one revolution of a lidar.
            odom_from_base: (3,) odometry at its stamp.
            bearings: from the robot's pose at the scan, each with the landmarks that they are of.
        """
        view = self._move(scan, odom_from_base)
        points = evidence_points(scan)
        if points is not None:
            if not self._searched:
                found = self._search_everywhere(points)
                self._append(found, np.zeros(len(found)))
                view = 1.0
            self._judge(points, view)
            if self._since_search_m >= _SEARCH_AGAIN_M or self._best_fits_poorly(points):
                found = self._search_everywhere(points)
                # Only this scan proposes them: they start behind the candidates so far, by how well each fits.
                fits = fit(self._field, points, found)
                start = self._evidence.max() - self._params.search_margin
                self._append(found, start + _FULL_FIT * (fits - fits.max()))
                self._keep_distinct()
        if len(self._tracker):  # there are none before a scan proposes them
            for taken, landmarks in bearings:
                self._weigh_by(taken, landmarks)
        return self._candidates()

    def add(self, map_from_base: np.ndarray, head_start: float) -> None:
        """Before the first scan: a candidate at the tracked pose, with a head start of log likelihood."""
        self._append(np.asarray(map_from_base, float)[None], np.array([head_start]))

    def _move(self, scan: Scan, odom_from_base: np.ndarray) -> float:
        """Move the candidates by odometry; the share of a new view that this step gave."""
        step = self._tracker.carry(odom_from_base)
        if step is None:
            return 1.0
        distance_m, turn_rad = se2.travelled(step)
        self._since_search_m += distance_m
        self._driven_m += distance_m
        self._noise = _STEP_NOISE @ np.array([1.0, distance_m, turn_rad])
        # What a turn brings into view is what the lidar does not see already.
        unseen = max(0.0, 2.0 - float(np.ptp(scan.angles_rad)) / np.pi)
        return min(1.0, (distance_m + unseen * turn_rad) / _VIEW_M)

    def _judge(self, points: np.ndarray, view: float) -> None:
        """Align the candidates with the scan, as far as odometry allows, and add its evidence to each."""
        information = np.diag(_BEAM_VARIANCE * len(points) / _BEAMS / self._noise**2)
        poses = self._tracker.poses
        moved = scan_alignment.align_near(self._field, points, poses, information)
        off = (moved - poses) / self._noise
        off[:, 2] = angles.wrap(moved[:, 2] - poses[:, 2]) / self._noise[2]
        penalty = np.minimum(0.125 * np.sum(off**2, axis=1), _MAX_PENALTY)
        self._tracker.poses = moved
        fits = fit(self._field, points, moved)
        self._evidence = self._evidence + view * _FULL_FIT * fits - penalty
        self._fit_sum = self._fit_sum + view * fits
        self._views = self._views + view
        self._keep_distinct()

    def _weigh_by(self, bearings: LandmarkBearings, landmarks: LandmarkMap) -> None:
        """Add the evidence of bearings, of each landmark once in a view: a mirror stays where it is."""
        new = np.array(
            [self._driven_m - self._counted_at_m.get(name, -_VIEW_M) >= _VIEW_M for name in bearings.ids], bool
        )
        bearings = bearings.subset(new)
        self._counted_at_m.update(dict.fromkeys(bearings.ids, self._driven_m))
        self._evidence = self._evidence + bearing_weights.log_weights(
            self._tracker.poses, bearings, landmarks, _BEARINGS
        )
        self._keep_distinct()

    def _best_fits_poorly(self, points: np.ndarray) -> bool:
        best = int(np.argmax(self._evidence))
        fit_now = fit(self._field, points, self._tracker.poses[best : best + 1])[0]
        return bool(fit_now < _POOR_FIT * self._fit_sum[best] / max(self._views[best], 1e-9))

    def _search_everywhere(self, points: np.ndarray) -> np.ndarray:
        """(K, 3) poses where this scan fits, the best first, each place once."""
        self._searched, self._since_search_m = True, 0.0
        starts = self._matcher.search(points, _PLACES).poses
        places = scan_alignment.align(self._field, points, starts)
        near = np.hypot(*(places.poses[:, :2] - starts[:, :2]).T) < _SLIDE_M  # farther away it is another place
        poses = places.poses[near][np.argsort(-places.fit[near], kind="stable")]
        return poses[pose_tracker.first_of_each_cell(poses)]

    def _append(self, poses: np.ndarray, evidence: np.ndarray) -> None:
        nothing = np.zeros(len(poses))
        self._tracker.add(poses)
        self._evidence = np.concatenate([self._evidence, evidence])
        self._fit_sum = np.concatenate([self._fit_sum, nothing])
        self._views = np.concatenate([self._views, nothing])

    def _keep_distinct(self) -> None:
        chosen = self._tracker.keep_distinct(self._evidence)
        self._evidence = self._evidence[chosen]
        self._fit_sum, self._views = self._fit_sum[chosen], self._views[chosen]

    def _candidates(self) -> Candidates:
        poses = self._tracker.poses
        if not len(poses):
            return Candidates(poses, self._evidence, float("nan"), 0.0, False)
        weights = np.exp(self._evidence - self._evidence[0])
        lead = pose_tracker.lead(poses[0], self._evidence[0], poses, self._evidence)
        fit = float(self._fit_sum[0] / self._views[0]) if self._views[0] > 0.0 else float("nan")
        found = lead > self._params.search_margin and fit >= self._params.search_least_fit
        return Candidates(poses, weights / weights.sum(), fit, lead, bool(found))


def evidence_points(scan: Scan) -> Optional[np.ndarray]:
    """(B, 2) end points [m], in the robot's frame, of the beams that are evidence; None: too few returned."""
    beams = spread_evenly(scan.answered, _BEAMS)
    return scan.points_in_base()[beams] if len(beams) >= _MIN_BEAMS else None


def fit(field: DistanceField, points_m: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """(K,) how well such points fit at poses (K, 3), 0..1."""
    return scan_alignment.fit(field, points_m, poses, _EVIDENCE_SCALE_M)
