"""Global localization: finds the one place of the map where the scans fit, without an initial pose.

Multi-hypothesis tracking after an exhaustive search. The first scan is matched against every pose of the map
(place_search.py, in slices); each place where it fits becomes a candidate. Candidates move with odometry, are
registered to every scan within the limits of odometry, and gather evidence. From time to time a scan is matched
everywhere again, because the true place may have been missed (people, slipping wheels). A place is found when it
leads over all others by a margin. A prior over places can be given.

The formulation is ours. Evidence is the log likelihood of Thrun, Burgard, Fox, Probabilistic Robotics (2005), sec.
6.4, much flattened, because scans taken close to each other share their errors, and a changed map errs in all of
them. So evidence grows with the distance driven, not with the number of scans, and differences of decimetres
distinguish places. A particle filter finds a place only if a particle is near it; here every place is tried, and
places that look alike remain candidates until a scan tells them apart. K candidates, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Dict, Optional, Sequence, Tuple

import numpy as np

from glass_nav import _distance_field
from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import bearing_weights, pose_tracker, scan_alignment
from glass_nav.hypotheses.bearing_weights import BearingMixture
from glass_nav.hypotheses.place_search import PlaceSearch
from glass_nav.hypotheses.pose_tracker import PoseTracker
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.params import number
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea
from glass_nav.sensing.scan import Scan, one_of_each_piece, spread_evenly
from glass_nav.world.landmark_map import LandmarkMap

_BEAMS = 60
MIN_BEAMS = 10  # with fewer a scan is no evidence
_MAX_CANDIDATES = 1500  # that are followed
_EVIDENCE_SCALE_M = 0.2  # a beam that ends this far from a wall fits by one half
_UNKNOWN_FIT = 0.4  # of a beam that ends where the map knows nothing: likelier than in free space, less than at a wall
_MIN_KNOWN = 0.3  # of the beams of one scan must end where the map knows something: else it proposes no place
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

    def __init__(
        self, matcher: ScanMatcher, field: DistanceField, params: SearchParams, area: Optional[KnownArea] = None
    ) -> None:
        """
        Args:
            matcher: of the whole map or a part.
            field: of the map.
            params: when a place is accepted.
            area: where the map knows something; None: everywhere.
        """
        self._matcher, self._field, self._params, self._area = matcher, field, params, area
        self._tracker = PoseTracker(_MAX_BEHIND, _MAX_CANDIDATES)
        self._evidence = np.zeros(0)  # (K,) log likelihoods
        self._fit_sum = np.zeros(0)  # (K,) of fit times the share of a view
        self._views = np.zeros(0)  # (K,) of these shares
        self._since_judged = np.zeros(2)  # distance [m] and turn [rad] that odometry carried the candidates since
        self._places: Optional[PlaceSearch] = None  # while a scan is matched everywhere
        self._since_places = np.zeros(2)  # as above, since that scan; of the last one when it is complete
        self._searched = False  # one is complete
        self._driven_m = 0.0  # since the first scan
        self._counted_at_m: Dict[str, float] = {}  # id of a landmark -> distance driven when its bearing last counted

    def reconfigure(self, params: SearchParams) -> None:
        """Use other limits from the next scan on."""
        self._params = params

    def update(
        self,
        scan: Scan,
        odom_from_base: np.ndarray,
        bearings: Sequence[Tuple[LandmarkBearings, LandmarkMap]] = (),
        log_prior: Optional[Callable[[np.ndarray], np.ndarray]] = None,
        period_s: Optional[float] = None,
    ) -> Candidates:
        """Process a scan; one with too few returns only moves the candidates.

        Args:
            scan: one revolution of a lidar.
            odom_from_base: (3,) odometry at its stamp.
            bearings: from the robot's pose at the scan, each with the landmarks that they are of.
            log_prior: poses (K, 3) of the robot at this scan -> (K,) log likelihoods of what else is known of them.
            period_s: from one scan to the next; None: not known.
        """
        self._move(odom_from_base)
        points = evidence_points(scan)
        if points is not None:
            if self._searched and len(self._tracker):
                self._judge(points, self._view(scan))
            if self._places is None and (not self._searched or self._is_due(points)):
                # What is further behind, the best place beats by the whole margin in its first view.
                max_behind = self._params.search_margin / _FULL_FIT
                self._places = PlaceSearch(self._matcher, self._field, points, odom_from_base, max_behind)
                self._since_places = np.zeros(2)
            if self._places is not None and self._places.advance(period_s):
                self._take_in(self._places.places(odom_from_base), points)
        if self._searched:
            for taken, landmarks in bearings:
                self._weigh_by(taken, landmarks)
        return self._candidates(log_prior)

    def add(self, map_from_base: np.ndarray, head_start: float) -> None:
        """Add the tracked pose as a candidate, with a head start in log likelihood; before the first scan."""
        self._append(np.asarray(map_from_base, float)[None], np.array([head_start]))

    def correct(self, map_from_base: np.ndarray) -> None:
        """The best candidate in the place of a pose (3,) is there: a filter that follows this place knows it better."""
        here = pose_tracker.same_place(self._tracker.poses, map_from_base)
        if here.any():
            self._tracker.poses[int(np.argmax(np.where(here, self._evidence, -np.inf)))] = map_from_base

    def _move(self, odom_from_base: np.ndarray) -> None:
        """Move the candidates by odometry."""
        step = self._tracker.carry(odom_from_base)
        if step is not None:
            travelled = np.array(se2.travelled(step))
            self._since_judged = self._since_judged + travelled
            self._since_places = self._since_places + travelled
            self._driven_m += float(travelled[0])

    def _view(self, scan: Scan) -> float:
        """The share of the surroundings that came into view since the candidates were judged."""
        distance_m, turn_rad = self._since_judged
        # What a turn brings into view is what the lidar does not see already.
        unseen = max(0.0, 2.0 - float(np.ptp(scan.angles_rad)) / np.pi)
        return min(1.0, (distance_m + unseen * turn_rad) / _VIEW_M)

    def _judge(self, points: np.ndarray, view: float) -> None:
        """Align the candidates with the scan, as far as odometry allows, and add its evidence to each."""
        noise = _noise_of(self._since_judged)
        poses = self._tracker.poses
        moved = _aligned(self._field, points, poses, noise)
        off = (moved - poses) / noise
        off[:, 2] = angles.wrap(moved[:, 2] - poses[:, 2]) / noise[2]
        penalty = np.minimum(0.125 * np.sum(off**2, axis=1), _MAX_PENALTY)
        self._tracker.poses = moved
        fits = fit(self._field, points, moved, self._area)
        self._evidence = self._evidence + view * _FULL_FIT * fits - penalty
        self._fit_sum = self._fit_sum + view * fits
        self._views = self._views + view
        self._since_judged = np.zeros(2)
        self._keep_distinct()

    def _take_in(self, places: np.ndarray, points: np.ndarray) -> None:
        """Follow the places (N, 3), carried to this scan, of a search that is complete."""
        self._places = None
        if self._area is not None and len(places):
            known = np.mean(self._area.ends(points, places), axis=1)
            places = places[known >= _MIN_KNOWN]
        if not len(self._tracker) or not self._searched:
            self._searched = True
            self._append(places, np.zeros(len(places)))
            if len(self._tracker):
                self._judge(points, 1.0)
            return
        # Only one scan proposed them: they start behind the candidates so far, by how well each fits.
        places = _aligned(self._field, points, places, _noise_of(self._since_places))
        fits = fit(self._field, points, places, self._area)
        start = self._evidence.max() - self._params.search_margin
        self._append(places, start + _FULL_FIT * (fits - fits.max(initial=0.0)))
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

    def _is_due(self, points: np.ndarray) -> bool:
        """The last search is far behind, or the best candidate fits this scan worse than it used to."""
        if not len(self._tracker) or self._since_places[0] >= _SEARCH_AGAIN_M:
            return True
        best = int(np.argmax(self._evidence))
        fit_now = fit(self._field, points, self._tracker.poses[best : best + 1], self._area)[0]
        return bool(fit_now < _POOR_FIT * self._fit_sum[best] / max(self._views[best], 1e-9))

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

    def _candidates(self, log_prior: Optional[Callable[[np.ndarray], np.ndarray]]) -> Candidates:
        poses, scores = self._tracker.poses, self._evidence
        if not len(poses):
            return Candidates(poses, scores, float("nan"), 0.0, False)
        if log_prior is not None:
            scores = scores + log_prior(poses)
        order = np.argsort(-scores, kind="stable")
        best, poses, scores = order[0], poses[order], scores[order]
        weights = np.exp(scores - scores[0])
        lead = pose_tracker.lead(poses[0], scores[0], poses, scores)
        fit = float(self._fit_sum[best] / self._views[best]) if self._views[best] > 0.0 else float("nan")
        found = lead > self._params.search_margin and fit >= self._params.search_least_fit
        return Candidates(poses, weights / weights.sum(), fit, lead, bool(found))


def _noise_of(travelled: np.ndarray) -> np.ndarray:
    """(3,) deviations [m, m, rad] of odometry over a distance [m] and a turn [rad] (2,)."""
    return _STEP_NOISE @ np.array([1.0, *travelled])


def _aligned(field: DistanceField, points: np.ndarray, poses: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Poses (K, 3), moved to where the scan fits as far as such deviations (3,) allow."""
    information = np.diag(_BEAM_VARIANCE * len(points) / _BEAMS / noise**2)
    return scan_alignment.align_near(field, points, poses, information)


