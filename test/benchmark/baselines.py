"""Baseline localizers for comparison, each as good as we can make it.

Two sensor models, the likelihood field and the beam model, in two filters: plain Monte Carlo localization as in
AMCL (particles move by odometry only), and our own filter with only the weights replaced. And our
filter with less and with more knowledge of glass: only the beams classified as diffuse, and the true cases.

All have set_pose() and update() like Localizer. Every model gets what is known to help it: log probabilities
(AMCL multiplies or adds up cubes), surfaces half a cell inside the drawn walls, thinned beams, and the
settings of SETTINGS, the best of those that tune_baselines.py tries (glass_office, glass_bridge and glass_atrium, lidar
weak, seed 100, the first 150 scans). P particles, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Callable, Dict, NamedTuple, Optional, Tuple, Union

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.localization.particle_filter import motion, pose_estimate, resampling
from glass_nav.localization.beam_classification.beam_classifier import BeamClassifier
from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.document_localizer import DocumentLocalizer
from glass_nav.localization.localizer import Estimate, Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges
from glass_nav.localization.particle_filter.particle_filter import ParticleFilter
from glass_nav.localization.particle_filter.resampling import ParticleCount
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import BeamCase
from glass_nav.world.grid_map import GridMap

_PARTS = 4  # of a cell's edge: how finely the likelihood field is tabulated


class Settings(NamedTuple):
    """Settings of a sensor model; AMCL's names where it has them."""

    sigma_hit_m: float
    z_hit: float
    z_rand: float
    max_beams: Optional[int] = 60  # None: all that answered
    independent_beams: Optional[float] = None  # as how many they count; None: as many as they are
    z_short: float = 0.0  # of the beam model: something stood in the way
    lambda_short: float = 0.1  # [1/m]


class LikelihoodField:
    """Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 6.3: how near is a wall to where the beam ended?

    log of z_hit exp(-d^2 / (2 s^2)) + z_rand / z_max, as in AMCL, looked up in a table of quarters of cells.
    """

    def __init__(self, grid_map: GridMap, settings: Settings) -> None:
        self._settings = settings
        self._grid_from_map = se2.inverse(grid_map.map_from_grid)
        self._parts_per_m = _PARTS / grid_map.resolution_m
        rows, columns = (_PARTS * size for size in grid_map.occupancy.shape)
        points = se2.transform_points(
            grid_map.map_from_grid,
            np.stack(np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5), axis=-1) / self._parts_per_m,
        )
        distance_m = DistanceField(grid_map).at(points[..., 0], points[..., 1])[0]
        self._fit = np.exp(-0.5 * (distance_m / settings.sigma_hit_m) ** 2).astype(np.float32)
        self._log_p: Dict[float, np.ndarray] = {}  # by the range of the lidar

    def log_weights(self, map_from_base: np.ndarray, scan: Scan) -> np.ndarray:
        """(P,) log likelihoods of the scan at poses (P, 3)."""
        settings = self._settings
        if scan.range_max_m not in self._log_p:
            self._log_p[scan.range_max_m] = np.log(settings.z_hit * self._fit + settings.z_rand / scan.range_max_m)
        log_p = self._log_p[scan.range_max_m]
        beams = chosen_beams(scan, settings)
        grid_from_base = se2.compose(self._grid_from_map, map_from_base) * [self._parts_per_m, self._parts_per_m, 1.0]
        points = (scan.points_in_base()[beams] * self._parts_per_m).astype(np.float32)
        cos, sin = (value[:, None].astype(np.float32) for value in angles.cos_sin(grid_from_base[:, 2]))
        x, y = grid_from_base[:, :2].T.astype(np.float32)[..., None]
        column = (cos * points[:, 0] - sin * points[:, 1] + x).astype(np.int32)
        row = (sin * points[:, 0] + cos * points[:, 1] + y).astype(np.int32)
        np.clip(column, 0, log_p.shape[1] - 1, out=column)
        np.clip(row, 0, log_p.shape[0] - 1, out=row)
        row *= log_p.shape[1]
        row += column
        return weight_of_a_beam(len(beams), settings) * np.take(log_p, row).sum(axis=1, dtype=float)


