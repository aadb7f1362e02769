"""Errors of relative motion over a distance and over a time, and the absolute error after alignment.

The definitions are evo's (Grupp, evo, https://github.com/MichaelGrupp/evo): its relative pose error (RPE) over all pairs
that are DISTANCE_M of the estimated path apart, to 10 %, or as many scans apart as TIME_S has; translation part and
rotation angle; and its absolute pose error (APE) after Umeyama's alignment without scale. An alignment moves all poses
alike and leaves relative errors as they are. N poses that have a reference, K pairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics.pose_errors import SLACK_NS
from glass_nav.geometry import angles, polyline, se2
from glass_nav.geometry.trajectory import Trajectory

DISTANCE_M, TIME_S = 1.0, 1.0
TOLERANCE = 0.1  # of the distance, as evo's rel_delta_tol
METRICS = (  # of summary(), in its order
    "relative_1m_rmse_m",
    "relative_1m_yaw_rmse_deg",
    "relative_1s_rmse_m",
    "relative_1s_yaw_rmse_deg",
    "aligned_rmse_m",
)


@dataclass(frozen=True)
class RelativeErrors:
    """Errors of the pairs."""

    position_m: np.ndarray  # (K,)
    yaw_rad: np.ndarray  # (K,) in [0, pi]


def summary(
    stamps_ns: np.ndarray, estimates: np.ndarray, reference: Optional[Trajectory]
) -> Dict[str, Optional[float]]:
    """The figures of poses (S, 3) at stamps (S,); None where no pair, or no reference, gives one.

    Estimates that are not finite are left out.
    """
    found: Dict[str, Optional[float]] = dict.fromkeys(METRICS)
    if reference is None or not len(reference):
        return found
    used = reference.covers(stamps_ns, SLACK_NS) & np.isfinite(estimates).all(axis=1)
    if np.count_nonzero(used) < 2:
        return found
    stamps_ns, estimates = stamps_ns[used], estimates[used]
    true = reference.at(stamps_ns)
    for name, pairs in (
        ("1m", pairs_by_distance(estimates, DISTANCE_M)),
        ("1s", pairs_by_frames(len(estimates), frames_in(stamps_ns, TIME_S))),
    ):
        if len(pairs[0]):
            errors = of(true, estimates, pairs)
            found[f"relative_{name}_rmse_m"] = _rms(errors.position_m)
            found[f"relative_{name}_yaw_rmse_deg"] = _rms(np.degrees(errors.yaw_rad))
    found["aligned_rmse_m"] = _rms(np.hypot(*(aligned(estimates, true) - true)[:, :2].T))
    return found


def of(true: np.ndarray, estimates: np.ndarray, pairs: Tuple[np.ndarray, np.ndarray]) -> RelativeErrors:
    """Errors of the motion between two poses, for pairs (K,), (K,) of indices into poses (N, 3)."""
    begin, end = pairs
    wanted = se2.compose(se2.inverse(true[begin]), true[end])
    moved = se2.compose(se2.inverse(estimates[begin]), estimates[end])
    error = se2.compose(se2.inverse(wanted), moved)
    return RelativeErrors(np.hypot(error[:, 0], error[:, 1]), np.abs(angles.wrap(error[:, 2])))


def pairs_by_distance(estimates: np.ndarray, distance_m: float) -> Tuple[np.ndarray, np.ndarray]:
    """For each pose (N, 3) the one whose path from there is nearest to a distance, if it is within TOLERANCE of it."""
    path_m = polyline.distances_along(estimates[:, :2])
    begin = np.arange(len(path_m) - 1)
    after = np.clip(np.searchsorted(path_m, path_m[:-1] + distance_m), begin + 1, len(path_m) - 1)
    before = np.maximum(np.searchsorted(path_m, path_m[np.maximum(after - 1, begin + 1)]), begin + 1)  # first of equals
    off_after, off_before = (np.abs(path_m[end] - path_m[begin] - distance_m) for end in (after, before))
    end = np.where(off_before <= off_after, before, after)
    kept = np.minimum(off_before, off_after) <= TOLERANCE * distance_m
    return begin[kept], end[kept]


def pairs_by_frames(count: int, frames: int) -> Tuple[np.ndarray, np.ndarray]:
    """All pairs of `count` poses that are this number of scans apart."""
    begin = np.arange(max(count - frames, 0))
    return begin, begin + frames


def frames_in(stamps_ns: np.ndarray, time_s: float) -> int:
    """How many poses a time has, by the median from stamp (N,) to stamp; at least 1."""
    return max(1, round(1e9 * time_s / max(float(np.median(np.diff(stamps_ns))), 1.0)))


def aligned(estimates: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Poses (N, 3) moved as one so that their positions are as near to the true ones as can be (least squares).

    Umeyama, Least-squares estimation of transformation parameters between two point patterns (1991), in the plane.
    """
    centres = estimates[:, :2].mean(axis=0), true[:, :2].mean(axis=0)
    from_m, to_m = estimates[:, :2] - centres[0], true[:, :2] - centres[1]
    yaw = float(np.arctan2((from_m[:, 0] * to_m[:, 1] - from_m[:, 1] * to_m[:, 0]).sum(), (from_m * to_m).sum()))
    turn = np.array([0.0, 0.0, yaw])
    shift = np.append(centres[1] - se2.transform_points(turn, centres[0][None])[0], yaw)
    moved: np.ndarray = se2.compose(shift, estimates)
    return moved


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
