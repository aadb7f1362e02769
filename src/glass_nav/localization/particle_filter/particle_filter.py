"""The particle filter: motion -> registration -> proposal -> weights -> resampling -> pose.

Thrun, Burgard, Fox, Probabilistic Robotics (2005), ch. 8, with a proposal distribution that uses the scan. P
particles, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import bearing_weights, scan_alignment
from glass_nav.hypotheses.bearing_weights import BearingMixture
from glass_nav.hypotheses.scan_alignment import Alignment
from glass_nav.localization.beam_classification.beam_classifier import BeamClassifier
from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.localization.particle_filter import (
    importance_weights,
    motion,
    pose_estimate,
    proposal,
    resampling,
    scan_registration,
)
from glass_nav.localization.particle_filter.importance_weights import BeamMixture
from glass_nav.localization.particle_filter.motion import OdometryNoise
from glass_nav.localization.particle_filter.odometry_prior import OdometryPrior
from glass_nav.localization.particle_filter.pose_estimate import PoseEstimate
from glass_nav.localization.particle_filter.proposal import Proposal
from glass_nav.localization.particle_filter.resampling import ParticleCount
from glass_nav.localization.particle_filter.scan_registration import ScanRegistration
from glass_nav.sensing import wall_backs
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import Scan, spread_evenly
from glass_nav.world.grid_map import GridMap
from glass_nav.world.landmark_map import LandmarkMap

ONE_PLACE = np.array([1.0, 1.0, 0.7])  # deviations [m, m, rad] that preliminary samples can cover
_MIN_ENDS = 20  # beams of known case that a registration is refined by
_MIN_TOLD = 10  # beams that tell whether a scan fits
_BLOCK = 2**15  # beams of particles weighed at a time
_SCALE_SIGMAS = 1.5  # of the kernel that aligns, in deviations of beams around walls
_FULL_FIT = 20.0  # log likelihood ratio of a scan that fits everywhere to one that fits nowhere


@dataclass(frozen=True)
class ParticleFilterParams:
    """How particles move, are drawn, weighed and counted, a struct per step."""

    count: ParticleCount
    odometry: OdometryNoise
    proposal: Proposal
    mixture: BeamMixture
    bearings: BearingMixture
    resample_interval: int = 1  # updates between resamplings
    selective_resampling: bool = False  # only when fewer than half of the particles count


@dataclass(frozen=True)
class Registration:
    """The pose at which the scan is classified, and those around which particles are drawn."""

    map_from_base: np.ndarray  # (3,) pose around which the beams are classified
    covariance: np.ndarray  # (3, 3) of it
    best: PoseEstimate  # cluster that odometry predicted
    alignment: Optional[Alignment]  # None: nothing to draw particles from
    beams: int  # that were aligned
    fits: bool  # as scans usually do: what is seen from there may be learnt
    contradicts_odometry: bool = False  # a wheel may have slipped
    worth: float = 0.0  # of the scan's fit there as evidence, 0..1; 0: it may be chance


class ParticleFilter:
    """Particles in one map; predict(), register() and weigh() in this order for every scan, then resample()."""

    def __init__(self, params: ParticleFilterParams, field: DistanceField, rng: np.random.Generator) -> None:
        """No particles yet: call one of the start functions.

        Args:
            params: of every step.
            field: of the map.
            rng: source of all randomness.
        """
        self._params, self._field, self._rng = params, field, rng
        self.particles = np.zeros((0, 3))  # (P, 3) poses in map
        self._weights = np.zeros(0)  # (P,) sum 1
        self.best: PoseEstimate  # cluster of the particles; once started
        self._register_anew()
        self._updates = 0

    def set_field(self, field: DistanceField) -> None:
        """Use the field of another map; the particles stay where they are."""
        self._field = field
        self._register_anew()

    def reconfigure(self, params: ParticleFilterParams) -> None:
        """Use other parameters from the next scan on; the particles stay."""
        self._params = params

    def _register_anew(self) -> None:
        self._registration = ScanRegistration(self._field)
        self.fits = True  # the last scan that was registered, about as well as scans usually do

    # -- starts

    def start_around(self, map_from_base: np.ndarray, deviations: np.ndarray) -> None:
        """Normal around a pose (3,).

        Args:
            map_from_base: (3,) the mean.
            deviations: (3,) standard ones [m, m, rad], or (3, 3) with one principal axis in each column.
        """
        noise = self._rng.standard_normal((self._params.count.max_particles, 3))
        offsets = noise @ deviations.T if deviations.ndim == 2 else noise * deviations
        particles = map_from_base + offsets
        particles[:, 2] = angles.wrap(particles[:, 2])
        self._start_with(particles)

    def start_in(self, grid_map: GridMap, area: np.ndarray) -> None:
        """Anywhere in the cells of area (H, W), with any heading."""
        rows, columns = np.nonzero(area)
        count = self._params.count.max_particles
        chosen = self._rng.integers(len(rows), size=count)
        inside = self._rng.uniform(-0.5, 0.5, (2, count))
        points = grid_map.centres(rows[chosen] + inside[0], columns[chosen] + inside[1])
        yaw = self._rng.uniform(-np.pi, np.pi, count)
        self._start_with(np.column_stack([points, yaw]))

    def _start_with(self, particles: np.ndarray) -> None:
        self.particles = particles
        self._weights = np.full(len(particles), 1.0 / len(particles))
        self.best = pose_estimate.of(particles, self._weights)
        self._register_anew()

    def stand_for(
        self, poses: np.ndarray, weights: np.ndarray, here: np.ndarray, covariance: np.ndarray, most: int
    ) -> None:
        """Draw the particles from candidates of a global search, best first.

        Args:
            poses, weights: (K, 3) candidates in map, and (K,) weights that sum to 1.
            here: (K,) bool: candidates in the place of the first.
            covariance: (3, 3) of all of them.
            most: particles to draw.
        """
        drawn = resampling.low_variance(weights, min(most, self._params.count.max_particles), self._rng)
        self.particles = poses[drawn]
        self._weights = np.full(len(drawn), 1.0 / len(drawn))
        self.best = PoseEstimate(poses[0], covariance, float(weights[here].sum()), here[drawn])

    # -- one scan

    @property
    def has_evidence(self) -> bool:
        """The last scan that was registered says something about where the robot is; else odometry carries the pose."""
        return self._registration.is_evidence

    def predict(self, step: np.ndarray) -> None:
        """Move all particles by a step (3,) of odometry, in the robot's frame before it.

        Without evidence they move as one: noise that no scan weighs would only lead their mean astray.
        """
        if not self.has_evidence:
            self.particles = se2.compose(self.particles, step)
            return
        self.particles = motion.sample(self.particles, step, self._params.odometry, self._rng)

    def move_to(self, map_from_base: np.ndarray) -> None:
        """Put all particles elsewhere as one, the best cluster's mean at a pose (3,)."""
        self.estimate()  # of the particles as they are, which may have been drawn anew
        self.particles = se2.compose(map_from_base, se2.compose(se2.inverse(self.best.map_from_base), self.particles))
        members = self.best.members
        _, covariance = pose_estimate.moments(
            self.particles[members], self._weights[members] / self._weights[members].sum()
        )
        self.best = replace(self.best, map_from_base=np.array(map_from_base), covariance=covariance)

    def weigh_by_bearings(self, bearings: LandmarkBearings, landmarks: LandmarkMap) -> None:
        """Bearings taken where the particles are now."""
        log_w = bearing_weights.log_weights(self.particles, bearings, landmarks, self._params.bearings)
        self._weights = resampling.tempered(np.log(self._weights) + log_w)

    def register(
        self,
        scan: Scan,
        odom_from_base: np.ndarray,
        classifier: BeamClassifier,
        covariance: Optional[np.ndarray] = None,
    ) -> Registration:
        """Align the scan from the best cluster; a cloud that is no single place is weighed by how the scan fits.

        Args:
            scan: one revolution of a lidar.
            odom_from_base: (3,) odometry at its stamp.
            classifier: of the map.
            covariance: (3, 3) of the pose that odometry led to; None: the spread of the particles.
        """
        self.fits = False
        best = pose_estimate.of(self.particles, self._weights)
        beams = spread_evenly(scan.answered, self._params.proposal.proposal_max_beams)
        beams = wall_backs.without(scan, beams, best.map_from_base, self._field, classifier.known_area)
        points = scan.points_in_base()[beams]
        if not len(beams):
            return Registration(best.map_from_base, best.covariance, best, None, 0, False)
        if not self._is_one_place(best):
            fit = scan_alignment.fit(self._field, points, self.particles)
            self._weights = resampling.normalised(np.log(self._weights) + _FULL_FIT * fit)
            best = pose_estimate.of(self.particles, self._weights)
            return Registration(best.map_from_base, best.covariance, best, None, 0, False)
        finder, residuals = self._registration, classifier.residuals
        scale_m = _SCALE_SIGMAS * residuals.sigma_m
        found = finder.find(best.map_from_base, best.covariance, odom_from_base, points, scale_m)
        if not finder.is_evidence:
            return Registration(best.map_from_base, np.zeros((3, 3)), best, None, 0, False)
        slip = self._params.proposal.odom_slip_probability if finder.contradicts_odometry else 0.0
        prior = OdometryPrior(best.map_from_base, best.covariance if covariance is None else covariance, slip)
        found = self._with_held(found, points, prior, residuals)
        worth = self._worth(points, found.poses[0], classifier.left_through_surfaces(scan, beams, found.poses[0]))
        self.fits = finder.fits and worth > 0.0
        return Registration(
            found.poses[0],
            np.zeros((3, 3)),
            best,
            found,
            len(beams),
            self.fits,
            finder.contradicts_odometry,
            worth,
        )

    def weigh(self, scan: Scan, cases: BeamCases, registration: Registration, classifier: BeamClassifier) -> None:
        """Draw particles where the scan fits, and weigh all of them by the beams whose case is known."""
        if registration.alignment is None:
            return
        residuals, shares = classifier.residuals, self._params.proposal
        if not registration.contradicts_odometry:
            shares = replace(shares, odom_slip_probability=0.0)
        aligned = self._refined(
            registration, scan.points_in_base()[importance_weights.known_ends(cases.case)], residuals
        )
        self.particles, log_ratio = proposal.draw(
            self.particles,
            self._weights,
            registration.best,
            aligned,
            self._beam_information(registration.beams, residuals),
            shares,
            self._rng,
        )
        self._weights = resampling.tempered(log_ratio + self._log_weights(scan, cases, classifier))

    @property
    def suspect(self) -> Optional[np.ndarray]:
        """(3,) map_from_odom of a place that a second scan has to confirm before the particles go there; or None."""
        return self._registration.suspect

    def estimate(self) -> None:
        """The best cluster of the weighed particles is the pose."""
        self.best = pose_estimate.of(self.particles, self._weights)

    def resample(self) -> None:
        """Draw as many particles as the spread of the cloud needs, where they are due."""
        if not self.has_evidence and not np.ptp(self._weights):  # nothing to choose between
            return
        self._updates += 1
        if self._updates % self._params.resample_interval:
            return
        if self._params.selective_resampling and 2.0 * resampling.effective_count(self._weights) > len(self._weights):
            return
        limits = self._params.count
        drawn = resampling.low_variance(self._weights, limits.max_particles, self._rng)
        count = resampling.enough_particles(self.particles[drawn], limits)
        self.particles = self.particles[resampling.low_variance(self._weights, count, self._rng)]
        self._weights = np.full(count, 1.0 / count)

    def _is_one_place(self, best: PoseEstimate) -> bool:
        """A cloud over a whole room is one cluster too, but no pose to align a scan from."""
        return best.share >= self._params.proposal.proposal_min_cluster_share and bool(
            np.all(np.sqrt(np.diag(best.covariance)) <= ONE_PLACE)
        )

    def _worth(self, points_m: np.ndarray, map_from_base: np.ndarray, left: np.ndarray) -> float:
        """Of the fit of points (B, 2) at a pose (3,); beams that left the map through its surfaces (B,) tell nothing."""
        told = points_m[~left]
        if len(told) < _MIN_TOLD:
            return 0.0
        return scan_registration.worth(float(scan_alignment.fit(self._field, told, map_from_base[None])[0]))

    def _with_held(
        self, found: Alignment, points_m: np.ndarray, prior: OdometryPrior, residuals: RangeResiduals
    ) -> Alignment:
        """The alignments (K) and the one that odometry holds back, K + 1; it comes first if it is the more probable one."""
        scale_m = _SCALE_SIGMAS * residuals.sigma_m
        poses = scan_alignment.align_near(
            self._field,
            points_m,
            prior.map_from_base[None],
            prior.information / self._beam_information(len(points_m), residuals),
            first_scale_m=2.0 * scale_m,
            last_scale_m=scale_m,
        )
        held = scan_alignment.at(self._field, points_m, poses, scale_m)
        near = max(float(held.fit[0]), float(scan_alignment.fit(self._field, points_m, prior.map_from_base[None])[0]))
        kept = prior.reaches(found.poses) | (found.fit >= scan_registration.least_fit_elsewhere(near))
        if not kept.any():
            return held
        found = Alignment(found.poses[kept], found.information[kept], found.fit[kept])
        both = np.concatenate([held.poses, found.poses[:1]])
        log_w = importance_weights.by_field(self._field, both, points_m, residuals, self._params.mixture)
        held_log_p, best_log_p = (log_w + prior.log_density(both)).tolist()
        at = 0 if held_log_p >= best_log_p else 1
        return Alignment(
            np.insert(found.poses, at, held.poses[0], axis=0),
            np.insert(found.information, at, held.information[0], axis=0),
            np.insert(found.fit, at, held.fit[0]),
        )

    def _beam_information(self, beams: int, residuals: RangeResiduals) -> float:
        """Information of one of so many beams, perpendicular to its wall [1/m2]."""
        independent = importance_weights.independent_beams(residuals, self._params.mixture)
        return min(1.0, independent / beams) / residuals.sigma_m**2

    def _refined(self, registration: Registration, ends_m: np.ndarray, residuals: RangeResiduals) -> Alignment:
        """The alignments once more, and from the predicted pose, by all beams that ended at a known surface.

        What stands unmapped behind glass may have drawn the first alignment away. The information stays that of the
        beams that were aligned first.
        """
        aligned, beams = registration.alignment, registration.beams
        assert aligned is not None
        if len(ends_m) < _MIN_ENDS:
            return aligned
        scale_m = residuals.sigma_m
        again = scan_alignment.align(
            self._field,
            ends_m,
            np.vstack([aligned.poses, registration.best.map_from_base]),
            iterations=4,
            first_scale_m=2.0 * scale_m,
            last_scale_m=scale_m,
        )
        found = scan_alignment.distinct(again)
        return Alignment(found.poses, found.information * beams / max(beams, len(ends_m)), found.fit)

    def _log_weights(self, scan: Scan, cases: BeamCases, classifier: BeamClassifier) -> np.ndarray:
        """(P,) log likelihoods of the scan."""
        mixture = self._params.mixture
        if mixture.weight_mode == "field":
            chosen = spread_evenly(importance_weights.known_ends(cases.case), mixture.laser_max_beams)
            ends_m = scan.points_in_base()[chosen]
            return importance_weights.by_field(self._field, self.particles, ends_m, classifier.residuals, mixture)
        chosen = spread_evenly(cases.case, mixture.laser_max_beams)
        together = max(1, _BLOCK // max(1, len(chosen)))  # particles: all of them times the beams would take gigabytes
        return np.concatenate(
            [
                importance_weights.by_ranges(
                    classifier.caster,
                    classifier.thickness_m,
                    se2.compose(self.particles[first : first + together], scan.base_from_laser),
                    scan.angles_rad[chosen],
                    scan.ranges_m[chosen],
                    cases.case[chosen],
                    classifier.residuals,
                    mixture,
                    scan.range_max_m,
                    classifier.max_glass_thickness_m,
                    classifier.min_linearity,
                )
                for first in range(0, len(self.particles), together)
            ]
        )