class BeamModel:
    """Thrun et al. (2005), sec. 6.3.1: hit, unexpected obstacle, no answer, and a floor of random ranges.

    Beams without an answer weigh all particles alike and are left out.
    """

    def __init__(self, grid_map: GridMap, settings: Settings) -> None:
        self._settings = settings
        self._caster = RayCaster(grid_map)
        self._depth_m = 0.5 * grid_map.resolution_m  # a ray ends at the cell's boundary, a beam inside

    def log_weights(self, map_from_base: np.ndarray, scan: Scan) -> np.ndarray:
        """(P,) log likelihoods of the scan at poses (P, 3)."""
        settings = self._settings
        beams = chosen_beams(scan, settings)
        z = scan.ranges_m[beams]
        expected = (
            self._depth_m
            + self._caster.cast_first(
                se2.compose(map_from_base, scan.base_from_laser), scan.angles_rad[beams], scan.range_max_m
            ).range_m
        )
        normal = np.exp(-0.5 * np.minimum(((z - expected) / settings.sigma_hit_m) ** 2, 100.0))
        density = (
            settings.z_hit / (np.sqrt(2.0 * np.pi) * settings.sigma_hit_m) * normal + settings.z_rand / scan.range_max_m
        )
        if settings.z_short > 0.0:
            rate = settings.lambda_short
            density += np.where(
                z < expected,
                settings.z_short * rate * np.exp(-rate * z) / -np.expm1(-rate * np.minimum(expected, scan.range_max_m)),
                0.0,
            )
        return weight_of_a_beam(len(beams), settings) * np.log(density).sum(axis=1)


SensorModel = Union[LikelihoodField, BeamModel]


def chosen_beams(scan: Scan, settings: Settings) -> np.ndarray:
    """Indices of beams that answered, at most this many, spread evenly."""
    answered = np.flatnonzero(scan.answered)
    if settings.max_beams is None or len(answered) <= settings.max_beams:
        return answered
    return answered[np.linspace(0, len(answered) - 1, settings.max_beams).round().astype(int)]


def weight_of_a_beam(beams: int, settings: Settings) -> float:
    """Neighbouring beams have correlated errors; the more beams, the less each counts."""
    if settings.independent_beams is None:
        return 1.0
    return min(1.0, settings.independent_beams / max(beams, 1))


@dataclass(frozen=True)
class PlainEstimate:
    """The estimate of plain Monte Carlo localization after one scan."""

    stamp_ns: int
    map_from_base: np.ndarray  # (3,) pose of the best cluster


class PlainMcl:
    """Monte Carlo localization as in AMCL: odometry moves the particles, the scan weights them, KLD sets their number.

    Thrun et al. (2005), table 8.2 and sec. 8.3.7; resampling with every update, the update thresholds and the noise
    of odometry those of our filter.
    """

    def __init__(
        self,
        params: LocalizerParams,
        grid_map: GridMap,
        rng: np.random.Generator,
        model: SensorModel,
        count: ParticleCount = ParticleCount(min_particles=500, max_particles=5000),
    ) -> None:
        self._params, self._count, self._rng, self._model = params, count, rng, model
        self._particles = np.zeros((0, 3))
        self._odom_from_base: Optional[np.ndarray] = None
        self._map_from_odom = np.zeros(3)
        self._update_due = True

    def set_pose(self, map_from_base: np.ndarray, covariance: np.ndarray) -> None:
        """Start over around a pose (3,) with a covariance (3, 3)."""
        self._particles = self._rng.multivariate_normal(map_from_base, covariance, self._count.max_particles)
        self._odom_from_base = None

    def request_update(self) -> None:
        """The next scan is used even if the robot did not move."""
        self._update_due = True

    def update(self, scan: Scan, odom_from_base: np.ndarray) -> PlainEstimate:
        """One scan and the odometry (3,) at its stamp -> pose."""
        if self._is_due(odom_from_base):
            if self._odom_from_base is not None:
                step = se2.compose(se2.inverse(self._odom_from_base), odom_from_base)
                self._particles = motion.sample(self._particles, step, self._params.odometry, self._rng)
            weights = resampling.normalised(self._model.log_weights(self._particles, scan))
            best = pose_estimate.of(self._particles, weights)
            drawn = resampling.low_variance(weights, self._count.max_particles, self._rng)
            enough = resampling.enough_particles(self._particles[np.unique(drawn)], self._count)
            self._particles = self._particles[resampling.low_variance(weights, enough, self._rng)]
            self._map_from_odom = se2.compose(best.map_from_base, se2.inverse(odom_from_base))
            self._odom_from_base, self._update_due = np.array(odom_from_base, float), False
        return PlainEstimate(scan.stamp_ns, se2.compose(self._map_from_odom, odom_from_base))

    def _is_due(self, odom_from_base: np.ndarray) -> bool:
        if self._odom_from_base is None or self._update_due:
            return True
        way, turn = se2.travelled(se2.compose(se2.inverse(self._odom_from_base), odom_from_base))
        return way >= self._params.schedule.update_min_d or turn >= self._params.schedule.update_min_a


class OtherWeights(ParticleFilter):
    """Our whole filter, but another sensor model weights the particles."""

    def __init__(self, *ours: Any, model: SensorModel) -> None:
        super().__init__(*ours)
        self._model = model

    def _log_weights(self, scan: Scan, cases: BeamCases, classifier: BeamClassifier) -> np.ndarray:
        return self._model.log_weights(self.particles, scan)


