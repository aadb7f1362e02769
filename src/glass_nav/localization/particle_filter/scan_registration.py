"""Registers the scan near the predicted particles: the poses at which the cases are voted on.

The seed document assumes a good prediction (assumption i). Real odometry violates it: wheels slip, an old log moves a
metre and 10 degrees between scans, a turn of 80 degrees is missed. So the scan is first aligned from preliminary
samples over the predicted spread. If it fits much worse there than recent scans did, wider spreads are tried. A pose
that odometry does not lead to is accepted only if the next scan fits there too, and again not where odometry leads,
since a crowd around the robot may look like another room for one scan.

Along directions that the scan does not constrain, as in a hall whose ends are out of sight, odometry decides. Wheel
slip is considered only if the scan does not fit at the predicted pose, but nearby.

A scan that fits nowhere, because the map lacks what is around the robot, would be drawn to unrelated walls. It is
ignored until scans fit about as well as they have on the whole. A scan of which less than half fits can only be trusted
within reach of odometry, since one half is the breakdown point of robust estimators (Rousseeuw, Least median of squares
regression, Journal of the American Statistical Association 79, 1984).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Optional

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import scan_alignment
from glass_nav.hypotheses.scan_alignment import Alignment
from glass_nav.localization.beam_classification import preliminary_samples
from glass_nav.localization.beam_classification.preliminary_samples import PreliminarySamples
from glass_nav.sensing.distance_field import DistanceField

_MIN_STARTS, _MAX_STARTS = 37, 360
_START_GRID = np.array([0.12, 0.12, 0.05])  # [m, m, rad] of spread that the least starts cover
_ALIGNED_STARTS = 60  # the best of more starts
_LEVELS = (  # limits of the starts' spread: as predicted, a bad step of odometry, an unnoticed turn
    PreliminarySamples(
        sample_min_radius_m=0.12, sample_min_heading_rad=0.05, sample_max_radius_m=0.5, sample_max_heading_rad=0.35
    ),
    PreliminarySamples(
        sample_min_radius_m=0.25, sample_min_heading_rad=0.4, sample_max_radius_m=0.5, sample_max_heading_rad=0.4
    ),
    PreliminarySamples(
        sample_min_radius_m=0.4,
        sample_min_heading_rad=0.5 * np.pi,
        sample_max_radius_m=0.5,
        sample_max_heading_rad=0.5 * np.pi,
    ),
)
_POOR_FIT = 0.75  # of the usual fit: odometry is not trusted
_HALF, _MOST = 0.5, 0.9  # of a scan that fits: its fit may be chance; it is not
_REACH = 3.0  # deviations
_MIN_DEVIATION = np.array([0.01, 0.01, np.radians(0.2)])  # of odometry: m, m, rad
_CONVINCING_FIT = 0.9  # of the usual fit: a place that odometry did not lead to
_EXPLAINED = 0.5  # of what does not fit where odometry leads: a place elsewhere has to explain as much
_NO_EVIDENCE_FIT = 0.4  # of the lasting fit: nothing can be said about the place
_MEMORY, _LASTING_MEMORY = 0.9, 0.995  # weight of the past per scan


class ScanRegistration:
    """Finds the aligned poses and remembers how well recent scans fit."""

    def __init__(self, field: DistanceField) -> None:
        self.fits = True  # the last scan fitted about as well as scans usually do
        self.contradicts_odometry = False  # the last scan fitted beside the place that odometry led to, and not there
        self.is_evidence = True  # the last scan says something about where the robot is
        self._field = field
        self._usual_fit = float("nan")  # of the last scans
        self._lasting_fit, self._remembered = float("nan"), 0  # over many scans, and how many they were
        self._scale_m = float("nan")  # of the kernel in its last step
        self._suspect: Optional[np.ndarray] = None  # (3,) map_from_odom of a place that needs a second scan
        self._fit_ahead = float("nan")  # of the last scan where odometry led

    @property
    def suspect(self) -> Optional[np.ndarray]:
        """(3,) map_from_odom of a place where the last scan fits, and which the next one has to confirm; or None."""
        return self._suspect

    def find(
        self,
        mean: np.ndarray,
        covariance: np.ndarray,
        odom_from_base: np.ndarray,
        points_m: np.ndarray,
        scale_m: float,
    ) -> Alignment:
        """Find at most 4 distinct poses, best first.

        Args:
            mean, covariance: (3,), (3, 3) of the predicted cluster.
            odom_from_base: (3,) odometry at the scan.
            points_m: (B, 2) finite end points of beams in the robot's frame, B >= 1.
            scale_m: of the kernel in the last step of the alignment.
        """
        self._scale_m = scale_m
        found = self._align_around(mean, covariance, _LEVELS[0], points_m)
        suspect, self._suspect = self._suspect, None
        self._fit_ahead = float(scan_alignment.fit(self._field, points_m, mean[None])[0])
        self.fits = not found.fit[0] < _POOR_FIT * self._usual_fit
        self.contradicts_odometry = self._contradicts(found, mean, covariance, points_m)
        self.is_evidence = not found.fit[0] < _NO_EVIDENCE_FIT * self._lasting_fit
        if not self.fits:
            farther = self._confirmed(suspect, odom_from_base, points_m)
            if farther is not None:
                self.fits = self.contradicts_odometry = self.is_evidence = True
                return farther
            self._suspect = self._search(mean, covariance, odom_from_base, points_m)
            near = _within(found.poses, mean, _spread(covariance, _LEVELS[0]))
            if not self.is_evidence or not near.any():
                return Alignment(mean[None], np.zeros((1, 3, 3)), scan_alignment.fit(self._field, points_m, mean[None]))
            found = Alignment(found.poses[near], found.information[near], found.fit[near])
        self._remember(found, points_m)
        return found

    def _contradicts(self, found: Alignment, mean: np.ndarray, covariance: np.ndarray, points_m: np.ndarray) -> bool:
        """The scan fits at an aligned pose as scans usually do, but at none that odometry explains."""
        near = found.poses[_within(found.poses, mean, np.sqrt(np.diag(covariance) + _MIN_DEVIATION**2))]
        fit_near = scan_alignment.fit(self._field, points_m, np.vstack([mean, near])).max()
        return bool(fit_near < _POOR_FIT * self._usual_fit and self._is_convincing(found.fit[0], fit_near))

    def _is_convincing(self, fit: float, fit_near: float) -> bool:
        """Of a place that odometry did not lead to: what fits badly on the way there does not lower it much."""
        usual = fit > _CONVINCING_FIT * max(self._usual_fit, _POOR_FIT * self._lasting_fit)
        return bool(usual and fit >= least_fit_elsewhere(fit_near))

    def _confirmed(
        self, suspect: Optional[np.ndarray], odom_from_base: np.ndarray, points_m: np.ndarray
    ) -> Optional[Alignment]:
        """Poses around the place that the last scan suggested, if this one fits there too."""
        if suspect is None:
            return None
        again = self._align_around(se2.compose(suspect, odom_from_base), np.zeros((3, 3)), _LEVELS[0], points_m)
        return again if self._is_convincing(again.fit[0], self._fit_ahead) else None

    def _search(
        self, mean: np.ndarray, covariance: np.ndarray, odom_from_base: np.ndarray, points_m: np.ndarray
    ) -> Optional[np.ndarray]:
        """map_from_odom of a farther place where the scan fits as scans usually do."""
        for level in _LEVELS[1:]:
            farther = self._align_around(mean, covariance, level, points_m)
            if self._is_convincing(farther.fit[0], self._fit_ahead):
                return se2.compose(farther.poses[0], se2.inverse(odom_from_base))
        return None

    def _remember(self, found: Alignment, points_m: np.ndarray) -> None:
        fit = float(found.fit[0])
        past, lasting = (fit, fit) if np.isnan(self._usual_fit) else (self._usual_fit, self._lasting_fit)
        self._usual_fit = _MEMORY * past + (1.0 - _MEMORY) * fit
        self._remembered += 1
        self._lasting_fit = lasting + max(1.0 - _LASTING_MEMORY, 1.0 / self._remembered) * (fit - lasting)

    def _align_around(
        self, mean: np.ndarray, covariance: np.ndarray, shape: PreliminarySamples, points_m: np.ndarray
    ) -> Alignment:
        spread = _spread(covariance, shape)
        count = int(np.clip(_MIN_STARTS * np.prod(spread / _START_GRID), _MIN_STARTS, _MAX_STARTS))
        starts = preliminary_samples.around(mean, covariance, replace(shape, sample_count=count))
        if count > _ALIGNED_STARTS:
            fit = scan_alignment.fit(self._field, points_m, starts)
            starts = starts[np.argsort(-fit)[:_ALIGNED_STARTS]]
        return scan_alignment.distinct(scan_alignment.align(self._field, points_m, starts, last_scale_m=self._scale_m))


def worth(fit: float) -> float:
    """Of a scan with that fit as evidence, 0..1: 0 if the map explains half of it or less, 1 from three quarters on."""
    return float(np.clip((fit - _HALF) / (_MOST - _HALF), 0.0, 1.0)) ** 2


def least_fit_elsewhere(fit_near: float) -> float:
    """Fit that a place needs which odometry did not lead to: half of what does not fit where odometry leads fits there.

    A robot that slipped sees all of it explained. What the map lacks, people and panes, stays unexplained anywhere: then a
    place elsewhere that fits a little better does so by chance.
    """
    return fit_near + _EXPLAINED * (1.0 - fit_near)


def _within(poses: np.ndarray, mean: np.ndarray, deviations: np.ndarray) -> np.ndarray:
    """(K,) bool: poses (K, 3) that are within reach of a mean with deviations (3,)."""
    off = np.abs(poses - mean)
    off[:, 2] = np.abs(angles.wrap(off[:, 2]))
    return np.all(off < _REACH * deviations, axis=1)


def _spread(covariance: np.ndarray, shape: PreliminarySamples) -> np.ndarray:
    """(3,) deviations [m, m, rad] within the limits of the starts."""
    return np.clip(
        np.sqrt(np.diag(covariance)),
        [shape.sample_min_radius_m] * 2 + [shape.sample_min_heading_rad],
        [shape.sample_max_radius_m] * 2 + [shape.sample_max_heading_rad],
    )
