"""Errors of estimated poses against a reference, per scan and summarized.

S scans. A scan without a reference (outside the time it covers) has NaN errors and counts in no figure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict, Optional

import numpy as np

from glass_nav.geometry import angles
from glass_nav.geometry.trajectory import Trajectory

LOST_M = 0.5  # "lost" in the figures of a run
RIGHT_M, RIGHT_RAD = 0.7, np.radians(20.0)  # "right": the right room and the right direction
LOST_FAR_M = 1.0  # and by the stricter reading of the published ones
SLACK_NS = 1_000_000  # files of poses round their stamps; a scan that close to the ends is covered
METRICS = (  # of summary(), in its order
    "position_mean_m",
    "position_median_m",
    "position_rmse_m",
    "position_p95_m",
    "position_max_m",
    "yaw_mean_deg",
    "yaw_median_deg",
    "yaw_p95_deg",
    "lost_share",
    "lost_1m_share",
)


@dataclass(frozen=True)
class PoseErrors:
    """How far off each estimate is."""

    position_m: np.ndarray  # (S,) distance, NaN without a reference
    yaw_rad: np.ndarray  # (S,) absolute turn in [0, pi], NaN without a reference

    @property
    def matched(self) -> np.ndarray:
        """(S,) bool: there is a reference at that scan."""
        return ~np.isnan(self.position_m)


def of(stamps_ns: np.ndarray, estimates: np.ndarray, reference: Optional[Trajectory]) -> PoseErrors:
    """Errors (S,) of poses (S, 3) at stamps (S,), the reference interpolated at each stamp.

    An estimate that is not finite is infinitely far off, not without an error.
    """
    nothing = np.full(len(stamps_ns), np.nan)
    if reference is None or not len(reference) or not len(stamps_ns):
        return PoseErrors(nothing, nothing.copy())
    covered = reference.covers(stamps_ns, SLACK_NS)
    true = reference.at(stamps_ns)
    with np.errstate(invalid="ignore"):
        position = np.hypot(estimates[:, 0] - true[:, 0], estimates[:, 1] - true[:, 1])
        yaw = np.abs(angles.wrap(estimates[:, 2] - true[:, 2]))
    usable = np.isfinite(estimates).all(axis=1)
    return PoseErrors(
        np.where(covered, np.where(usable, position, np.inf), np.nan),
        np.where(covered, np.where(usable, yaw, np.pi), np.nan),
    )


def summary(errors: PoseErrors) -> Dict[str, Optional[float]]:
    """The figures of a run, under the names of metrics.json; None without any reference."""
    position, yaw = errors.position_m[errors.matched], np.degrees(errors.yaw_rad[errors.matched])
    if not len(position):
        return dict.fromkeys(METRICS)
    figures = {
        "position_mean_m": np.mean(position),
        "position_median_m": np.median(position),
        "position_rmse_m": np.sqrt(np.mean(position**2)),
        "position_p95_m": _percentile(position, 95),
        "position_max_m": np.max(position),
        "yaw_mean_deg": np.mean(yaw),
        "yaw_median_deg": np.median(yaw),
        "yaw_p95_deg": _percentile(yaw, 95),
        "lost_share": np.mean(position > LOST_M),
        "lost_1m_share": np.mean(position > LOST_FAR_M),
    }
    return {name: float(value) if math.isfinite(value) else None for name, value in figures.items()}


def _percentile(values: np.ndarray, percent: float) -> float:
    """Like np.percentile, but inf next to inf stays inf (its interpolation makes NaN of them)."""
    with np.errstate(invalid="ignore"):
        value = float(np.percentile(values, percent))
    return math.inf if math.isnan(value) else value