class DiffuseOnly(BeamClassifier):
    """Our filter, using only the beams that it classifies as ended at the first surface."""

    def classify(self, scan: Scan, *pose: Any, **options: Any) -> Tuple[BeamCases, ExpectedRanges]:
        cases, expected = super().classify(scan, *pose, **options)
        diffuse = np.where(cases.case == BeamCase.DIFFUSE, cases.case, BeamCase.UNCERTAIN).astype(np.uint8)
        return replace(cases, case=diffuse), expected


class TrueCases(BeamClassifier):
    """Uses the true cases, which it is given."""

    true_case = np.zeros(0, np.uint8)

    def classify(self, scan: Scan, *pose: Any, **options: Any) -> Tuple[BeamCases, ExpectedRanges]:
        cases, expected = super().classify(scan, *pose, **options)
        case = np.where(scan.answered, self.true_case, BeamCase.UNCERTAIN).astype(np.uint8)
        return replace(cases, case=case), expected


class OracleCases(Localizer):
    """Our filter, using the true cases; set `true_case` (B,) before each update()."""

    _classifier: TrueCases

    def __init__(self, params: LocalizerParams, grid_map: GridMap, rng: np.random.Generator) -> None:
        super().__init__(params, grid_map, rng, classifier=TrueCases)

    def update(self, scan: Scan, odom_from_base: np.ndarray) -> Estimate:
        self._classifier.true_case = self.true_case
        return super().update(scan, odom_from_base)

    true_case = np.zeros(0, np.uint8)


SETTINGS = {
    "amcl_field60": Settings(sigma_hit_m=0.05, z_hit=0.5, z_rand=0.5, independent_beams=20.0),
    "amcl_field_all": Settings(sigma_hit_m=0.05, z_hit=0.5, z_rand=0.5, max_beams=None, independent_beams=40.0),
    "amcl_beam60": Settings(sigma_hit_m=0.05, z_hit=0.5, z_rand=0.5, independent_beams=20.0),
    "amcl_beam_all": Settings(sigma_hit_m=0.05, z_hit=0.5, z_rand=0.5, max_beams=None, independent_beams=40.0),
    "ours_field": Settings(sigma_hit_m=0.05, z_hit=0.5, z_rand=0.5, max_beams=None, independent_beams=120.0),
    "ours_beam": Settings(
        sigma_hit_m=0.05, z_hit=0.7, z_rand=0.2, max_beams=None, independent_beams=120.0, z_short=0.1
    ),
}

PoseFilter = Union[Localizer, DocumentLocalizer, PlainMcl]


def localizer(
    name: str, params: LocalizerParams, grid_map: GridMap, seed: int, settings: Optional[Settings] = None
) -> PoseFilter:
    """A new one of LOCALIZERS.

    Args:
        name: of LOCALIZERS.
        params: of our filter; the others take odometry, update thresholds and the rest from it.
        grid_map: where the robot is.
        seed: of its random numbers.
        settings: of the sensor model, in place of SETTINGS[name].
    """
    rng = np.random.default_rng(seed)
    if name in OURS:
        return OURS[name](params, grid_map, rng)
    chosen = SETTINGS[name] if settings is None else settings
    model: SensorModel = (LikelihoodField if "field" in name else BeamModel)(grid_map, chosen)
    if name.startswith("amcl"):
        return PlainMcl(params, grid_map, rng, model)
    return Localizer(params, grid_map, rng, particle_filter=partial(OtherWeights, model=model))


def _with_vote(mode: str) -> Callable[[LocalizerParams, GridMap, np.random.Generator], Localizer]:
    return lambda params, grid_map, rng: Localizer(
        replace(params, vote=replace(params.vote, vote_mode=mode)), grid_map, rng
    )


def _by_ranges(params: LocalizerParams, grid_map: GridMap, rng: np.random.Generator) -> Localizer:
    return Localizer(replace(params, mixture=replace(params.mixture, weight_mode="ranges")), grid_map, rng)


OURS: Dict[str, Callable[[LocalizerParams, GridMap, np.random.Generator], PoseFilter]] = {
    "ours": Localizer,
    "ours_paper": _with_vote("paper"),
    "ours_ranges": _by_ranges,
    "document": DocumentLocalizer,
    "ours_case1": partial(Localizer, classifier=DiffuseOnly),
    "ours_oracle": OracleCases,
}
LOCALIZERS = (*OURS, *SETTINGS)
BASELINES = ("ours_case1", *SETTINGS)  # honest: they know what a localizer can know; ours_oracle is given more
