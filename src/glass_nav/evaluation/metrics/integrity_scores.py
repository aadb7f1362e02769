"""Scores integrity: the state and protection level of each pose against its true error.

As in satellite navigation: a pose that is reported as LOCALIZED while its error exceeds the protection level is misleading
information. S scans. A scan without a reference counts in no figure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics.pose_errors import RIGHT_M, RIGHT_RAD, SLACK_NS
from glass_nav.geometry import angles, polyline
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.vocabulary import LocalizationState

CLOSE_M, CLOSE_RAD = 0.2, np.radians(3.0)  # nearer than both, an alarm is false
CONSISTENT_NEES = 2.366  # median of chi squared with 3 degrees of freedom
METRICS = (  # of summary(), in its order
    "misleading_share",
    "misleading_max_s",
    "misleading_max_m",
    "nees_median",
    "alarm_share",
    "level_ratio",
    "time_to_alarm_s",
    "time_back_s",
)
NEVER = ("time_to_alarm_s", "time_back_s")  # None with a reference: it did not happen before the end of the log
_ALARMS = (LocalizationState.UNCERTAIN, LocalizationState.LOST)
_Z_999 = 3.29  # deviations that a normal error stays below with 99.9 %
_SINGULAR = 1e-12  # ratio of the variances of a covariance, the least to the largest, below which it has no inverse


@dataclass(frozen=True)
class IntegrityTrace:
    """State, covariance and protection level of each pose, with its true error."""

    stamps_ns: np.ndarray  # (S,) int64, ascending
    driven_m: np.ndarray  # (S,) distance since the first scan by odometry
    states: np.ndarray  # (S,) str
    error: np.ndarray  # (S, 3) along and across the heading [m], of the heading [rad], signed; NaN without a reference
    covariance: np.ndarray  # (S, 3, 3) of the same three; NaN: not known
    level_95: np.ndarray  # (S, 3) protection levels of the same three
    level_999: np.ndarray  # (S, 3)

    @property
    def matched(self) -> np.ndarray:
        """(S,) bool: there is a reference at that scan."""
        return ~np.isnan(self.error[:, 0])

    @property
    def localized(self) -> np.ndarray:
        """(S,) bool."""
        return self.states == LocalizationState.LOCALIZED

    @property
    def misleading(self) -> np.ndarray:
        """(S,) bool: LOCALIZED, and the error exceeds its 99.9 % level along, across or in heading."""
        with np.errstate(invalid="ignore"):
            return self.localized & np.any(np.abs(self.error) > self.level_999, axis=1)

    @property
    def nees(self) -> np.ndarray:
        """(S,) normalized estimation error squared, chi squared with 3 degrees of freedom if the covariance holds."""
        return _nees(self.error, self.covariance)

    def part(self, used: np.ndarray) -> IntegrityTrace:
        """The scans of a mask (S,)."""
        return replace(self, **{name: value[used] for name, value in vars(self).items()})

    def with_reference_deviation(self, position_m: float, heading_rad: float) -> IntegrityTrace:
        """The same against a reference that is itself only good to those standard deviations.

        They are added in quadrature: to the covariance as they are, to the levels by the deviations of a normal error.
        """
        deviation = np.array([position_m, position_m, heading_rad])
        return replace(
            self,
            covariance=self.covariance + np.diag(deviation**2),
            level_95=np.hypot(self.level_95, 1.96 * deviation),
            level_999=np.hypot(self.level_999, _Z_999 * deviation),
        )


def trace(
    stamps_ns: np.ndarray,
    map_from_base: np.ndarray,
    odom_from_base: np.ndarray,
    states: List[str],
    covariance: np.ndarray,
    level_95: np.ndarray,
    level_999: np.ndarray,
    reference: Optional[Trajectory],
) -> IntegrityTrace:
    """Reported values of a run against a reference.

    Args:
        stamps_ns, map_from_base, odom_from_base, states: (S,), (S, 3), (S, 3), S of the scans.
        covariance: (S, 3, 3) reported, over x, y and yaw in map.
        level_95, level_999: (S, 3) reported, along, across, heading.
        reference: map_from_base; None: there is none.
    """
    yaw = map_from_base[:, 2]
    axes = np.zeros((len(yaw), 3, 3))
    axes[:, 0, 0] = axes[:, 1, 1] = np.cos(yaw)
    axes[:, 0, 1] = np.sin(yaw)
    axes[:, 1, 0] = -axes[:, 0, 1]
    axes[:, 2, 2] = 1.0
    error = np.full((len(yaw), 3), np.nan)
    if reference is not None and len(reference) and len(stamps_ns):
        off = map_from_base - reference.at(stamps_ns)
        off[:, 2] = angles.wrap(off[:, 2])
        off = np.einsum("sij,sj->si", axes, off)
        off[~np.isfinite(off).all(axis=1)] = np.inf
        covered = reference.covers(stamps_ns, SLACK_NS)
        error[covered] = off[covered]
    return IntegrityTrace(
        stamps_ns,
        polyline.distances_along(odom_from_base[:, :2]),
        np.array(states, dtype=object).astype(str),
        error,
        axes @ covariance @ axes.transpose(0, 2, 1),
        level_95,
        level_999,
    )


def summary(claims: IntegrityTrace) -> Dict[str, Optional[float]]:
    """The figures of a run, under the names of metrics.json; all None without any reference.

    misleading_share: of all scans. misleading_max_s, misleading_max_m: the longest row of misleading scans, each lasting
    until the next scan, in time and in distance by odometry. nees_median: of the scans reported LOCALIZED; None: there is
    none. alarm_share: UNCERTAIN or LOST at an error below CLOSE_M and CLOSE_RAD, of all scans. level_ratio: the median
    99.9 % level of the LOCALIZED scans over the 95 % quantile of their error, the largest of along, across and heading.
    time_to_alarm_s: the longest time from when the pose goes wrong (beyond RIGHT_M or RIGHT_RAD) until it is not
    LOCALIZED, or right again; time_back_s: until it is right and LOCALIZED; 0: it was never wrong, None: not before the
    end of the log.
    """
    used = claims.part(claims.matched)
    if not len(used.stamps_ns):
        return dict.fromkeys(METRICS)
    seconds = (used.stamps_ns - used.stamps_ns[0]) * 1e-9
    size = np.abs(used.error)
    position_m = np.hypot(size[:, 0], size[:, 1])
    misleading, localized = used.misleading, used.localized
    runs = rows_of(misleading)
    close = (position_m < CLOSE_M) & (size[:, 2] < CLOSE_RAD)
    wrong = (position_m > RIGHT_M) | (size[:, 2] > RIGHT_RAD)
    nees = used.nees[localized]
    nees = nees[~np.isnan(nees)]
    to_alarm, back = _delays(seconds, wrong, localized)
    figures: Dict[str, Optional[float]] = {
        "misleading_share": float(misleading.mean()),
        "misleading_max_s": max((_until_next(seconds, run) for run in runs), default=0.0),
        "misleading_max_m": max((_until_next(used.driven_m, run) for run in runs), default=0.0),
        "nees_median": float(np.median(nees)) if len(nees) else None,
        "alarm_share": float(np.mean(close & np.isin(used.states, _ALARMS))),
        "level_ratio": _level_ratio(used.level_999[localized], size[localized]),
        "time_to_alarm_s": to_alarm,
        "time_back_s": back,
    }
    return {name: None if value is None else _rounded(value) for name, value in figures.items()}


def _rounded(value: float) -> Optional[float]:
    """The value to 12 digits (the order of summation changes later ones); None if inf or NaN."""
    return float(f"{value:.12g}") if math.isfinite(value) else None


def rows_of(mask: np.ndarray) -> List[Tuple[int, int]]:
    """First and last index of each row of true values."""
    edges = np.diff(np.concatenate([[0], mask.astype(int), [0]]))
    return list(zip(np.nonzero(edges == 1)[0].tolist(), (np.nonzero(edges == -1)[0] - 1).tolist()))


def _until_next(values: np.ndarray, run: Tuple[int, int]) -> float:
    first, last = run
    return float(values[min(last + 1, len(values) - 1)] - values[first])


def _delays(seconds: np.ndarray, wrong: np.ndarray, localized: np.ndarray) -> Tuple[float, float]:
    """Longest time until an alarm, and until the pose is right again; inf: not before the end of the log."""
    to_alarm = back = 0.0
    for first, last in rows_of(wrong):
        over = np.nonzero(~localized[first : last + 1])[0]
        ends = first + over[0] if len(over) else last + 1
        to_alarm = max(to_alarm, seconds[ends] - seconds[first] if ends < len(seconds) else math.inf)
        again = np.nonzero(localized[first:] & ~wrong[first:])[0]
        back = max(back, seconds[first + again[0]] - seconds[first] if len(again) else math.inf)
    return to_alarm, back


def _level_ratio(level: np.ndarray, size: np.ndarray) -> Optional[float]:
    if not len(size):
        return None
    with np.errstate(invalid="ignore", divide="ignore"):
        return float(np.max(np.median(level, axis=0) / np.percentile(size, 95, axis=0)))


def _nees(error: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(S,), NaN where the error or the covariance is not known, infinite where the covariance is singular."""
    found = np.full(len(error), np.nan)
    finite = np.isfinite(error).all(axis=1)
    known = ~np.isnan(error).any(axis=1) & np.isfinite(covariance).all(axis=(1, 2))
    found[known] = np.inf
    values = np.linalg.eigvalsh(np.where((known & finite)[:, None, None], covariance, np.eye(3)))
    solvable = known & finite & (values[:, 0] > _SINGULAR * values[:, -1])
    if solvable.any():
        solved = np.linalg.solve(covariance[solvable], error[solvable][..., None])[..., 0]
        found[solvable] = np.einsum("si,si->s", error[solvable], solved)
    return found
