"""The covariance of the tracked pose at every scan, and whether the scan still fits there.

The covariance has four parts: the spread of the particles; the fit of the scan, with the disagreement of map and
lidar (fit_information.py); odometry since the last fit (pose_covariance.py); and the distance to a better fit, if the
scan fits best beside the pose, or at a place that a second scan has to confirm. The covariance that is reported is a
narrower one (claimed_covariance.py).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Dict, Optional, Tuple

import numpy as np

from glass_nav import _integrity
from glass_nav.geometry import angles
from glass_nav.localization.integrity.claimed_covariance import ClaimedCovariance
from glass_nav.localization.integrity.fit_information import FitInformation, ScanFit
from glass_nav.localization.integrity.pose_covariance import PoseCovariance, widened_by
from glass_nav.localization.particle_filter.motion import OdometryNoise
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea
from glass_nav.sensing.scan import Scan

_BEAMS = 90  # looked at
_BESIDE = 3.0  # deviations between the pose and the best fit: the scan no longer fits
_FARTHER = 3.0  # times as far as after the last update
_LESS = 0.15  # share of the beams at walls, below that at the last update: the scan no longer fits


class IntegrityMonitor:
    """Follows one tracked pose in one map."""

    def __init__(self, field: DistanceField, known_area: KnownArea) -> None:
        """
        Args:
            field, known_area: of the map.
        """
        self._known_area = known_area
        self._fit = ScanFit(field, known_area.resolution_m)
        self._covariance: Optional[PoseCovariance] = None
        self._claimed = ClaimedCovariance(field, known_area)
        self._at_update: Dict[str, Tuple[float, float]] = {}  # of each lidar's last update: beside_of() and share then
        self._other: Optional[np.ndarray] = None  # (3,) how far off another possible place is, in map
        self._now: Optional[FitInformation] = None  # of the present scan at the carried pose

    def start(self, covariance: np.ndarray) -> None:
        """The pose was placed anew, with a covariance (3, 3)."""
        self._covariance = PoseCovariance(covariance)
        self._claimed.start(covariance)
        self._now = self._other = None
        self._at_update = {}

    def stop(self) -> None:
        """Stop: there is no tracked pose."""
        self._covariance = None

    def fits(self, scan: Scan, map_from_base: np.ndarray, step: Optional[np.ndarray], noise: OdometryNoise) -> bool:
        """Whether a scan still fits at the pose (3,) to which a step (3,) of odometry since the last update leads."""
        self._now = None if self._covariance is None else self._look(scan, map_from_base, 0.0)
        if self._covariance is None or self._now is None or scan.lidar not in self._at_update:
            return True
        beside_then, share_then = self._at_update[scan.lidar]
        beside = _beside(self._now, self._covariance.carried(step, noise))
        return beside <= max(_BESIDE, _FARTHER * beside_then) and self._now.share >= share_then - _LESS

    def update(
        self,
        scan: Scan,
        map_from_base: np.ndarray,
        step: Optional[np.ndarray],
        noise: OdometryNoise,
        worth: float,
        suspect: Optional[np.ndarray],
        slipped: bool = False,
    ) -> np.ndarray:
        """A scan moved the particles.

        Args:
            scan: the scan.
            map_from_base: (3,) pose after it.
            step: (3,) of odometry since the last update, in the robot's frame then; None: there was none.
            noise: of odometry.
            worth: of its fit there as evidence, 0..1; 0: it does not fit as scans usually do.
            suspect: (3,) pose where it fits instead, and another scan has to confirm it; None: there is none.
            slipped: the scan contradicts odometry.

        Returns:
            (3,) the pose, as odometry has it in directions in which the scan is ambiguous.
        """
        if self._covariance is None:
            return map_from_base
        self._now = self._look(scan, map_from_base, worth)
        pose = self._covariance.update(step, map_from_base, self._now if worth > 0.0 else None, noise, worth, slipped)
        self._claimed.update(scan, pose, step, noise, worth)
        if self._now is not None:
            back = pose - map_from_base
            back[2] = angles.wrap(back[2])
            self._now = replace(self._now, offset=self._now.offset + back)
            beside = _beside(self._now, self._covariance.carried(None, noise))
            self._at_update[scan.lidar] = beside, self._now.share
        self._other = None
        if suspect is not None:
            self._other = suspect - pose
            self._other[2] = angles.wrap(self._other[2])
        return pose

    def carried(self, step: Optional[np.ndarray], noise: OdometryNoise) -> Optional[np.ndarray]:
        """(3, 3) covariance after a step (3,) of odometry since the last update, before a scan; None: unknown."""
        return None if self._covariance is None else self._covariance.carried(step, noise)

    @property
    def noise_scale(self) -> np.ndarray:
        """(3,) of the variances of odometry's model, along, across and of the heading: how large its errors have been."""
        return np.ones(3) if self._covariance is None else self._covariance.noise_scale

    def narrow(self, spread: np.ndarray) -> None:
        """Evidence other than scans weighed the particles, whose spread (3, 3) holds now."""
        if self._covariance is not None:
            self._covariance.narrow(spread)
            self._claimed.narrow(spread)

    def at(self, step: Optional[np.ndarray], noise: OdometryNoise, spread: np.ndarray) -> np.ndarray:
        """(3, 3) covariance at the present scan, for decisions.

        Args:
            step: (3,) of odometry since the last update, in the robot's frame then; None: this scan was one.
            noise: of odometry.
            spread: (3, 3) of the particles.
        """
        if self._covariance is None:
            return spread
        carried = self._covariance.carried(step, noise)
        return widened_by(carried, spread) + self._doubts(carried)

    def claimed_at(self, step: Optional[np.ndarray], noise: OdometryNoise, spread: np.ndarray) -> np.ndarray:
        """(3, 3) covariance at the present scan, to be reported; arguments as of at()."""
        if self._covariance is None:
            return spread
        return self._claimed.at(step, noise, spread) + self._doubts(self._covariance.carried(step, noise))

    def _doubts(self, carried: np.ndarray) -> np.ndarray:
        """(3, 3) of reasons to believe another pose than the tracked one with that covariance (3, 3)."""
        assert self._covariance is not None
        doubts = self._covariance.unproven
        if self._now is not None:
            beside = _beside(self._now, carried)
            excess = max(0.0, 1.0 - 4.0 / max(beside**2, 1e-9))  # that is not chance
            doubts = doubts + excess * np.outer(self._now.offset, self._now.offset)
        if self._other is not None:
            doubts = doubts + np.outer(self._other, self._other)
        return doubts

    def _look(self, scan: Scan, map_from_base: np.ndarray, worth: float) -> Optional[FitInformation]:
        return self._fit.of_scan(scan, map_from_base, worth, self._known_area, _BEAMS)


def _beside(fit: FitInformation, covariance: np.ndarray) -> float:
    """Distance of the best fit from a pose with that covariance (3, 3), in deviations of both."""
    return _integrity.mahalanobis(fit.offset, fit.covariance + covariance)
