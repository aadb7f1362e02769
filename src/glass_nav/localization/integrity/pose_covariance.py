"""Propagates the covariance of the tracked pose over odometry steps and fits of scans.

The spread of the particles underestimates the error: each scan is weighted as if its errors were independent, but
consecutive scans see the same walls with the same errors. So information is never added up over scans. In each
direction, the better of the predicted pose and the present scan determines the covariance. This is the ellipsoidal
intersection of Sijs et al., State fusion with unknown correlation, Proc. European Control Conf. (2010), without its
mutual mean.

The same holds for the pose: where a scan fits in part and at other poses as well, such as along a bridge whose panes the
map lacks, it fits best at one of them by chance. In such directions odometry keeps the pose.

Between two fits the covariance grows by the odometry noise of the filter, scaled by the size of the last corrections
relative to that noise. All covariances are over x [m], y [m], yaw [rad] in map.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from glass_nav import _integrity
from glass_nav.geometry import angles, se2
from glass_nav.localization.integrity.dead_reckoning import DeadReckoning
from glass_nav.localization.integrity.fit_information import FitInformation
from glass_nav.localization.particle_filter.motion import OdometryNoise

_MEMORY = 0.95  # weight of the past per update, of the scale of odometry's noise
_MIN_SCALE = 0.01  # of the variances of the model of odometry
_EVERYTHING = np.eye(3)  # share of a scan in the pose
_WIDER = 2.0  # times the deviations of odometry, which errs alike in step after step
_AMBIGUOUS = np.diag(np.square([0.1, 0.1, np.radians(2.0)]))  # least covariance of a scan whose pose odometry keeps
_CLEAR = 0.1  # of that: of a scan that is not ambiguous in any direction
_VIEW_M = 2.0  # after this distance the surroundings are seen anew
_MAX_CORRECTION = 6.0  # deviations: a larger one is an event of its own


class PoseCovariance:
    """Remembers the covariance at the last update, and how good odometry has been."""

    def __init__(self, covariance: np.ndarray) -> None:
        """
        Args:
            covariance: (3, 3) of the start.
        """
        self._at_update = np.array(covariance, float)
        self._last: Optional[np.ndarray] = None  # (3,) map_from_base at the last update
        self.noise_scale = np.ones(3)  # of the variances along, across and of the heading
        self._unproven = np.zeros(2)  # corrections of odometry's position, in map, by scans that hardly fit

    def update(
        self,
        step: Optional[np.ndarray],
        map_from_base: np.ndarray,
        fit: Optional[FitInformation],
        noise: OdometryNoise,
        worth: float = 1.0,
        slipped: bool = False,
    ) -> np.ndarray:
        """The particles were moved.

        Args:
            step: (3,) of odometry since the last update, in the robot's frame then; None: there was none.
            map_from_base: (3,) the pose after it.
            fit: of the scan there; None: the scan says nothing about the pose.
            noise: of odometry.
            worth: of the fit as evidence about odometry, 0..1.
            slipped: the scan contradicts odometry, which does not hold the pose then.

        Returns:
            (3,) the pose, as odometry has it in directions in which the scan is ambiguous.
        """
        pose = np.array(map_from_base, float)
        if step is not None and self._last is not None:
            carried = self.carried(step, noise)
            correction = self._correction(step, pose)
            if fit is not None:
                share = _EVERYTHING if slipped else self._share(carried, fit.covariance, worth)
                if share is not _EVERYTHING:
                    pose += share @ correction - correction
                    pose[2] = angles.wrap(pose[2])
                    correction = share @ correction
                self._learn(step, correction, noise, worth, share)
            self._unproven = (self._unproven + correction[:2]) * _doubt(worth, step)
            self._at_update = carried
        if fit is not None:
            self._at_update = better_of(self._at_update, fit.covariance)
        self._last = pose
        return pose

    @staticmethod
    def _share(carried: np.ndarray, of_scan: np.ndarray, worth: float) -> np.ndarray:
        """(3, 3) share of a scan in the pose.

        Args:
            carried: (3, 3) covariance of the pose that odometry carried.
            of_scan: (3, 3) covariance of the scan's fit.
            worth: of the fit, 0..1.
        """
        ambiguous = _AMBIGUOUS / max(1.0 - worth, 1e-6)
        if np.all(np.diag(of_scan) < _CLEAR * np.diag(ambiguous)):
            return _EVERYTHING
        return np.array(_integrity.share_of_second(_WIDER**2 * carried + ambiguous, of_scan))

    @property
    def unproven(self) -> np.ndarray:
        """(3, 3) of corrections that scans of little worth made: there are as good reasons to believe odometry."""
        off = np.append(self._unproven, 0.0)  # a heading is right wherever the walls have the same directions
        return np.outer(off, off)

    def narrow(self, covariance: np.ndarray) -> None:
        """Something else determines the pose at the last update, with that covariance (3, 3)."""
        self._at_update = better_of(self._at_update, covariance)
        self._unproven = np.zeros(2)

    def carried(self, step: Optional[np.ndarray], noise: OdometryNoise) -> np.ndarray:
        """(3, 3) after a step (3,) of odometry since the last update, in the robot's frame then."""
        if step is None or self._last is None:
            return self._at_update
        return DeadReckoning(self._last, self._at_update).carried(step, noise, self.noise_scale).covariance

    def _correction(self, step: np.ndarray, map_from_base: np.ndarray) -> np.ndarray:
        """(3,) in map: how far a pose is off the one that a step of odometry led to."""
        assert self._last is not None
        off = map_from_base - se2.compose(self._last, step)
        off[2] = angles.wrap(off[2])
        return off

    def _learn(
        self, step: np.ndarray, correction: np.ndarray, noise: OdometryNoise, worth: float, share: np.ndarray
    ) -> None:
        """How large a correction (3,) is in the model of odometry, by a scan that had that share (3, 3) in the pose."""
        assert self._last is not None
        predicted = DeadReckoning(self._last, np.zeros((3, 3))).carried(step, noise)
        turned = _turned(self._last[2])
        variance = np.diag(turned.T @ predicted.covariance @ turned)
        known = variance > 1e-10
        squared = np.minimum((turned.T @ correction)[known] ** 2 / variance[known], _MAX_CORRECTION**2)
        learnt = worth * (1.0 - _MEMORY) * np.clip(np.diag(turned.T @ share @ turned)[known], 0.0, 1.0)
        scale = self.noise_scale[known] + learnt * (squared - self.noise_scale[known])
        self.noise_scale[known] = np.maximum(scale, _MIN_SCALE)


def _doubt(worth: float, step: np.ndarray) -> float:
    """Share of a correction that is still in doubt after a step (3,): each view of the surroundings proves some of it."""
    return float((1.0 - worth) ** (se2.travelled(step)[0] / _VIEW_M)) if worth < 1.0 else 0.0


def better_of(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(3, 3): in each direction the smaller of two covariances."""
    return _integrity.better_of(first, second)


def widened_by(covariance: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """(3, 3): a covariance, in directions in which a spread (3, 3) is far larger that spread.

    Particles spread as their proposal does, whatever the scan determines: only far beyond, they are in doubt themselves.
    """
    return _integrity.widened_by(covariance, spread)


def _turned(yaw: float) -> np.ndarray:
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
