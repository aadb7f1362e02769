"""Smooths a trajectory over all scans and odometry steps of a log.

Maximum a posteriori smoothing on SE(2), by Gauss-Newton, after Thrun, Burgard, Fox, Probabilistic Robotics (2005), ch. 11:
odometry ties each pose to the next, the likelihood field of the map ties each scan to the walls. Both are robust
(Geman-McClure): people and glass do not pull, and a wheel that slipped gives way. A filter only knows the past; here
every pose also follows from what was seen later, which makes it a third opinion where there is no ground truth. It
starts from the filter's trajectory and finds the best one near it, so it does not correct a filter that was lost.

Where poses have to be right, only the scans whose poses the filter was sure of pull (smooth_sure). Odometry leads from one
sure stretch to the next, and the covariance says how far it can be trusted. Where panes that the map lacks have been found,
scans between pull too, towards them. S scans, B beams of each.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Tuple

import numpy as np
from scipy import linalg

from glass_nav.geometry import angles, se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.localization.localizer import Estimate
from glass_nav.recording.recording import Step
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import spread_evenly
from glass_nav.vocabulary import LocalizationState

_BEAMS = 60
_BEAM_SIGMA_M = 0.17  # 60 beams are worth 20 independent ones of 0.1 m
_SCALES_M = np.geomspace(0.3, 0.08, 12)  # of the beams' kernel, in the order of the iterations
_STEP_SIGMA = np.array(
    [
        [0.003, 0.03, 0.0],  # deviations of odometry: a base, per metre, per radian of the step
        [0.003, 0.03, 0.0],  # (x, y [m]; yaw [rad])
        [0.002, 0.01, 0.03],
    ]
)
_STEP_SCALE = 3.0  # deviations at which a step of odometry has lost half of its pull
_RIDGE = 1e-6
_WHEELS_OFF = 2.0  # deviations by which a stretch of odometry may be off and be trusted like its steps
_TRUTH_SIGMA = np.array([0.03, 0.03, 0.01])  # of a reference, where no scan is sure
_TRUTH_OFF_M = 0.3  # a reference that is farther from sure poses (median) belongs to another map
# So does one along which hardly a scan fits: of the best tenth of the scans, half the beams end at mapped walls.
_AT_WALL_M, _FIT, _FITTING_SCANS = 0.15, 0.5, 0.1


@dataclass(frozen=True)
class SmoothedPoses:
    """Poses that follow from all that is sure in a log."""

    trajectory: Trajectory  # map_from_base at the stamps of the scans
    covariance: np.ndarray  # (S, 3, 3)

    @property
    def deviation_m(self) -> np.ndarray:
        """(S,) of x or y, the larger."""
        variance: np.ndarray = self.covariance[:, [0, 1], [0, 1]].max(axis=1)
        return np.sqrt(variance)

    def at(self, stamp_ns: int) -> Tuple[np.ndarray, np.ndarray]:
        """Pose (3,) at a stamp, and the covariance (3, 3) of the nearest scan."""
        stamps_ns = self.trajectory.stamps_ns
        after = min(int(np.searchsorted(stamps_ns, stamp_ns)), len(stamps_ns) - 1)
        before = max(after - 1, 0)
        nearest = before if stamp_ns - stamps_ns[before] < stamps_ns[after] - stamp_ns else after
        return self.trajectory.at(stamp_ns), self.covariance[nearest]


class Smoother:
    """Listens to a replay, then smooths it."""

    def __init__(self, field: DistanceField) -> None:
        """
        Args:
            field: of the map.
        """
        self._field = field
        self._stamps_ns: List[int] = []
        self._poses: List[np.ndarray] = []
        self._odometry: List[np.ndarray] = []
        self._points_m: List[np.ndarray] = []
        self._sure: List[bool] = []

    def listen(self, step: Step, estimate: Estimate) -> None:
        """Adds a scan with the filter's pose; of several lidars at one moment, only the first."""
        if self._stamps_ns and step.scan.stamp_ns <= self._stamps_ns[-1]:
            return
        self._stamps_ns.append(step.scan.stamp_ns)
        self._poses.append(estimate.map_from_base)
        self._odometry.append(step.odom_from_base)
        self._points_m.append(step.scan.points_in_base()[spread_evenly(step.scan.answered, _BEAMS)])
        self._sure.append(estimate.state == LocalizationState.LOCALIZED)

    def smooth(self) -> Trajectory:
        """map_from_base at the stamp of each scan.

        Raises:
            ValueError: listened to no scan.
        """
        if not self._stamps_ns:
            raise ValueError("a smoother needs at least one scan")
        points_m, present = self._padded()
        poses, odometry = np.array(self._poses, float), np.array(self._odometry, float)
        poses, _ = _optimized(self._field, points_m, present, poses, odometry, np.zeros((len(poses), 3)), poses)
        return Trajectory(np.array(self._stamps_ns, np.int64), poses)

    def __len__(self) -> int:
        return len(self._stamps_ns)

    @property
    def is_sure(self) -> bool:
        """Whether the filter was sure of every pose."""
        return all(self._sure)

    def smooth_sure(
        self, truth: Optional[Trajectory] = None, with_panes: Optional[Tuple[DistanceField, SmoothedPoses]] = None
    ) -> Optional[SmoothedPoses]:
        """What the scans of state LOCALIZED and odometry between them say; of the other scans only the stamps count.

        Args:
            truth: map_from_base of a reference, which counts where no scan is sure.
            with_panes: field of the map with what was found at the poses beside it: all scans pull whose poses were
                certain enough to tell which wall or pane a beam met.

        Returns:
            None where no pose is sure, and there is no reference.
        """
        sure, poses, odometry = (
            np.array(self._sure, bool),
            np.array(self._poses, float),
            np.array(self._odometry, float),
        )
        stamps_ns = np.array(self._stamps_ns, np.int64)
        points_m, present = self._padded()
        known, prior, information = sure.copy(), poses.copy(), np.zeros((len(poses), 3))
        if truth is not None and _agrees(truth, stamps_ns, poses, sure, self._field, points_m, present):
            given = truth.covers(stamps_ns) & ~sure
            prior[given], information[given], known[given] = truth.at(stamps_ns[given]), _TRUTH_SIGMA**-2.0, True
        if not known.any():
            return None
        field, pulls = self._field, sure
        if with_panes is not None:
            field, pulls = with_panes[0], sure | (with_panes[1].deviation_m < _SCALES_M[0])
        reckoned = _reckoned(prior, known, odometry)
        poses, covariance = _optimized(
            field, points_m, present & pulls[:, None], reckoned, odometry, information, prior
        )
        covariance *= _contradiction(poses, odometry, known)[:, None, None]
        return SmoothedPoses(Trajectory(stamps_ns, poses), covariance)

    def _padded(self) -> Tuple[np.ndarray, np.ndarray]:
        """(S, B, 2) points in the robot's frame, and (S, B) bool which of them there are."""
        points_m = np.zeros((len(self._points_m), _BEAMS, 2))
        present = np.zeros(points_m.shape[:2], bool)
        for row, points in enumerate(self._points_m):
            points_m[row, : len(points)] = points
            present[row, : len(points)] = True
        return points_m, present


