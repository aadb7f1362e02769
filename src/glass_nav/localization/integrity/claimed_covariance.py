"""The covariance that is reported with a pose: as wide as its errors, and no wider.

What decides inside the filter, such as how much odometry counts against an ambiguous scan, uses the wider covariance of
integrity_monitor.py, and so do protection levels, which must also bound what no scan shows: a map that is drawn off as a
whole by a fraction of a cell. There a covariance that is too small once costs the pose, and one that is too wide costs little. To
a user both are wrong. So the reported one measures residuals more sharply (fit_information.py, `square`), from more
beams. In all else it is propagated in the same way (pose_covariance.py).
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from glass_nav.localization.integrity.dead_reckoning import SURE
from glass_nav.localization.integrity.fit_information import ScanFit
from glass_nav.localization.integrity.pose_covariance import PoseCovariance, widened_by
from glass_nav.localization.particle_filter.motion import OdometryNoise
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea
from glass_nav.sensing.scan import Scan

_BEAMS = 180  # looked at


class ClaimedCovariance:
    """Follows one tracked pose in one map."""

    def __init__(self, field: DistanceField, known_area: KnownArea) -> None:
        """
        Args:
            field, known_area: of the map.
        """
        self._known_area = known_area
        self._fit = ScanFit(field, known_area.resolution_m, square=True)
        self._covariance = PoseCovariance(SURE)

    def start(self, covariance: np.ndarray) -> None:
        """The pose was placed anew, with a covariance (3, 3)."""
        self._covariance = PoseCovariance(covariance)

    def update(
        self, scan: Scan, map_from_base: np.ndarray, step: Optional[np.ndarray], noise: OdometryNoise, worth: float
    ) -> None:
        """A scan moved the particles; arguments as of IntegrityMonitor.update()."""
        fit = self._fit.of_scan(scan, map_from_base, worth, self._known_area, _BEAMS) if worth > 0.0 else None
        self._covariance.update(step, map_from_base, fit, noise, worth, slipped=True)  # the pose is decided already

    def narrow(self, spread: np.ndarray) -> None:
        """Evidence other than scans weighed the particles, whose spread (3, 3) holds now."""
        self._covariance.narrow(spread)

    def at(self, step: Optional[np.ndarray], noise: OdometryNoise, spread: np.ndarray) -> np.ndarray:
        """(3, 3) at the present scan, without doubts about the pose; arguments as of IntegrityMonitor.at().

        Particles are always spread by some millimetres, which is no doubt of theirs.
        """
        return widened_by(self._covariance.carried(step, noise) + SURE, spread) - SURE
