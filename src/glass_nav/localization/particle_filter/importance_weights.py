"""Weights of the particles: how well each explains the scan, by the beams whose case is known.

Two modes. "ranges" is the document's (seed glass_localization.txt; Thrun et al. (2005), sec. 6.3.1): the sum over
beams with case c > 0 of log(z_hit exp(-r^2 / (2 s^2)) + z_rand), where r is the difference to the expected range of
case c, cast from the particle and measured perpendicular to the surface. In "field", r is the distance of the beam's
end point from the nearest wall, and only the cases that end at a wall count (1, 3 and 4). This needs no ray casts, so
all beams can be used. Mirrored and uncertain beams, which mislead a plain likelihood field among glass, have no
effect. Errors of neighbouring beams are correlated, so all beams together count as laser_independent_beams. P
particles, B beams; weights are natural logarithms, not normalised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.localization.beam_classification.expected_ranges import MIN_COS, cos_incidence
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.params import choice, number
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.vocabulary import BeamCase

WEIGHT_MODES = ("field", "ranges")


@dataclass(frozen=True)
class BeamMixture:
    """How often a beam ends where its case says, and how sharply; AMCL's names where it has them."""

    weight_mode: str = choice("field", WEIGHT_MODES)
    laser_max_beams: int = number(720, 2, 10_000)
    laser_z_hit: float = number(0.95, 0.0, 100.0)
    laser_z_rand: float = number(0.05, 0.0, 100.0)
    laser_sigma_hit: float = number(0.04, 0.0, 10.0)  # [m] across the surface, lidar and map together; at least
    laser_sigma_hit_max: float = number(0.2, 0.0, 10.0)  # [m] at most: the filter learns how well map and lidar agree
    laser_independent_beams: float = number(80.0, 0.0, 1e4)

    def __post_init__(self) -> None:
        if self.weight_mode not in WEIGHT_MODES:
            raise ValueError(f"~weight_mode must be one of {', '.join(WEIGHT_MODES)}, got {self.weight_mode!r}")
        if not self.laser_max_beams >= 2:
            raise ValueError(f"~laser_max_beams must be >= 2, got {self.laser_max_beams}")
        for name in ("laser_z_hit", "laser_z_rand", "laser_sigma_hit", "laser_independent_beams"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"~{name} must be > 0, got {getattr(self, name)}")
        if not self.laser_sigma_hit_max >= self.laser_sigma_hit:
            raise ValueError(
                f"~laser_sigma_hit_max must be >= ~laser_sigma_hit = {self.laser_sigma_hit}, "
                f"got {self.laser_sigma_hit_max}"
            )


def by_ranges(
    caster: RayCaster,
    thickness_m: np.ndarray,
    map_from_laser: np.ndarray,
    angles_rad: np.ndarray,
    measured_m: np.ndarray,
    case: np.ndarray,
    residuals: RangeResiduals,
    mixture: BeamMixture,
    max_range_m: float,
    max_thickness_m: float,
    min_linearity: float,
) -> np.ndarray:
    """Log likelihood of the chosen beams for every particle.

    Args:
        caster: of the map.
        thickness_m: (H * W,) of the map's walls, sensing/wall_thickness.py.
        map_from_laser: (P, 3) the lidar's pose for every particle.
        angles_rad, measured_m, case: (B,) the beams to use, all of case > 0 with finite ranges.
        residuals: where in a wall beams end, and how widely.
        mixture: how sharply.
        max_range_m: how far to look.
        max_thickness_m, min_linearity: as for the expected ranges of the cases.

    Returns:
        (P,) log likelihoods; all 0 if there is no beam.
    """
    log_w = np.zeros(len(map_from_laser))
    if not len(case):
        return log_w
    for chosen in (case == BeamCase.DIFFUSE, case != BeamCase.DIFFUSE):
        if not chosen.any():
            continue
        angle, z = angles_rad[chosen], measured_m[chosen]
        if case[chosen][0] == BeamCase.DIFFUSE:
            hits = caster.cast_first(map_from_laser, angle, max_range_m)
            expected, cell = hits.range_m, hits.cell
        else:
            surfaces = caster.cast_surfaces(
                map_from_laser, angle, max_range_m, max_thickness_m=max_thickness_m, min_linearity=min_linearity
            )
            rows = (case[chosen] - 2, slice(None), np.arange(len(angle)))
            expected = np.stack([surfaces.mirrored_m, surfaces.second_m, surfaces.third_m])[rows].T
            cell = np.stack([surfaces.first_cell, surfaces.second_cell, surfaces.third_cell])[rows].T
        cos = np.maximum(cos_incidence(caster, map_from_laser[:, 2:3] + angle, cell, min_linearity), MIN_COS)
        across = (z - expected) * cos - residuals.depth_share * thickness_m[cell]
        log_w += _log_density(across, residuals, mixture)
    return log_w * min(1.0, independent_beams(residuals, mixture) / len(case))


def by_field(
    field: DistanceField, map_from_base: np.ndarray, ends_m: np.ndarray, residuals: RangeResiduals, mixture: BeamMixture
) -> np.ndarray:
    """(P,) log likelihoods of particles (P, 3) from end points (B, 2) in the robot's frame that lie on walls."""
    if not len(ends_m):
        return np.zeros(len(map_from_base))
    log_w = field.log_weights(ends_m, map_from_base, residuals.sigma_m, mixture.laser_z_hit, mixture.laser_z_rand)
    return log_w * min(1.0, independent_beams(residuals, mixture) / len(ends_m))


def known_ends(case: np.ndarray) -> np.ndarray:
    """(B,) bool: the beam ended at a surface of the map, and was not mirrored."""
    return (case != BeamCase.UNCERTAIN) & (case != BeamCase.SPECULAR)


def _log_density(across_m: np.ndarray, residuals: RangeResiduals, mixture: BeamMixture) -> np.ndarray:
    square = np.minimum((across_m / residuals.sigma_m) ** 2, 100.0)
    return np.log(mixture.laser_z_hit * np.exp(-0.5 * square) + mixture.laser_z_rand).sum(axis=1)


def independent_beams(residuals: RangeResiduals, mixture: BeamMixture) -> float:
    """Number of independent beams as which the chosen ones count.

    A spread wider than the lidar's comes from the map, whose error is the same along a whole wall.
    """
    return mixture.laser_independent_beams * min(1.0, (mixture.laser_sigma_hit / residuals.sigma_m) ** 2)