def _optimized(
    field: DistanceField,
    points_m: np.ndarray,
    present: np.ndarray,
    poses: np.ndarray,
    odometry: np.ndarray,
    information: np.ndarray,
    prior: np.ndarray,
) -> Tuple[np.ndarray, np.ndarray]:
    """The most probable poses (S, 3), and their covariances (S, 3, 3).

    Args:
        field: of the map.
        points_m: (S, B, 2) where beams ended, in the robot's frame.
        present: (S, B) bool, which of them count.
        poses: (S, 3) to start from.
        odometry: (S, 3) odom_from_base.
        information: (S, 3) of what is known of x, y and yaw beforehand; 0: nothing.
        prior: (S, 3) that.
    """
    steps, sigma = _odometry_steps(odometry)
    for scale_m in _SCALES_M:
        diagonal, gradient = _scan_terms(field, points_m, present, poses, float(scale_m))
        off = poses - prior
        off[:, 2] = angles.wrap(off[:, 2])
        diagonal += information[:, :, None] * np.eye(3)
        gradient += information * off
        beside = _add_odometry(diagonal, gradient, poses, steps, sigma)
        poses = poses - _solved(diagonal, beside, gradient)
        poses[:, 2] = angles.wrap(poses[:, 2])
    return poses, _covariances(diagonal, beside)


