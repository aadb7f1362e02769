"""Monte Carlo localization in buildings with glass: scan -> cases of the beams -> weights -> pose.

The filter of Thrun, Burgard, Fox, Probabilistic Robotics (2005), ch. 8, with the sensor model of the seed document
glass_localization.txt: each beam is first classified by what it met, then the particles are weighted by the beams
whose case is known.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Callable, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.hypotheses import pose_tracker
from glass_nav.hypotheses.global_search import GlobalSearch
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.localization import initial_pose, start_area
from glass_nav.localization.beam_classification.beam_classifier import BeamClassifier, BeamClassifierParams
from glass_nav.localization.beam_classification.beam_evidence import BeamEvidence
from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges
from glass_nav.localization.beam_classification.glass_map import GlassMap
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.localization.beam_classification.unmapped_panes import UnmappedPanes
from glass_nav.localization.beam_report import BeamReport
from glass_nav.localization.integrity import pose_state, protection_level
from glass_nav.localization.integrity.dead_reckoning import DeadReckoning
from glass_nav.localization.integrity.integrity_monitor import IntegrityMonitor
from glass_nav.localization.integrity.kidnap_detector import KidnapDetector, Verdict
from glass_nav.localization.integrity.protection_level import ProtectionLevels
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.particle_filter.particle_filter import ONE_PLACE, ParticleFilter, ParticleFilterParams
from glass_nav.localization.update_schedule import UpdateSchedule
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import GridMap
from glass_nav.world.landmark_map import LandmarkMap
from glass_nav.world.pane import Pane

_FOUND = np.array([0.1, 0.1, 0.05])  # deviations [m, m, rad] of a place that was found among all others
_ASTRAY = 3.0  # deviations of dead reckoning from which a pose that scans do not support is given up
_UNSURE_M = 0.5  # driven since the pose was sure, times the worth of a scan: then it no longer overrules odometry
_SHOWN = 500  # candidates drawn for particlecloud


@dataclass(frozen=True)
class Estimate:
    """The result of the filter after one scan."""

    stamp_ns: int
    map_from_base: np.ndarray  # (3,) pose of the best cluster
    covariance: np.ndarray  # (3, 3) of its error, x [m], y [m], yaw [rad]
    map_from_odom: np.ndarray  # (3,) what tf needs
    report_beams: Callable[[], BeamReport]  # by what the filter knows when it is called
    particles: np.ndarray  # (P, 3) poses in map
    state: LocalizationState
    reason: str  # the state in words
    updated: bool  # whether this scan moved the particles
    confidence: float  # chance that the pose is right, 0..1
    places: int = 1  # that are possible, see pose_state.Judgement
    levels: ProtectionLevels = protection_level.UNKNOWN  # how far off the pose may be

    @cached_property
    def report(self) -> BeamReport:
        """Report on the beams. Computed on first access, which must be before the next scan."""
        return self.report_beams()

    @property
    def cases(self) -> BeamCases:
        """Case of every beam of the scan."""
        return self.report.cases

    @property
    def surface_scan(self) -> SurfaceScan:
        """The scan in which glass is an obstacle."""
        return self.report.surface_scan

    @property
    def inlier_ratio(self) -> float:
        """Share of the beams that the map explains, of those that are evidence; NaN without any."""
        return self.report.inlier_ratio


class SeenBeams:
    """The beams of a scan from one pose."""

    def __init__(
        self,
        classifier: BeamClassifier,
        scan: Scan,
        map_from_base: np.ndarray,
        cases: BeamCases,
        expected: ExpectedRanges,
    ) -> None:
        """
        Args:
            classifier: of the map.
            scan: the scan.
            map_from_base: (3,) the pose.
            cases: of the beams, as classified from there or nearby.
            expected: from the pose, its sample 0.
        """
        self._classifier, self._scan, self._expected = classifier, scan, expected
        self._cases = classifier.seen_from(cases, scan, expected)
        self.evidence: BeamEvidence = classifier.evidence(scan, self._cases, expected, map_from_base)

    @classmethod
    def between(
        cls, classifier: BeamClassifier, scan: Scan, map_from_base: np.ndarray, covariance: np.ndarray
    ) -> SeenBeams:
        """The beams of a scan between two updates, from a pose (3,) with that covariance (3, 3)."""
        cases, expected = classifier.classify(scan, map_from_base, covariance, for_weights=False)
        return cls(classifier, scan, map_from_base, cases, expected)

    def report(self, trusted: bool) -> BeamReport:
        """Report on the beams; `trusted`: whether the pose is."""

        def cut() -> SurfaceScan:
            return self._classifier.surfaces(self._scan, self._cases, self._expected, trusted)

        return BeamReport(self._cases, self.evidence.inlier_ratio, cut)


class Localizer:
    """Tracks a pose with a particle filter, finds it with a global search, and notices when it is wrong."""

    def __init__(
        self,
        params: LocalizerParams,
        grid_map: GridMap,
        rng: np.random.Generator,
        classifier: Callable[[BeamClassifierParams, GridMap], BeamClassifier] = BeamClassifier,
        particle_filter: Callable[
            [ParticleFilterParams, DistanceField, np.random.Generator], ParticleFilter
        ] = ParticleFilter,
    ) -> None:
        """Starts with nothing known: call set_pose() or scatter() before update().

        Args:
            params: of every model.
            grid_map: where the robot is.
            rng: source of all randomness; the same seed and input give the same output.
            classifier, particle_filter: makers of the two, for those who compare others with them.
        """
        self._params = params
        self._new_classifier = classifier
        self._search: Optional[GlobalSearch] = None  # while the pose is not known
        field = DistanceField(grid_map)
        self._filter = particle_filter(params.particle_filter, field, rng)
        self._schedule = UpdateSchedule()
        self._quality = pose_state.PoseQuality(params.quality)
        self._map_from_odom = np.zeros(3)  # since the last update of the particles
        self._dead_reckoning: Optional[DeadReckoning] = None  # None: the pose has not been sure yet
        self._bearings: List[Tuple[LandmarkBearings, LandmarkMap, np.ndarray]] = []  # odom_from_base at their stamp
        self._look_at(grid_map, field)

    # -- where it is, and how it starts

    def set_map(self, grid_map: GridMap) -> None:
        """Use another map; the particles stay where they are. A search continues in the whole new map."""
        field = DistanceField(grid_map)
        self._filter.set_field(field)
        self._look_at(grid_map, field)
        if self._search is not None:
            self._search = self._new_search() if grid_map.free.any() else None
        elif len(self._filter.particles):
            self._integrity.start(self._filter.best.covariance)
        self._schedule.request()

    def _look_at(self, grid_map: GridMap, field: DistanceField) -> None:
        self._grid_map, self._field = grid_map, field
        # Made with the map: on a large one that takes longer than a scan may wait.
        self._everywhere = ScanMatcher(grid_map, field) if grid_map.free.any() else None
        self._classifier = self._new_classifier(self._params.classifier, grid_map)
        self._known_area = self._classifier.known_area
        self._panes = UnmappedPanes(grid_map, self._params.pane_use, self._params.panes)
        self._kidnap_detector = self._new_kidnap_detector()
        self._integrity = IntegrityMonitor(field, self._known_area)

    def reconfigure(self, params: LocalizerParams) -> None:
        """Use other parameters from the next scan on; particles, glass map and all that was learnt stay."""
        self._classifier.reconfigure(params.classifier)
        self._panes.reconfigure(params.pane_use)
        self._filter.reconfigure(params.particle_filter)
        self._quality.reconfigure(params.quality)
        self._kidnap_detector.reconfigure(params.search)
        if self._search is not None:
            self._search.reconfigure(params.search)
        self._params = params

    @property
    def field(self) -> DistanceField:
        """Distances to the walls of the map."""
        return self._field

    @property
    def glass_map(self) -> GlassMap:
        """Evidence since set_map() that each wall cell of the map is glass."""
        return self._classifier.glass_map

    @property
    def unmapped_panes(self) -> Tuple[Pane, ...]:
        """Panes that the map lacks, found since set_map() or remembered, that count as surfaces."""
        return self._panes.drawn

    @property
    def found_panes(self) -> Tuple[Pane, ...]:
        """All panes found, most probable first, including those below the limit."""
        return self._panes.candidates

    def remember(self, panes: Sequence[Pane], glass: Mapping[str, np.ndarray]) -> None:
        """Restore the found_panes and the glass map's arrays() of an earlier run on the same map.

        Raises:
            ValueError: the glass map is of another one; nothing is changed.
        """
        self.glass_map.restore(glass)
        self._panes = UnmappedPanes(self._grid_map, self._params.pane_use, self._params.panes, panes)
        self._draw_panes()

    def set_pose(self, map_from_base: np.ndarray, covariance: np.ndarray) -> None:
        """Start over around a pose.

        Args:
            map_from_base: (3,) x [m], y [m], yaw [rad].
            covariance: (3, 3) symmetric, not negative; 0 is allowed.

        Raises:
            ValueError: not finite, not symmetric, or negative; nothing is changed then.
        """
        pose, covariance, deviations = initial_pose.checked(map_from_base, covariance)
        self._filter.start_around(pose, deviations)
        self._schedule = UpdateSchedule()
        self._start_over()
        if np.any(np.sqrt(np.diag(covariance)) > ONE_PLACE):
            near = start_area.around(self._grid_map, pose[:2], covariance[:2, :2])
            self._search = self._new_search(near) if np.any(self._grid_map.free & near) else None
        if self._search is None:
            self._kidnap_detector = self._new_kidnap_detector(given=True)
            self._integrity.start(covariance)

    def scatter(self, area: Optional[np.ndarray] = None) -> None:
        """Start over anywhere in the free cells of the map (service global_localization), or of a part of it.

        Args:
            area: (N, 2) corners [m, in map] of a polygon; the robot is in it. None: anywhere.

        Raises:
            ValueError: the area is no polygon, or there is no free cell; nothing is changed then.
        """
        free = self._grid_map.free
        if area is not None:
            free = free & start_area.within(self._grid_map, area)
        if not free.any():
            raise ValueError(f"the {'map' if area is None else 'area'} has no free cell to put particles on")
        search = self._new_search(None if area is None else free)
        self._filter.start_in(self._grid_map, free)
        self._schedule = UpdateSchedule()
        self._start_over()
        self._search = search

    # -- what it is given

    def request_update(self) -> None:
        """The next scan of each lidar is used even if the robot did not move (service request_nomotion_update)."""
        self._schedule.request()

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
        """Process a scan and the odometry at its stamp.

        Args:
            scan: one revolution of a lidar.
            odom_from_base: (3,) odometry's pose at the scan's stamp.

        Raises:
            ScanError: the stamp runs backwards, or odometry is not finite; nothing is changed then.
            RuntimeError: neither set_pose() nor scatter() was called.
        """
        if not len(self._filter.particles):
            raise RuntimeError("update() needs set_pose() or scatter() first")
        scan = scan.limited(self._params.limits.laser_min_range, self._params.limits.laser_max_range)
        odom_from_base = self._schedule.admit(scan, odom_from_base)
        map_from_base = se2.compose(self._map_from_odom, odom_from_base)
        step = self._schedule.step_to(odom_from_base)
        due = self._schedule.is_due(scan.lidar, odom_from_base, self._params.schedule)
        if not due and self._integrity.fits(scan, map_from_base, step, self._params.odometry):
            if self._search is None and self._kidnap_detector.is_matching:  # a robot that stands is to know, too
                self._watch(scan, odom_from_base, map_from_base, step)
            return self._judged(scan, map_from_base, step)
        cases = self._track(scan, odom_from_base) if self._search is None else self._find(scan, odom_from_base)
        self._schedule.updated(scan.lidar, odom_from_base)
        self._map_from_odom = se2.compose(self._filter.best.map_from_base, se2.inverse(odom_from_base))
        map_from_base = se2.compose(self._map_from_odom, odom_from_base)
        expected = self._classifier.expected_at(scan, map_from_base)  # the beams were classified at the registered pose
        estimate = self._judged(
            scan, map_from_base, None, SeenBeams(self._classifier, scan, map_from_base, cases, expected)
        )
        self._look_for_panes(scan, estimate)
        return estimate

    # -- one update

    def _track(self, scan: Scan, odom_from_base: np.ndarray) -> BeamCases:
        """The particles follow the robot; if the scans say that it is elsewhere, they go there."""
        step = self._schedule.step_to(odom_from_base)
        if step is not None:
            self._filter.predict(step)
            if self._dead_reckoning is not None:
                self._dead_reckoning = self._reckoned(self._dead_reckoning, step)
        taken = self._bearings_from(odom_from_base)
        for bearings, landmarks in taken:
            self._filter.weigh_by_bearings(bearings, landmarks)
        cases = self._correct(scan, odom_from_base, step)
        if taken:
            self._integrity.narrow(self._filter.best.covariance)
        verdict = self._watch(scan, odom_from_base, self._filter.best.map_from_base, None)
        if verdict.found is not None:
            return self._settle(scan, odom_from_base, verdict.found, verdict.fit_there)
        return cases

    def _watch(
        self, scan: Scan, odom_from_base: np.ndarray, map_from_base: np.ndarray, step: Optional[np.ndarray]
    ) -> Verdict:
        """Check the tracked pose by the scan; `step` since the last update: None at an update."""
        reckoned = self._dead_reckoning
        if reckoned is not None and step is not None:
            reckoned = self._reckoned(reckoned, step)
        verdict = self._kidnap_detector.observe(scan, odom_from_base, map_from_base, reckoned, self._schedule.period_s)
        self._quality.doubt(verdict)
        return verdict

    def _correct(self, scan: Scan, odom_from_base: np.ndarray, step: Optional[np.ndarray]) -> BeamCases:
        """The scan draws and weighs the particles, and the best cluster of them is the pose."""
        carried = self._integrity.carried(step, self._params.odometry)
        registration = self._filter.register(scan, odom_from_base, self._classifier, carried)
        cases, expected = self._classifier.classify(scan, registration.map_from_base, registration.covariance)
        if registration.fits:
            self._classifier.learn(scan, expected, registration.map_from_base)
        self._filter.weigh(scan, cases, registration, self._classifier)
        self._filter.estimate()
        self._filter.resample()
        if registration.worth < 1.0:
            self._keep_to_odometry(step, registration.worth)
        suspect = self._filter.suspect
        held = self._integrity.update(
            scan,
            self._filter.best.map_from_base,
            step,
            self._params.odometry,
            registration.worth if registration.fits else 0.0,
            None if suspect is None else se2.compose(suspect, odom_from_base),
            registration.contradicts_odometry,
        )
        if not np.array_equal(held, self._filter.best.map_from_base):
            self._filter.move_to(held)
        return cases

    def _reckoned(self, reckoned: DeadReckoning, step: np.ndarray) -> DeadReckoning:
        """After a step, with the noise of odometry as the model says or as it proved, whichever is larger."""
        return reckoned.carried(step, self._params.odometry, np.maximum(self._integrity.noise_scale, 1.0))

    def _keep_to_odometry(self, step: Optional[np.ndarray], worth: float) -> None:
        """The scan hardly fits. If such scans led the pose astray, odometry has it back.

        Args:
            step: (3,) of odometry since the last update; None: there was none.
            worth: of the scan's fit as evidence, 0..1.
        """
        reckoned = self._dead_reckoning
        if reckoned is None or reckoned.distance_m - _length(step) < _UNSURE_M * worth - 1e-6:
            return
        off_map = bool(self._known_area.is_unmapped(reckoned.map_from_base[:2]))
        most = 0.0 if worth == 0.0 and off_map else _ASTRAY
        if reckoned.mahalanobis(self._filter.best.map_from_base[None])[0] > most:
            self._filter.move_to(reckoned.map_from_base)

    def _find(self, scan: Scan, odom_from_base: np.ndarray) -> BeamCases:
        """The pose is not known: follow all places where it may be. The particles are those places."""
        assert self._search is not None
        candidates = self._search.update(
            scan, odom_from_base, self._bearings_from(odom_from_base), period_s=self._schedule.period_s
        )
        self._quality.follow_search(candidates)
        if candidates.found:
            return self._settle(scan, odom_from_base, candidates.poses[0], candidates.fit)
        if len(candidates.poses):
            here = pose_tracker.same_place(candidates.poses, candidates.poses[0])
            self._filter.stand_for(candidates.poses, candidates.weights, here, candidates.covariance, _SHOWN)
        return self._classifier.classify(scan, self._filter.best.map_from_base, np.zeros((3, 3)))[0]

    def _settle(self, scan: Scan, odom_from_base: np.ndarray, map_from_base: np.ndarray, fit: float) -> BeamCases:
        """The robot is found at a pose where scans fit that well: go on from there, beginning with this scan."""
        self._filter.start_around(map_from_base, _FOUND)
        self._start_over(fit)
        self._integrity.start(np.diag(_FOUND**2))
        return self._correct(scan, odom_from_base, None)

    def _judged(
        self, scan: Scan, map_from_base: np.ndarray, step: Optional[np.ndarray], seen: Optional[SeenBeams] = None
    ) -> Estimate:
        """The pose with its state.

        Args:
            scan: the scan.
            map_from_base: (3,) the pose.
            step: (3,) of odometry since the last update; None: this scan was one.
            seen: from the pose, at an update; None: nothing depends on the beams, which wait until they are needed.
        """
        best, classifier = self._filter.best, self._classifier
        if seen is not None:
            judged = seen.evidence.without_crowd()
            self._quality.observe(judged.inlier_ratio, judged.judged_share)
        covariance = self._integrity.at(step, self._params.odometry, best.covariance)
        claimed = self._integrity.claimed_at(step, self._params.odometry, best.covariance)
        judgement = self._quality.judge(best, covariance)
        trusted = judgement.state == LocalizationState.LOCALIZED
        if seen is not None and trusted and self._filter.fits:
            self._dead_reckoning = DeadReckoning(map_from_base, covariance)

        def report_beams() -> BeamReport:
            return (seen or SeenBeams.between(classifier, scan, map_from_base, best.covariance)).report(trusted)

        return Estimate(
            scan.stamp_ns,
            map_from_base,
            claimed,
            self._map_from_odom,
            report_beams,
            self._filter.particles,
            judgement.state,
            judgement.reason,
            seen is not None,
            judgement.confidence,
            judgement.places,
            protection_level.of(map_from_base, covariance, 0.5 * self._grid_map.resolution_m),
        )

    def _look_for_panes(self, scan: Scan, estimate: Estimate) -> None:
        """Panes that the map lacks are surfaces from the next scan on."""
        trusted = estimate.state == LocalizationState.LOCALIZED
        if not trusted:
            return
        covariance = self._integrity.at(None, self._params.odometry, self._filter.best.covariance)
        if self._panes.observe(scan, estimate.map_from_base, covariance):
            self._draw_panes()

    def _draw_panes(self) -> None:
        self._classifier.redraw(self._panes.grid_map(), self._panes.drawn)

    def _bearings_from(self, odom_from_base: np.ndarray) -> List[Tuple[LandmarkBearings, LandmarkMap]]:
        """The bearings added since the last update, carried along by odometry to now; they are used once."""
        added, self._bearings = self._bearings, []
        return [
            (bearings.seen_from(bearings.stamp_ns, se2.compose(se2.inverse(odom_from_base), odom_from_then)), landmarks)
            for bearings, landmarks, odom_from_then in added
        ]

    # -- the search and the kidnap detector

    def _start_over(self, usual_fit: Optional[float] = None) -> None:
        """The particles were put elsewhere; usual_fit: of scans there, if it is known."""
        self._schedule.restart()
        self._integrity.stop()
        self._quality = pose_state.PoseQuality(self._params.quality)
        self._kidnap_detector = self._new_kidnap_detector(usual_fit)
        self._search = None
        self._dead_reckoning = None
        self._bearings = []

    def _new_search(self, area: Optional[np.ndarray] = None) -> GlobalSearch:
        """A search over the free cells of area (H, W), or all of them."""
        matcher = self._everywhere if area is None else ScanMatcher(self._grid_map, self._field, area)
        assert matcher is not None  # there are free cells
        return GlobalSearch(matcher, self._field, self._params.search, self._known_area)

    def _new_kidnap_detector(self, usual_fit: Optional[float] = None, given: bool = False) -> KidnapDetector:
        return KidnapDetector(self._field, self._everywhere, self._params.search, usual_fit, self._known_area, given)


def _length(step: Optional[np.ndarray]) -> float:
    """Distance [m] of a step (3,); None: there was none."""
    return 0.0 if step is None else se2.travelled(step)[0]
