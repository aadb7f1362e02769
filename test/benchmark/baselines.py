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

from dataclasses import replace
from functools import partial
from typing import Any, Callable, Dict, Optional, Tuple, Union

import numpy as np

from glass_nav.demo.plain_localization import (
    BEST_FIELD,
    LikelihoodField,
    PlainMcl,
    SensorModel,
    Settings,
    chosen_beams,
    weight_of_a_beam,
)
from glass_nav.geometry import se2
from glass_nav.localization.beam_classification.beam_classifier import BeamClassifier
from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.document_localizer import DocumentLocalizer
from glass_nav.localization.localizer import Estimate, Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges
from glass_nav.localization.particle_filter.particle_filter import ParticleFilter
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import BeamCase
from glass_nav.world.grid_map import GridMap


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
    "amcl_field60": BEST_FIELD,
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
