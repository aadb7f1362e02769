"""The algorithm of the glass document alone (`method: document`), for comparison with localizer.py.

Seed document glass_localization.txt, sec. III.A. Preliminary samples around the pose predicted by odometry vote for
one of the four expected ranges of each beam. The case with the most votes wins, whatever its share. Particles are
weighted by the ranges of these cases, cast from each particle. There is no scan registration, glass map, global
search or kidnap detector. What the document does not give (its text breaks off at step 1) is as in `vote_mode: paper`
and `weight_mode: ranges`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Mapping, Optional, Sequence, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.localization import initial_pose
from glass_nav.localization.beam_classification.beam_classifier import BeamClassifier
from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.glass_map import GlassMap
from glass_nav.localization.beam_report import BeamReport
from glass_nav.localization.integrity import protection_level
from glass_nav.localization.integrity.pose_state import PoseQuality
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.particle_filter import importance_weights, motion, pose_estimate, resampling
from glass_nav.localization.update_schedule import UpdateSchedule
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.sensing.scan import Scan, spread_evenly
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import GridMap
from glass_nav.world.landmark_map import LandmarkMap
from glass_nav.world.pane import Pane


class DocumentLocalizer:
    """Tracks a pose as the document does; what a Localizer can do beyond that is refused or left aside."""

    def __init__(self, params: LocalizerParams, grid_map: GridMap, rng: np.random.Generator) -> None:
        """Starts with nothing known: call set_pose() before update().

        Args:
            params: of every model; those of models that the document does not have are not used.
            grid_map: where the robot is.
            rng: source of all randomness.
        """
        self._params, self._rng = _plain(params), rng
        self._particles, self._weights = np.zeros((0, 3)), np.zeros(0)  # (P, 3) poses in map, (P,) sum 1
        self._map_from_odom = np.zeros(3)  # since the last update of the particles
        self._schedule = UpdateSchedule()
        self._quality = PoseQuality(params.quality)
        self._remembered: Tuple[Pane, ...] = ()
        self.set_map(grid_map)

    # -- where it is, and how it starts

    def set_map(self, grid_map: GridMap) -> None:
        """Use another map; the particles stay where they are."""
        self._resolution_m = grid_map.resolution_m
        self._classifier = BeamClassifier(self._params.classifier, grid_map)
        self._schedule.request()

    def reconfigure(self, params: LocalizerParams) -> None:
        """Use other parameters from the next scan on; the particles stay."""
        self._params = _plain(params)
        self._classifier.reconfigure(self._params.classifier)
        self._quality.reconfigure(params.quality)

    @property
    def glass_map(self) -> GlassMap:
        """Empty, or as it was remembered: the document learns no glass."""
        return self._classifier.glass_map

    @property
    def unmapped_panes(self) -> Tuple[Pane, ...]:
        """None: the document's map is complete."""
        return ()

    @property
    def found_panes(self) -> Tuple[Pane, ...]:
        """The panes that were restored."""
        return self._remembered

    def remember(self, panes: Sequence[Pane], glass: Mapping[str, np.ndarray]) -> None:
        """Keep what an earlier run found, for the one after this; see Localizer.remember()."""
        self.glass_map.restore(glass)
        self._remembered = tuple(panes)

    def set_pose(self, map_from_base: np.ndarray, covariance: np.ndarray) -> None:
        """Start over around a pose. For arguments and errors see Localizer.set_pose()."""
        pose, _, deviations = initial_pose.checked(map_from_base, covariance)
        count = self._params.count.max_particles
        noise = self._rng.standard_normal((count, 3))
        offsets = noise @ deviations.T if deviations.ndim == 2 else noise * deviations
        self._particles, self._weights = pose + offsets, np.full(count, 1.0 / count)
        self._schedule.restart()
        self._quality = PoseQuality(self._params.quality)

    def scatter(self, area: Optional[np.ndarray] = None) -> None:
        """The document only tracks a pose (its assumption i).

        Raises:
            ValueError: always.
        """
        raise ValueError("~method document only tracks a pose: give an initial pose, or set ~method default")

    # -- what it is given

    def request_update(self) -> None:
        """The next scan of each lidar is used even if the robot did not move."""
        self._schedule.request()

    def add_bearings(self, bearings: LandmarkBearings, landmarks: LandmarkMap, odom_from_base: np.ndarray) -> None:
        """Ignored: the document has no landmarks."""

    def update(self, scan: Scan, odom_from_base: np.ndarray) -> Estimate:
        """Process a scan and the odometry at its stamp. For arguments and errors see Localizer.update()."""
        if not len(self._particles):
            raise RuntimeError("update() needs set_pose() first")
        scan = scan.limited(self._params.limits.laser_min_range, self._params.limits.laser_max_range)
        odom_from_base = self._schedule.admit(scan, odom_from_base)
        step = self._schedule.step_to(odom_from_base)
        updated = self._schedule.is_due(scan.lidar, odom_from_base, self._params.schedule)
        if updated and step is not None:
            self._particles = motion.sample(self._particles, step, self._params.odometry, self._rng)
        spread = pose_estimate.of(self._particles, self._weights)
        predicted = spread.map_from_base if step is None else se2.compose(self._map_from_odom, odom_from_base)
        cases, _ = self._classifier.classify(scan, predicted, spread.covariance)
        if updated:
            self._weigh(scan, cases)
            self._schedule.updated(scan.lidar, odom_from_base)
            best = pose_estimate.of(self._particles, self._weights)
            self._map_from_odom = se2.compose(best.map_from_base, se2.inverse(odom_from_base))
        estimate = self._judged(scan, se2.compose(self._map_from_odom, odom_from_base), cases, updated)
        if updated:
            self._resample()
        return estimate

    # -- one update

    def _weigh(self, scan: Scan, cases: BeamCases) -> None:
        """Weight the particles by the beams of known case, against the range of that case from each particle."""
        chosen = spread_evenly(cases.case, self._params.mixture.laser_max_beams)
        log_w = importance_weights.by_ranges(
            self._classifier.caster,
            self._classifier.thickness_m,
            se2.compose(self._particles, scan.base_from_laser),
            scan.angles_rad[chosen],
            scan.ranges_m[chosen],
            cases.case[chosen],
            self._classifier.residuals,
            self._params.mixture,
            scan.range_max_m,
            self._classifier.max_glass_thickness_m,
            self._classifier.min_linearity,
        )
        self._weights = resampling.normalised(np.log(self._weights) + log_w)

    def _resample(self) -> None:
        limits = self._params.count
        drawn = resampling.low_variance(self._weights, limits.max_particles, self._rng)
        count = resampling.enough_particles(self._particles[drawn], limits)
        self._particles = self._particles[resampling.low_variance(self._weights, count, self._rng)]
        self._weights = np.full(count, 1.0 / count)

    def _judged(self, scan: Scan, map_from_base: np.ndarray, cases: BeamCases, updated: bool) -> Estimate:
        """The pose with its state, which no later scan depends on."""
        expected = self._classifier.expected_at(scan, map_from_base)
        evidence = self._classifier.evidence(scan, cases, expected, map_from_base)
        if updated:
            judged = evidence.without_crowd()
            self._quality.observe(judged.inlier_ratio, judged.judged_share)
        best = pose_estimate.of(self._particles, self._weights)
        judgement = self._quality.judge(best)
        trusted = judgement.state == LocalizationState.LOCALIZED
        report = BeamReport(
            cases, evidence.inlier_ratio, lambda: self._classifier.surfaces(scan, cases, expected, trusted)
        )
        return Estimate(
            scan.stamp_ns,
            map_from_base,
            best.covariance,
            self._map_from_odom,
            lambda: report,
            self._particles,
            judgement.state,
            judgement.reason,
            updated,
            judgement.confidence,
            judgement.places,
            protection_level.of(map_from_base, best.covariance, 0.5 * self._resolution_m),
        )


def _plain(params: LocalizerParams) -> LocalizerParams:
    """The parameters with the document's choices: the plain vote, no least share, ranges cast for every particle."""
    return replace(
        params,
        vote=replace(params.vote, vote_mode="paper", case_min_share=0.0),
        mixture=replace(params.mixture, weight_mode="ranges"),
    )
