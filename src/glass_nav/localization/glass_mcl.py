"""SCAN -> CASES -> WEIGHTS -> POSE  (skeleton: the interface is final, the filter is being written)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from glass_nav.geometry import se2
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap


@dataclass(frozen=True)
class BeamCases:
    """What each beam of a scan met (B beams)."""
    case: np.ndarray        # (B,) uint8: 1 diffuse, 2 specular, 3 first penetration, 4 second, 0 uncertain
    expected_m: np.ndarray  # (B,) reference range of that case at the estimated pose, NaN for case 0
    residual_m: np.ndarray  # (B,) measured minus expected, NaN for case 0
    weight: np.ndarray      # (B,) share of the vote that the case won, 0..1


@dataclass(frozen=True)
class GlassMclParams:
    min_particles: int = 100
    max_particles: int = 5000


@dataclass(frozen=True)
class Estimate:
    """What the filter says after one scan."""
    stamp_ns: int
    map_from_base: np.ndarray   # (3,) pose of the best cluster
    covariance: np.ndarray      # (3, 3) of that cluster, x [m], y [m], yaw [rad]
    map_from_odom: np.ndarray   # (3,) what tf needs
    cases: BeamCases            # of every beam of the scan
    particles: np.ndarray       # (P, 3) poses in map
    state: str                  # UNKNOWN, GLOBAL_SEARCH, LOCALIZED, UNCERTAIN, LOST
    reason: str                 # the state in words
    used_share: float           # share of the answering beams that a case 1-4 explains
    updated: bool               # whether this scan moved the particles


class GlassMcl:
    """Monte Carlo localization that decides beam by beam what the beam met."""

    def __init__(self, params: GlassMclParams, grid_map: GridMap, rng: np.random.Generator) -> None:
        self._params, self._grid_map, self._rng = params, grid_map, rng
        self._map_from_odom = np.zeros(3)
        self._start: Optional[np.ndarray] = np.zeros(3)

    def set_pose(self, map_from_base: np.ndarray, covariance: np.ndarray) -> None:
        """Start over around a pose (3,) with covariance (3, 3). ValueError if either is unusable."""
        self._start = np.asarray(map_from_base, float)

    def scatter(self) -> None:
        """Start over anywhere in the free cells of the map (service global_localization)."""

    def set_map(self, grid_map: GridMap) -> None:
        """Another map; the particles stay where they are."""

    def request_update(self) -> None:
        """The next scan is used even if the robot did not move (service request_nomotion_update)."""

    def update(self, scan: Scan, odom_from_base: np.ndarray) -> Estimate:
        """One scan and the odometry (3,) at its stamp -> pose. ScanError on a stamp that runs backwards."""
        if self._start is not None:
            self._map_from_odom = se2.compose(self._start, se2.inverse(odom_from_base))
            self._start = None
        nothing = np.full(len(scan), np.nan)
        return Estimate(scan.stamp_ns, se2.compose(self._map_from_odom, odom_from_base), np.eye(3) * 0.01,
                        self._map_from_odom, BeamCases(np.zeros(len(scan), np.uint8), nothing, nothing,
                                                       np.zeros(len(scan))),
                        np.zeros((1, 3)), "UNKNOWN", "skeleton", 0.0, True)
