"""Monte Carlo localization as amcl does it, with the likelihood field: what glass_nav is compared with.

It gets what is known to help it: log probabilities (amcl adds up cubes), thinned beams that count less than they are,
and the settings that test/benchmark/tune_baselines.py found best (glass_office, glass_bridge and glass_atrium, lidar
weak, seed 100, the first 150 scans). P particles, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, NamedTuple, Optional, Protocol

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.localization import initial_pose
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.particle_filter import motion, pose_estimate, resampling
from glass_nav.localization.particle_filter.resampling import ParticleCount
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import Scan
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


BEST_FIELD = Settings(sigma_hit_m=0.05, z_hit=0.5, z_rand=0.5, independent_beams=20.0)


class SensorModel(Protocol):
    """How well poses explain a scan."""

    def log_weights(self, map_from_base: np.ndarray, scan: Scan) -> np.ndarray:
        """(P,) log likelihoods of the scan at poses (P, 3)."""


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
        self._fit = np.exp(-0.5 * (distance_m / settings.sigma_hit_m) ** 2)
        self._log_p: Dict[float, np.ndarray] = {}  # by the range of the lidar

    def log_weights(self, map_from_base: np.ndarray, scan: Scan) -> np.ndarray:
        """(P,) log likelihoods of the scan at poses (P, 3)."""
        settings = self._settings
        if scan.range_max_m not in self._log_p:
            # rounded at the end: numpy's logarithm of float32 is another one in each version and on each processor
            log_p = np.log(settings.z_hit * self._fit + settings.z_rand / scan.range_max_m)
            self._log_p[scan.range_max_m] = log_p.astype(np.float32)
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
        # not rng.multivariate_normal: the signs of its singular vectors depend on the LAPACK of the machine
        pose, _, deviations = initial_pose.checked(map_from_base, covariance)
        self._particles = pose + self._rng.standard_normal((self._count.max_particles, 3)) @ deviations.T
        self._odom_from_base = None

    def request_update(self) -> None:
        """The next scan is used even if the robot did not move."""
        self._update_due = True

    def update(self, scan: Scan, odom_from_base: np.ndarray) -> PlainEstimate:
        """Processes one scan and the odometry (3,) at its stamp; returns the pose."""
        if self._is_due(odom_from_base):
            if self._odom_from_base is not None:
                step = se2.compose(se2.inverse(self._odom_from_base), odom_from_base)
                self._particles = motion.sample(self._particles, step, self._params.odometry, self._rng)
            weights = resampling.normalised(self._model.log_weights(self._particles, scan))
            best = pose_estimate.of(self._particles, weights)
            drawn = resampling.low_variance(weights, self._count.max_particles, self._rng)
            enough = resampling.enough_particles(self._particles[drawn], self._count)
            self._particles = self._particles[resampling.low_variance(weights, enough, self._rng)]
            self._map_from_odom = se2.compose(best.map_from_base, se2.inverse(odom_from_base))
            self._odom_from_base, self._update_due = np.array(odom_from_base, float), False
        return PlainEstimate(scan.stamp_ns, se2.compose(self._map_from_odom, odom_from_base))

    def _is_due(self, odom_from_base: np.ndarray) -> bool:
        if self._odom_from_base is None or self._update_due:
            return True
        way, turn = se2.travelled(se2.compose(se2.inverse(self._odom_from_base), odom_from_base))
        return way >= self._params.schedule.update_min_d or turn >= self._params.schedule.update_min_a
