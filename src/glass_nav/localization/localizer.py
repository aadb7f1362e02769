"""SCAN -> CASES -> WEIGHTS -> POSE: Monte Carlo localization that knows glass.

The filter of Thrun, Burgard, Fox, Probabilistic Robotics (2005), ch. 8, with the sensor model of the
seed document glass_localization.txt: decide beam by beam what the beam met, then weigh the particles by
the beams that are understood. Localizer.update() reads as the document does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Set, Tuple

import numpy as np

from glass_nav.geometry import angles, polygons, se2
from glass_nav.hypotheses import bearing_weights, global_search, scan_alignment
from glass_nav.hypotheses.global_search import GlobalSearch
from glass_nav.hypotheses.scan_alignment import Alignment
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.localization.beam_classification import (
    case_votes,
    expected_ranges,
    glass_map,
    preliminary_samples,
    surface_scan,
)
from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.expected_ranges import MIN_COS, ExpectedRanges
from glass_nav.localization.beam_classification.glass_map import GlassMap
from glass_nav.localization.beam_classification.preliminary_samples import PreliminarySamples
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.localization.integrity import pose_state
from glass_nav.localization.integrity.kidnap_detector import KidnapDetector
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.particle_filter import importance_weights, motion, pose_estimate, proposal, resampling
from glass_nav.localization.particle_filter.scan_registration import ScanRegistration
from glass_nav.localization.segments.segment_polish import SegmentPolish
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan, ScanError, spread_evenly
from glass_nav.sensing.wall_thickness import wall_thickness
from glass_nav.world.grid_map import GridMap
from glass_nav.world.landmark_map import LandmarkMap

_WIDEST_PLACE = np.array([1.0, 1.0, 0.7])  # deviations [m, m, rad] that preliminary samples can cover
_MIN_ENDS = 20  # of beams of known case that a pose is refined by
_NATS_OF_A_FULL_FIT = 20.0  # of log weight between a scan that fits nowhere and one that fits everywhere
_FOUND = np.array([0.1, 0.1, 0.05])  # deviations [m, m, rad] of a place that was found among all others
_SHOWN = 500  # candidates drawn for particlecloud
_FEWER = 2  # times fewer samples vote on a scan that moves no particle
_REACH = 3.5  # deviations of a given pose that are searched, where it is given vaguely


@dataclass(frozen=True)
class Estimate:
    """What the filter says after one scan."""

    stamp_ns: int
    map_from_base: np.ndarray  # (3,) pose of the best cluster
    covariance: np.ndarray  # (3, 3) of that cluster, x [m], y [m], yaw [rad]
    map_from_odom: np.ndarray  # (3,) what tf needs
    cases: BeamCases  # of every beam of the scan
    surface_scan: SurfaceScan  # the scan in which glass is an obstacle
    particles: np.ndarray  # (P, 3) poses in map
    state: str  # UNKNOWN, GLOBAL_SEARCH, LOCALIZED, UNCERTAIN, LOST
    reason: str  # the state in words
    used_share: float  # share of the answering beams that a case 1-4 explains
    updated: bool  # whether this scan moved the particles
    reliability: float  # chance that the pose is right, 0..1
    places: int = 1  # that are possible, see pose_quality.Judgement


class _MadeOnce:
    """The matcher over a whole map, made when it is needed first. Knows no filter, so that a filter that is given up
    leaves the memory at once and not with some later collection of cycles.
    """

    def __init__(self, grid_map: GridMap, field: DistanceField) -> None:
        self._grid_map, self._field = grid_map, field
        self._matcher: Optional[ScanMatcher] = None

    def __call__(self) -> ScanMatcher:
        if self._matcher is None:
            self._matcher = ScanMatcher(self._grid_map, self._field)
        return self._matcher


class Localizer:
    """Monte Carlo localization that decides beam by beam what the beam met."""

    def __init__(self, params: LocalizerParams, grid_map: GridMap, rng: np.random.Generator) -> None:
        """Starts with nothing known: call set_pose() or scatter() before update().

        Args:
            params: of every model.
            grid_map: where the robot is.
            rng: source of all randomness; the same seed and input give the same output.
        """
        self._params = params
        self._rng = rng
        self._search: Optional[GlobalSearch] = None  # while the pose is not known
        self.set_map(grid_map)
        self._particles = np.zeros((0, 3))
        self._weights = np.zeros(0)
        self._odom_from_base: Optional[np.ndarray] = None  # at that update
        self._best: pose_estimate.PoseEstimate  # once started
        self._map_from_odom = np.zeros(3)  # since the last update of the particles
        self._stamps_ns: Dict[str, int] = {}  # of the last scan of each lidar
        self._quality = pose_state.PoseQuality(params.quality)
        self._up_to_date: Set[str] = set()  # lidars that had an update since the robot moved
        self._updates = 0
        self._bearings: List[Tuple[LandmarkBearings, LandmarkMap, np.ndarray]] = []  # odom_from_base at their stamp

    def set_map(self, grid_map: GridMap) -> None:
        """Another map; the particles stay where they are. A search goes on in all of it."""
        self._grid_map = grid_map
        self._caster = RayCaster(grid_map, threads=self._params.schedule.raycast_threads)
        self._field = DistanceField(grid_map)
        self._thickness_m = wall_thickness(grid_map)
        self._anchor = ScanRegistration(self._field)
        self._everywhere = _MadeOnce(grid_map, self._field)
        self._watch = self._new_watch()
        if self._search is not None:
            self._search = self._new_search() if grid_map.free.any() else None
        self._residuals = RangeResiduals(0.5, self._params.mixture.laser_sigma_hit)
        self._glass_map = GlassMap(grid_map, self._params.glass)
        self._polish = SegmentPolish(grid_map) if self._params.polish.polish_with_segments else None
        self._up_to_date = set()

    def reconfigure(self, params: LocalizerParams) -> None:
        """Other parameters from the next scan on; the particles, the glass map and what the filter learnt stay."""
        if params.schedule.raycast_threads != self._params.schedule.raycast_threads:
            self._caster = RayCaster(self._grid_map, threads=params.schedule.raycast_threads)
        self._glass_map.weigh_by(params.glass)
        self._quality.limit_by(params.quality)
        self._watch.decide_by(params.search)
        if self._search is not None:
            self._search.decide_by(params.search)
        if not params.polish.polish_with_segments:
            self._polish = None
        elif self._polish is None:
            self._polish = SegmentPolish(self._grid_map)
        self._params = params

    @property
    def glass_map(self) -> GlassMap:
        """How glassy each wall cell of the map proved since set_map()."""
        return self._glass_map

    def set_pose(self, map_from_base: np.ndarray, covariance: np.ndarray) -> None:
        """Start over around a pose.

        Args:
            map_from_base: (3,) x [m], y [m], yaw [rad].
            covariance: (3, 3) symmetric, not negative; 0 is allowed.

        Raises:
            ValueError: not finite, not symmetric, or negative; nothing is changed then.
        """
        pose, covariance = np.array(map_from_base, float), np.array(covariance, float)
        if pose.shape != (3,) or not np.all(np.isfinite(pose)):
            raise ValueError(f"a pose needs finite x, y, yaw, got {map_from_base}")
        if covariance.shape != (3, 3) or not np.all(np.isfinite(covariance)):
            raise ValueError(f"a pose needs a finite covariance (3, 3), got {covariance.tolist()}")
        scale = max(float(np.abs(covariance).max()), 1e-12)
        if np.abs(covariance - covariance.T).max() > 1e-6 * scale:
            raise ValueError(f"the covariance of a pose must be symmetric, got {covariance.tolist()}")
        variance, axes = np.linalg.eigh(covariance)
        if variance.min() < -1e-6 * scale:
            raise ValueError(f"the covariance of a pose must not be negative, got {covariance.tolist()}")
        deviations = axes * np.sqrt(np.maximum(variance, 0.0))
        particles = pose + self._rng.standard_normal((self._params.count.max_particles, 3)) @ deviations.T
        particles[:, 2] = angles.wrap(particles[:, 2])
        self._start_with(particles)
        if np.any(np.sqrt(np.diag(covariance)) > _WIDEST_PLACE):
            near = self._near(pose[:2], covariance[:2, :2])
            self._search = self._new_search(near) if np.any(self._grid_map.free & near) else None

    def scatter(self, area: Optional[np.ndarray] = None) -> None:
        """Start over anywhere in the free cells of the map (service global_localization), or of a part of it.

        Args:
            area: (N, 2) corners [m, in map] of a polygon; the robot is in it. None: anywhere.

        Raises:
            ValueError: the area is no polygon, or there is no free cell; nothing is changed then.
        """
        free = self._grid_map.free if area is None else self._grid_map.free & self._within(area)
        if not free.any():
            raise ValueError(f"the {'map' if area is None else 'area'} has no free cell to put particles on")
        search = self._new_search(None if area is None else free)
        rows, columns = np.nonzero(free)
        count = self._params.count.max_particles
        chosen = self._rng.integers(len(rows), size=count)
        inside = self._rng.uniform(-0.5, 0.5, (2, count))
        points = self._grid_map.centres(rows[chosen] + inside[0], columns[chosen] + inside[1])
        yaw = self._rng.uniform(-np.pi, np.pi, count)
        self._start_with(np.column_stack([points, yaw]))
        self._search = search

    def request_update(self) -> None:
        """The next scan of each lidar is used even if the robot did not move (service request_nomotion_update)."""
        self._up_to_date = set()

    def add_bearings(self, bearings: LandmarkBearings, landmarks: LandmarkMap, odom_from_base: np.ndarray) -> None:
        """Evidence for the next update, which the next scan makes even if the robot does not move.

        Particles are weighed by it, and so are the places of a search once a scan was seen there.

        Args:
            bearings: to landmarks.
            landmarks: that they are of.
            odom_from_base: (3,) odometry's pose at the stamp of the bearings.

        Raises:
            UnknownLandmark, ValueError: an id that is not on the map, odometry that is not finite; nothing is changed.
        """
        landmarks.numbers(bearings.ids)
        odom_from_base = np.array(odom_from_base, float)
        if odom_from_base.shape != (3,) or not np.all(np.isfinite(odom_from_base)):
            raise ValueError(f"odometry of bearings must be finite x, y, yaw, got {odom_from_base}")
        self._bearings.append((bearings, landmarks, odom_from_base))
        self.request_update()

    def update(self, scan: Scan, odom_from_base: np.ndarray) -> Estimate:
        """One scan and the odometry at its stamp -> pose.

        Args:
            scan: a lidar's turn.
            odom_from_base: (3,) odometry's pose at the scan's stamp.

        Raises:
            ScanError: the stamp runs backwards, or odometry is not finite; nothing is changed then.
            RuntimeError: neither set_pose() nor scatter() was called.
        """
        scan = scan.limited(self._params.limits.laser_min_range, self._params.limits.laser_max_range)
        odom_from_base = self._checked(scan, odom_from_base)
        if not self._is_due(scan.lidar, odom_from_base):
            map_from_base = se2.compose(self._map_from_odom, odom_from_base)
            cases, references = self._vote(scan, map_from_base, self._best.covariance, self._few_samples())
            return self._estimate(scan, odom_from_base, cases, references)
        if self._search is not None:
            cases = self._seek(scan, odom_from_base)
        else:
            cases = self._track(scan, odom_from_base)
        self._map_from_odom = se2.compose(self._best.map_from_base, se2.inverse(odom_from_base))
        self._odom_from_base = odom_from_base
        self._up_to_date.add(scan.lidar)
        map_from_base = se2.compose(self._map_from_odom, odom_from_base)  # the vote was held at the aligned pose
        references = self._references(scan, map_from_base[None], 0.0)
        return self._estimate(scan, odom_from_base, cases, references, updated=True)

    def _track(self, scan: Scan, odom_from_base: np.ndarray) -> BeamCases:
        """The particles follow the robot; if the scans say that it is elsewhere, they go there."""
        predicted = self._predict(odom_from_base)
        for bearings, landmarks in self._bearings_from(odom_from_base):
            log_w = bearing_weights.log_weights(predicted, bearings, landmarks, self._params.bearings)
            self._weights = resampling.tempered(np.log(self._weights) + log_w)
        cases = self._place(scan, predicted, odom_from_base)
        verdict = self._watch.observe(scan, odom_from_base, self._best.map_from_base)
        self._quality.doubt(verdict)
        if verdict.found is not None:
            return self._settle(scan, odom_from_base, verdict.found, verdict.fit_there)
        return cases

    def _place(self, scan: Scan, predicted: np.ndarray, odom_from_base: np.ndarray) -> BeamCases:
        """The scan places the particles, and the best cluster of them is the pose."""
        cases = self._correct(scan, predicted, odom_from_base)
        self._best = pose_estimate.of(self._particles, self._weights)
        if self._polish is not None and self._is_one_place(self._best):
            ends_m = scan.points_in_base()[importance_weights.known_ends(cases.case)]
            self._best = replace(self._best, map_from_base=self._polish.pose(self._best, ends_m))
        self._resample()
        return cases

    def _seek(self, scan: Scan, odom_from_base: np.ndarray) -> BeamCases:
        """The pose is not known: follow all places where it may be. The particles are those places."""
        assert self._search is not None
        candidates = self._search.update(scan, odom_from_base, self._bearings_from(odom_from_base))
        self._quality.seek(candidates)
        if candidates.found:
            return self._settle(scan, odom_from_base, candidates.poses[0], candidates.fit)
        if len(candidates.poses):
            shown = min(_SHOWN, self._params.count.max_particles)
            drawn = resampling.low_variance(candidates.weights, shown, self._rng)
            self._particles = candidates.poses[drawn]
            self._weights = np.full(len(drawn), 1.0 / len(drawn))
            here = global_search.same_place(candidates.poses, candidates.poses[0])
            self._best = pose_estimate.PoseEstimate(
                candidates.poses[0], candidates.covariance, float(candidates.weights[here].sum()), here[drawn]
            )
        return self._vote(scan, self._best.map_from_base, np.zeros((3, 3)))[0]

    def _settle(self, scan: Scan, odom_from_base: np.ndarray, map_from_base: np.ndarray, fit: float) -> BeamCases:
        """The robot is found at a pose where scans fit that well: go on from there, beginning with this scan."""
        particles = map_from_base + self._rng.standard_normal((self._params.count.max_particles, 3)) * _FOUND
        particles[:, 2] = angles.wrap(particles[:, 2])
        stamps_ns = self._stamps_ns
        self._start_with(particles)
        self._stamps_ns = stamps_ns
        self._watch = self._new_watch(fit)
        return self._place(scan, particles, odom_from_base)

    def _new_search(self, area: Optional[np.ndarray] = None) -> GlobalSearch:
        """Over the free cells of area (H, W), or all of them."""
        matcher = self._everywhere() if area is None else ScanMatcher(self._grid_map, self._field, area)
        return GlobalSearch(matcher, self._field, self._params.search)

    def _new_watch(self, usual_fit: Optional[float] = None) -> KidnapDetector:
        matcher = self._everywhere if self._grid_map.free.any() else None
        return KidnapDetector(self._field, matcher, self._params.search, usual_fit)

    def _within(self, area: np.ndarray) -> np.ndarray:
        """(H, W) bool: cells with their centres in a polygon (N, 2)."""
        area = np.asarray(area, float)
        if area.ndim != 2 or area.shape[1] != 2 or len(area) < 3 or not np.all(np.isfinite(area)):
            raise ValueError(f"an area needs at least 3 corners of finite x, y, got {area.tolist()}")
        return polygons.inside(area, self._centres().reshape(-1, 2)).reshape(self._grid_map.occupancy.shape)

    def _centres(self) -> np.ndarray:
        """(H, W, 2) centres [m] of all cells, in map."""
        height, width = self._grid_map.occupancy.shape
        return self._grid_map.centres(*np.mgrid[:height, :width])

    def _near(self, point: np.ndarray, covariance: np.ndarray) -> np.ndarray:
        """(H, W) bool: cells within reach of a point (2,) that is known with that covariance (2, 2)."""
        off = self._centres() - point
        least = np.eye(2) * self._grid_map.resolution_m**2
        return np.einsum("hwi,ij,hwj->hw", off, np.linalg.inv(covariance + least), off) <= _REACH**2

    def _bearings_from(self, odom_from_base: np.ndarray) -> List[Tuple[LandmarkBearings, LandmarkMap]]:
        """The bearings added since the last update, carried along by odometry to now; they are used once."""
        added, self._bearings = self._bearings, []
        return [
            (bearings.seen_from(bearings.stamp_ns, se2.compose(se2.inverse(odom_from_base), odom_from_then)), landmarks)
            for bearings, landmarks, odom_from_then in added
        ]

    def _correct(self, scan: Scan, predicted: np.ndarray, odom_from_base: np.ndarray) -> BeamCases:
        """The scan places and weighs the particles, by the beams whose case is known."""
        self._particles = predicted
        best = pose_estimate.of(predicted, self._weights)
        beams = spread_evenly(scan.answered, self._params.proposal.proposal_max_beams)
        if not len(beams):
            return self._vote(scan, best.map_from_base, best.covariance)[0]
        points = scan.points_in_base()
        if not self._is_one_place(best):
            fit = scan_alignment.fit(self._field, points[beams], predicted)
            self._weights = resampling.normalised(np.log(self._weights) + _NATS_OF_A_FULL_FIT * fit)
            best = pose_estimate.of(predicted, self._weights)
            return self._vote(scan, best.map_from_base, best.covariance)[0]
        aligned = self._anchor.find(best.map_from_base, best.covariance, odom_from_base, points[beams])
        cases, references = self._vote(scan, aligned.poses[0], np.zeros((3, 3)))
        if self._anchor.fits:
            self._learn(scan, references)
        ends = importance_weights.known_ends(cases.case)
        aligned = self._refined(aligned, best.map_from_base, points[ends], len(beams))
        independent = importance_weights.independent_beams(self._residuals, self._params.mixture)
        beam_information = min(1.0, independent / len(beams)) / self._residuals.sigma_m**2
        self._particles, log_ratio = proposal.draw(
            predicted, self._weights, best, aligned, beam_information, self._params.proposal, self._rng
        )
        self._weights = resampling.tempered(log_ratio + self._log_weights(scan, self._particles, cases))
        return cases

    def _refined(self, aligned: Alignment, predicted: np.ndarray, points: np.ndarray, aligned_beams: int) -> Alignment:
        """The alignments once more, and from the predicted pose, by all beams that ended at a known surface.

        What stands unmapped behind glass may have drawn the first alignment away. Information is as of aligned_beams.
        """
        if len(points) < _MIN_ENDS:
            return aligned
        scale_m = self._residuals.sigma_m
        again = scan_alignment.align(
            self._field,
            points,
            np.vstack([aligned.poses, predicted]),
            iterations=4,
            first_scale_m=2.0 * scale_m,
            last_scale_m=scale_m,
        )
        found = scan_alignment.distinct(again)
        return Alignment(found.poses, found.information * aligned_beams / max(aligned_beams, len(points)), found.fit)

    def _is_one_place(self, best: pose_estimate.PoseEstimate) -> bool:
        """A cloud over a whole room is one cluster too, but no pose to align a scan from."""
        return best.share >= self._params.proposal.proposal_min_cluster_share and bool(
            np.all(np.sqrt(np.diag(best.covariance)) <= _WIDEST_PLACE)
        )

    def _checked(self, scan: Scan, odom_from_base: np.ndarray) -> np.ndarray:
        odom_from_base = np.array(odom_from_base, float)
        if not len(self._particles):
            raise RuntimeError("update() needs set_pose() or scatter() first")
        if odom_from_base.shape != (3,) or not np.all(np.isfinite(odom_from_base)):
            raise ScanError(f"odometry must be finite x, y, yaw, got {odom_from_base}", scan.stamp_ns)
        last_ns = self._stamps_ns.get(scan.lidar, scan.stamp_ns)
        if scan.stamp_ns < last_ns:
            raise ScanError(f"time runs backwards, the last scan was at {last_ns * 1e-9:.3f} s", scan.stamp_ns)
        self._stamps_ns[scan.lidar] = scan.stamp_ns
        return odom_from_base

    def _is_due(self, lidar: str, odom_from_base: np.ndarray) -> bool:
        """As in AMCL: after enough way or turn, each lidar has one update."""
        if self._odom_from_base is not None:
            way, turn = se2.travelled(se2.compose(se2.inverse(self._odom_from_base), odom_from_base))
            if way >= self._params.schedule.update_min_d or turn >= self._params.schedule.update_min_a:
                self._up_to_date = set()
        return lidar not in self._up_to_date

    def _predict(self, odom_from_base: np.ndarray) -> np.ndarray:
        if self._odom_from_base is None:  # the first scan: nothing to move from
            return self._particles
        step = se2.compose(se2.inverse(self._odom_from_base), odom_from_base)
        return motion.sample(self._particles, step, self._params.odometry, self._rng)

    def _few_samples(self) -> PreliminarySamples:
        """For a vote that no particle is weighed by, and nothing is learnt from."""
        samples = self._params.samples
        if self._params.vote.vote_mode == "paper":
            return samples
        return replace(samples, sample_count=-(-samples.sample_count // _FEWER))

    def _vote(
        self, scan: Scan, map_from_base: np.ndarray, covariance: np.ndarray, shape: Optional[PreliminarySamples] = None
    ) -> Tuple[BeamCases, ExpectedRanges]:
        """Cases of all beams, by preliminary samples around a pose; of another shape than the parameters say."""
        samples = preliminary_samples.around(map_from_base, covariance, shape or self._params.samples)
        behind_m = max(case_votes.reach_m(self._residuals, self._params.vote), glass_map.reach_m(self._residuals))
        references = self._references(scan, samples, behind_m)
        glass = self._glass_map.chances(references.cell[[0, 2], 0])
        return case_votes.classify(
            scan.ranges_m, references, self._residuals, self._params.vote, glass, scan.range_max_m
        ), references

    def _references(self, scan: Scan, samples: np.ndarray, behind_m: float) -> ExpectedRanges:
        vote = self._params.vote
        return expected_ranges.of(
            self._caster,
            self._thickness_m,
            samples,
            scan,
            vote.glass_max_thickness_m,
            vote.normal_min_linearity,
            behind_m,
        )

    def _learn(self, scan: Scan, references: ExpectedRanges) -> None:
        """Where beams end in walls, and which walls let them pass; references are of a pose that is believed."""
        mixture = self._params.mixture
        with np.errstate(invalid="ignore"):
            across = (scan.ranges_m - references.line_m[0]) * references.cos_incidence[0, 0] + references.face_m
        met = np.isfinite(across)
        self._residuals = self._residuals.learn(
            across[met], references.thickness_m[0, 0][met], mixture.laser_sigma_hit, mixture.laser_sigma_hit_max
        )
        self._glass_map.learn(*glass_map.crossings(scan.ranges_m, references, self._residuals))

    def _log_weights(self, scan: Scan, particles: np.ndarray, cases: BeamCases) -> np.ndarray:
        mixture, vote = self._params.mixture, self._params.vote
        if mixture.weight_mode == "field":
            chosen = spread_evenly(importance_weights.known_ends(cases.case), mixture.laser_max_beams)
            ends_m = scan.points_in_base()[chosen]
            return importance_weights.by_field(self._field, particles, ends_m, self._residuals, mixture)
        chosen = spread_evenly(cases.case, mixture.laser_max_beams)
        return importance_weights.by_ranges(
            self._caster,
            self._thickness_m,
            se2.compose(particles, scan.base_from_laser),
            scan.angles_rad[chosen],
            scan.ranges_m[chosen],
            cases.case[chosen],
            self._residuals,
            mixture,
            scan.range_max_m,
            vote.glass_max_thickness_m,
            vote.normal_min_linearity,
        )

    def _resample(self) -> None:
        self._updates += 1
        schedule = self._params.schedule
        if self._updates % schedule.resample_interval:
            return
        if schedule.selective_resampling and 2.0 * resampling.effective_count(self._weights) > len(self._weights):
            return
        limits = self._params.count
        drawn = resampling.low_variance(self._weights, limits.max_particles, self._rng)
        count = resampling.enough_particles(self._particles[np.unique(drawn)], limits)
        self._particles = self._particles[resampling.low_variance(self._weights, count, self._rng)]
        self._weights = np.full(count, 1.0 / count)

    def _estimate(
        self,
        scan: Scan,
        odom_from_base: np.ndarray,
        cases: BeamCases,
        references: ExpectedRanges,
        updated: bool = False,
    ) -> Estimate:
        """The pose of the best cluster, carried on by odometry since the last update; references are its."""
        map_from_base = se2.compose(self._map_from_odom, odom_from_base)
        cases = case_votes.as_seen_from(cases, scan.ranges_m, references, self._residuals, self._params.vote)
        answered = int(scan.answered.sum())
        used_share = float(np.count_nonzero(cases.case)) / answered if answered else float("nan")
        if updated:
            self._quality.observe(used_share)
        judgement = self._quality.judge(self._best)
        surfaces = self._surfaces(scan, cases, references, judgement.state == pose_state.LOCALIZED)
        return Estimate(
            scan.stamp_ns,
            map_from_base,
            self._best.covariance,
            self._map_from_odom,
            cases,
            surfaces,
            self._particles,
            judgement.state,
            judgement.reason,
            used_share,
            updated,
            judgement.reliability,
            judgement.places,
        )

    def _surfaces(self, scan: Scan, cases: BeamCases, references: ExpectedRanges, trusted: bool) -> SurfaceScan:
        """The scan cut at glass; references are of the pose that is told."""
        across = np.maximum(references.cos_incidence[0, 0], MIN_COS)
        gate_m = case_votes.gate_m(self._residuals, self._params.vote) / across
        return surface_scan.of(
            scan.ranges_m,
            cases.case,
            references,
            self._glass_map.chances(references.cell[0, 0]),
            gate_m,
            scan.range_max_m,
            trusted,
        )

    def _start_with(self, particles: np.ndarray) -> None:
        self._particles = particles
        self._weights = np.full(len(particles), 1.0 / len(particles))
        self._best = pose_estimate.of(particles, self._weights)
        self._odom_from_base = None
        self._stamps_ns = {}
        self._search = None
        self._bearings = []
        self._anchor = ScanRegistration(self._field)
        self._watch = self._new_watch()
        self._quality = pose_state.PoseQuality(self._params.quality)
        self._up_to_date = set()
