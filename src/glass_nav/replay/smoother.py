"""All scans and odometry steps of a log -> the trajectory that they agree on best.

Maximum a posteriori smoothing on SE(2), by Gauss-Newton, after Thrun, Burgard, Fox, Probabilistic Robotics (2005), ch. 11:
odometry ties each pose to the next, the likelihood field of the map ties each scan to the walls. Both are robust
(Geman-McClure): people and glass do not pull, and a wheel that slipped gives way. A filter only knows the past; here
every pose also follows from what was seen later, which makes it a third opinion where there is no ground truth. It
starts from the filter's trajectory and finds the best one near it, so it does not correct a filter that was lost. S
scans, B beams of each.
"""

from __future__ import annotations

from typing import List, Tuple

import numpy as np
from scipy import linalg

from glass_nav.geometry import angles, se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.localization.localizer import Estimate
from glass_nav.recording.recording import Step
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import spread_evenly

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

    def listen(self, step: Step, estimate: Estimate) -> None:
        """One scan, with the filter's pose; of several lidars at one moment the first counts."""
        if self._stamps_ns and step.scan.stamp_ns <= self._stamps_ns[-1]:
            return
        self._stamps_ns.append(step.scan.stamp_ns)
        self._poses.append(estimate.map_from_base)
        self._odometry.append(step.odom_from_base)
        self._points_m.append(step.scan.points_in_base()[spread_evenly(step.scan.answered, _BEAMS)])

    def smooth(self) -> Trajectory:
        """map_from_base at the stamp of each scan.

        Raises:
            ValueError: listened to no scan.
        """
        if not self._stamps_ns:
            raise ValueError("a smoother needs at least one scan")
        poses, odometry = np.array(self._poses, float), np.array(self._odometry, float)
        points_m, present = self._padded()
        steps = se2.compose(se2.inverse(odometry[:-1]), odometry[1:])
        travelled = np.stack([np.ones(len(steps)), np.hypot(*steps[:, :2].T), np.abs(steps[:, 2])])
        sigma = (_STEP_SIGMA @ travelled).T  # (S - 1, 3)
        for scale_m in _SCALES_M:
            diagonal, gradient = _scan_terms(self._field, points_m, present, poses, float(scale_m))
            beside = _add_odometry(diagonal, gradient, poses, steps, sigma)
            poses = poses - _solved(diagonal, beside, gradient)
            poses[:, 2] = angles.wrap(poses[:, 2])
        return Trajectory(np.array(self._stamps_ns, np.int64), poses)

    def _padded(self) -> Tuple[np.ndarray, np.ndarray]:
        """(S, B, 2) points in the robot's frame, and (S, B) bool which of them there are."""
        points_m = np.zeros((len(self._points_m), _BEAMS, 2))
        present = np.zeros(points_m.shape[:2], bool)
        for row, points in enumerate(self._points_m):
            points_m[row, : len(points)] = points
            present[row, : len(points)] = True
        return points_m, present


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
    before, after = poses[:-1], poses[1:]
    cos, sin = np.cos(before[:, 2]), np.sin(before[:, 2])
    led = se2.compose(se2.inverse(before), after)
    off = led - steps
    off[:, 2] = angles.wrap(off[:, 2])
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