def _agrees(
    truth: Trajectory,
    stamps_ns: np.ndarray,
    poses: np.ndarray,
    sure: np.ndarray,
    field: DistanceField,
    points_m: np.ndarray,
    present: np.ndarray,
) -> bool:
    """Whether a reference is of this map: it is where the filter was sure to be or, where it never was, scans fit there.

    Args:
        truth: map_from_base of the reference.
        stamps_ns: (S,) of the scans.
        poses: (S, 3) of the filter.
        sure: (S,) bool which of them are sure.
        field: of the map.
        points_m: (S, B, 2) where beams ended, in the robot's frame.
        present: (S, B) bool, which of them count.
    """
    covered = truth.covers(stamps_ns)
    compared = covered & sure
    if compared.any():
        off_m = np.hypot(*(truth.at(stamps_ns[compared]) - poses[compared])[:, :2].T)
        return float(np.median(off_m)) <= _TRUTH_OFF_M
    if not covered.any():
        return False
    ends_m = se2.transform_points(truth.at(stamps_ns[covered])[:, None], points_m[covered])
    at_wall = present[covered] & (field.at(ends_m[..., 0], ends_m[..., 1])[0] <= _AT_WALL_M)
    share = at_wall.sum(axis=1) / np.maximum(present[covered].sum(axis=1), 1)
    return float(np.quantile(share, 1.0 - _FITTING_SCANS)) >= _FIT


def _reckoned(poses: np.ndarray, known: np.ndarray, odometry: np.ndarray) -> np.ndarray:
    """(S, 3) the known poses, and between them odometry from the one before and from the one after, blended.

    Args:
        poses: (S, 3).
        known: (S,) bool which of them are; at least one.
        odometry: (S, 3) odom_from_base.
    """
    numbers, anchors = np.arange(len(poses)), np.flatnonzero(known)
    before = anchors[np.maximum(np.searchsorted(anchors, numbers, side="right") - 1, 0)]
    after = anchors[np.minimum(np.searchsorted(anchors, numbers), len(anchors) - 1)]
    from_before, from_after = (
        se2.compose(poses[anchor], se2.compose(se2.inverse(odometry[anchor]), odometry)) for anchor in (before, after)
    )
    share = np.where(after > before, (numbers - before) / np.maximum(after - before, 1), 0.0)[:, None]
    gap = from_after - from_before
    gap[:, 2] = angles.wrap(gap[:, 2])
    return from_before + share * gap


