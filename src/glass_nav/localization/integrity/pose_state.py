"""The reported state, its reason and the confidence, from inlier ratio, covariance and the kidnap detector.

The covariance alone is not enough: in a wrong corridor it is small as well. What counts is how much of the scan the
map explains at the pose, whether scans fit as well as before, and whether they fit better elsewhere
(kidnap_detector.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np

from glass_nav.hypotheses.global_search import Candidates
from glass_nav.localization.integrity.kidnap_detector import Verdict
from glass_nav.localization.particle_filter.pose_estimate import PoseEstimate
from glass_nav.params import number
from glass_nav.vocabulary import LocalizationState

_POSSIBLE = 8.0  # log likelihood ratio of the best place to one that is still counted as possible
_MIN_RELIABILITY = 0.05  # of a pose that nothing else speaks against
_MIN_GIVEN = 0.5  # of a given pose that was not compared with all other places yet: not rather wrong than right
_LOST = 3.0  # log likelihood ratio of another place to the tracked pose
_KEPT = (
    3.0,
    1.0 / 3.0,
)  # log odds of a pose to which odometry leads from the last sure one; how much a worse fit counts there


@dataclass(frozen=True)
class QualityLimits:
    """When a pose is trusted."""

    localized_max_position_sigma_m: float = number(0.3, 0.0, 1000.0)
    localized_max_heading_sigma_rad: float = number(0.2, 0.0, 10.0)
    localized_min_cluster_share: float = number(0.8, 0.0, 1.0)
    uncertain_used_share: float = number(0.4, 0.0, 1.0)  # of the beams that say something explained
    lost_used_share: float = number(0.2, 0.0, 1.0)
    localized_min_reliability: float = number(0.7, 0.0, 1.0)  # chance that the pose is right

    def __post_init__(self) -> None:
        for name in ("localized_max_position_sigma_m", "localized_max_heading_sigma_rad"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"~{name} must be > 0, got {getattr(self, name)}")
        if not 0.0 <= self.lost_used_share <= self.uncertain_used_share <= 1.0:
            raise ValueError(
                "~lost_used_share and ~uncertain_used_share must ascend in [0, 1], got "
                f"{self.lost_used_share} and {self.uncertain_used_share}"
            )
        for name in ("localized_min_cluster_share", "localized_min_reliability"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"~{name} must be in [0, 1], got {getattr(self, name)}")


@dataclass(frozen=True)
class Judgement:
    """The reported state, reason and confidence."""

    state: LocalizationState
    reason: str  # in one sentence
    confidence: float  # chance that the pose is right, 0..1
    places: int = 1  # that are possible during a global search; 0: no scan has been evidence yet


class PoseQuality:
    """Remembers how well the last scans were explained."""

    _MEMORY = 0.8  # weight of the past per update: about five updates

    def __init__(self, limits: QualityLimits) -> None:
        self._limits = limits
        self._candidates: Optional[Candidates] = None
        self._verdict: Optional[Verdict] = None
        self._inlier_ratio = float("nan")

    def reconfigure(self, limits: QualityLimits) -> None:
        """Use other limits from now on; what was learnt stays."""
        self._limits = limits

    def observe(self, inlier_ratio: float, judged_share: float = 1.0) -> None:
        """Take in one update.

        Args:
            inlier_ratio: of the beams that say something about the pose, the share that the map explains; NaN: none does.
            judged_share: of the beams that returned, the share that says something; the fewer, the less it counts.
        """
        if np.isfinite(inlier_ratio):
            past = inlier_ratio if math.isnan(self._inlier_ratio) else self._inlier_ratio
            self._inlier_ratio = past + (1.0 - self._MEMORY) * judged_share * (inlier_ratio - past)

    def follow_search(self, candidates: Candidates) -> None:
        """A global search runs; these places are possible."""
        self._candidates = candidates

    def doubt(self, verdict: Verdict) -> None:
        """The doubt of the kidnap detector about the tracked pose."""
        self._verdict = verdict

    def judge(self, best: PoseEstimate, covariance: Optional[np.ndarray] = None) -> Judgement:
        """State of the best cluster of particles.

        Args:
            best: the cluster.
            covariance: (3, 3) of its pose over x [m], y [m], yaw [rad]; None: the spread of the particles.
        """
        covariance = best.covariance if covariance is None else covariance
        if self._candidates is not None:
            known = best.share if len(self._candidates.poses) else 0.0
            return Judgement(
                LocalizationState.GLOBAL_SEARCH,
                _progress(self._candidates),
                min(known, 1.0),
                _possible(self._candidates),
            )
        limits = self._limits
        position_sigma_m, heading_sigma_rad = _deviations(covariance)
        wide = (
            position_sigma_m > limits.localized_max_position_sigma_m
            or heading_sigma_rad > limits.localized_max_heading_sigma_rad
            or best.share < limits.localized_min_cluster_share
        )
        spread = (
            f"{best.share:.0%} of the weight in one place, sigma {position_sigma_m:.2f} m, "
            f"{math.degrees(heading_sigma_rad):.1f} deg"
        )
        if math.isnan(self._inlier_ratio):
            return Judgement(LocalizationState.UNCERTAIN, f"no scan has been used yet; {spread}", 0.0)
        explained = f"the map explains {self._inlier_ratio:.0%} of the beams that it covers"
        confidence = _confidence(self._inlier_ratio, self._verdict, best)
        elsewhere = _elsewhere(self._verdict)
        if elsewhere is not None and self._verdict is not None and self._verdict.log_ratio > _LOST:
            return Judgement(LocalizationState.LOST, f"{elsewhere}; {explained}", confidence)
        if self._inlier_ratio < limits.lost_used_share:
            return Judgement(LocalizationState.LOST, explained, confidence)
        if elsewhere is not None:
            return Judgement(LocalizationState.UNCERTAIN, f"{elsewhere}; {explained}; {spread}", confidence)
        if wide or self._inlier_ratio < limits.uncertain_used_share:
            return Judgement(LocalizationState.UNCERTAIN, f"{explained}; {spread}", confidence)
        if confidence < self._least_confidence():
            return Judgement(
                LocalizationState.UNCERTAIN,
                f"the probability that the pose is right is only {confidence:.0%}; {explained}; {spread}",
                confidence,
            )
        return Judgement(LocalizationState.LOCALIZED, f"{explained}; {spread}", confidence)

    def _least_confidence(self) -> float:
        """Smallest confidence of a pose that is reported as LOCALIZED."""
        verdict = self._verdict
        if verdict is not None and verdict.given and not verdict.losing:
            return min(_MIN_GIVEN, self._limits.localized_min_reliability)
        if verdict is not None and (verdict.losing or verdict.doubted):
            return self._limits.localized_min_reliability
        return _MIN_RELIABILITY


def _possible(candidates: Candidates) -> int:
    """How many places are still possible."""
    if not len(candidates.poses):
        return 0
    return int(np.count_nonzero(candidates.weights > candidates.weights[0] * np.exp(-_POSSIBLE)))


def _progress(candidates: Candidates) -> str:
    if not len(candidates.poses):
        return "no usable scan yet"
    possible = _possible(candidates)
    x, y, yaw = candidates.poses[0]
    best = f"the best at x {x:.1f} m, y {y:.1f} m, {np.degrees(yaw):.0f} deg, scan fit {candidates.fit:.0%}"
    if possible == 1:
        return f"one place is possible, {best}"
    return f"{possible} places are possible, {best}"


def _elsewhere(verdict: Optional[Verdict]) -> Optional[str]:
    """Why the pose is in doubt, in words; None: it is not."""
    if verdict is None:
        return None
    if verdict.contested and verdict.elsewhere is not None:
        x, y, yaw = verdict.elsewhere
        return f"the scans fit as well or better elsewhere, best at x {x:.1f} m, y {y:.1f} m, {np.degrees(yaw):.0f} deg"
    if verdict.moved:
        return "the view of the lidar changed abruptly, as if the robot had been moved by hand"
    if verdict.poor:
        return f"scan fit {verdict.fit:.0%}, usually {verdict.usual:.0%}"
    return None


def _deviations(covariance: np.ndarray) -> Tuple[float, float]:
    """Largest of the position [m], and that of the heading [rad], of a covariance (3, 3)."""
    (xx, xy, _), (_, yy, _), (_, _, yaw) = covariance.tolist()
    longest = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
    return math.sqrt(max(longest, 0.0)), math.sqrt(max(yaw, 0.0))


def _confidence(inlier_ratio: float, verdict: Optional[Verdict], best: PoseEstimate) -> float:
    """Chance that the pose is right.

    Logistic regression over 5500 poses of five real logs and five simulated buildings (drives as those of
    test/benchmark/reliability.py, seeds 20 to 22), in which robots were kidnapped, started wrong, or were right;
    the constant from 4400 poses of all tracks (seed 200).
    """
    sigma_m = min(max(math.sqrt(best.covariance[0, 0] + best.covariance[1, 1]), 0.005), 2.0)
    logit = -2.1 - 6.8 * (1.0 - inlier_ratio) - 1.9 * math.log(sigma_m)
    if verdict is not None and math.isfinite(verdict.fit):
        vouched, counts = _KEPT if verdict.kept else (0.0, 1.0)
        logit += vouched - counts * 22.8 * max(0.0, verdict.usual - verdict.fit)
        if verdict.candidates is not None:
            logit += 2.4 - 0.95 * (min(max(verdict.log_ratio, -8.0), 8.0) + 3.0)
    return min(best.share, 1.0) / (1.0 + math.exp(-logit))