def evidence_points(scan: Scan) -> Optional[np.ndarray]:
    """(B, 2) end points [m], in the robot's frame, of the beams that are evidence; None: too few returned.

    They are on different pieces of surfaces. Most beams, taken by angle, end at the walls beside the robot, and those of a
    corridor look the same from everywhere in it.
    """
    if np.count_nonzero(scan.answered) < MIN_BEAMS:
        return None
    pieces = one_of_each_piece(scan)
    beams = (
        pieces[spread_evenly(np.ones(len(pieces)), _BEAMS)]
        if len(pieces) >= MIN_BEAMS
        else spread_evenly(scan.answered, _BEAMS)
    )
    return scan.points_in_base()[beams]


def fit(field: DistanceField, points_m: np.ndarray, poses: np.ndarray, area: Optional[KnownArea] = None) -> np.ndarray:
    """(K,) how well such points fit at poses (K, 3), 0..1; those that end outside of the known area hardly count.

    At a pose that the mapper did not see they do not count at all: nobody can tell whether a robot is there.
    """
    if area is None:
        return scan_alignment.fit(field, points_m, poses, _EVIDENCE_SCALE_M)
    return _distance_field.known_fit(field.compiled, area.compiled, points_m, poses, _EVIDENCE_SCALE_M, _UNKNOWN_FIT)