def _contradiction(poses: np.ndarray, odometry: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(S,) factors >= 1 on the covariance of poses between known ones: how much more than its noise odometry is off.

    Along one stretch, three numbers are over-determined: where it ends, seen from where it begins (Birge ratio). Wheels of
    a wrong size are off by more than the noise of the steps, but evenly, which the smoothing takes back.
    """
    steps, sigma = _odometry_steps(odometry)
    chi2 = np.sum((_steps_off(poses, steps) / sigma) ** 2, axis=1)
    stretch = np.cumsum(known)  # of each pose, and of the step that begins there
    factor = np.maximum(1.0, np.bincount(stretch[:-1], chi2, minlength=stretch[-1] + 1) / (3.0 * _WHEELS_OFF**2))
    return np.where(known, 1.0, factor[stretch])


def _odometry_steps(odometry: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """(S - 1, 3) steps, each in the robot's frame before it, and their deviations (S - 1, 3)."""
    steps = se2.compose(se2.inverse(odometry[:-1]), odometry[1:])
    length_m = np.hypot(steps[:, 0], steps[:, 1])
    travelled = np.stack([np.ones(len(steps)), length_m, np.abs(steps[:, 2])])
    return steps, (_STEP_SIGMA @ travelled).T


def _steps_off(poses: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """(S - 1, 3) how far the steps between poses are from those of odometry."""
    off = se2.compose(se2.inverse(poses[:-1]), poses[1:]) - steps
    off[:, 2] = angles.wrap(off[:, 2])
    return off


def _covariances(diagonal: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """(S, 3, 3) diagonal blocks of the inverse of the block tridiagonal information, see _solved()."""
    diagonal = diagonal + _RIDGE * np.eye(3)
    before, after = np.zeros_like(diagonal), np.zeros_like(diagonal)  # what the poses before and after take away
    for pose in range(1, len(diagonal)):
        link = beside[pose - 1]
        before[pose] = link @ np.linalg.solve(diagonal[pose - 1] - before[pose - 1], link.T)
    for pose in range(len(diagonal) - 2, -1, -1):
        link = beside[pose]
        after[pose] = link.T @ np.linalg.solve(diagonal[pose + 1] - after[pose + 1], link)
    covariance: np.ndarray = np.linalg.inv(diagonal - before - after)
    return covariance


def _scan_terms(
    field: DistanceField, points_m: np.ndarray, present: np.ndarray, poses: np.ndarray, scale_m: float
) -> Tuple[np.ndarray, np.ndarray]:
    """Information (S, 3, 3) and gradient (S, 3) of the scans: distances of the beams' ends from the walls."""
    cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    x, y = points_m[..., 0], points_m[..., 1]
    turned_x, turned_y = cos * x - sin * y, sin * x + cos * y
    distance, along_x, along_y = field.at(poses[:, :1] + turned_x, poses[:, 1:2] + turned_y)
    jacobian = np.stack([along_x, along_y, along_y * turned_x - along_x * turned_y], axis=-1)  # (S, B, 3)
    weight = present * (scale_m**2 / (scale_m**2 + distance**2)) ** 2 / _BEAM_SIGMA_M**2
    weighted = jacobian * weight[..., None]
    return np.einsum("sbi,sbj->sij", weighted, jacobian), np.einsum("sbi,sb->si", weighted, distance)


def _add_odometry(
    diagonal: np.ndarray, gradient: np.ndarray, poses: np.ndarray, steps: np.ndarray, sigma: np.ndarray
) -> np.ndarray:
    """Adds the steps (S - 1, 3) of odometry to the information and the gradient of the scans; the information (S - 1, 3, 3)
    between each pose and the next.
    """
    before = poses[:-1]
    cos, sin = np.cos(before[:, 2]), np.sin(before[:, 2])
    off = _steps_off(poses, steps)
    led = off + steps
    weight = (_STEP_SCALE**2 / (_STEP_SCALE**2 + np.sum((off / sigma) ** 2, axis=1))) ** 2
    information = weight[:, None] / sigma**2  # (S - 1, 3)
    by_after = np.zeros((len(steps), 3, 3))
    by_after[:, 0, 0], by_after[:, 0, 1] = cos, sin
    by_after[:, 1, 0], by_after[:, 1, 1] = -sin, cos
    by_after[:, 2, 2] = 1.0
    by_before = -by_after
    by_before[:, 0, 2], by_before[:, 1, 2] = led[:, 1], -led[:, 0]
    diagonal[:-1] += np.einsum("ski,sk,skj->sij", by_before, information, by_before)
    diagonal[1:] += np.einsum("ski,sk,skj->sij", by_after, information, by_after)
    gradient[:-1] += np.einsum("ski,sk,sk->si", by_before, information, off)
    gradient[1:] += np.einsum("ski,sk,sk->si", by_after, information, off)
    return np.einsum("ski,sk,skj->sij", by_after, information, by_before)


def _solved(diagonal: np.ndarray, beside: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """(S, 3) solution of the block tridiagonal system; beside[i] (3, 3) is in the rows of pose i + 1, columns of pose i."""
    count = len(diagonal)
    banded = np.zeros((6, 3 * count))  # banded[i - j, j]: row i, column j, lower half
    for row in range(3):
        for column in range(3):
            if row >= column:
                banded[row - column, column::3] = diagonal[:, row, column]
            banded[3 + row - column, column : 3 * (count - 1) : 3] = beside[:, row, column]
    banded[0] += _RIDGE
    return linalg.solveh_banded(banded, gradient.ravel(), lower=True).reshape(-1, 3)
