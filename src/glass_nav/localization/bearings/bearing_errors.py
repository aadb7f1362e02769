"""Errors of positions from bearings: limits by the step angle, covariance, standard deviation over a map.

Seed document landmark_bearings.txt (Tsukiyama 2009), sec. 3: an emitter that turns in steps measures the angle between
two landmarks with an error of up to one step; Tables 1 and 2 list the position errors of one triple at these limits and
halfway to them. To first order a bearing error moves the position more if the landmarks are farther away or closer
together, or if the robot is nearer to the circle through them. M points, N landmarks.
"""

from __future__ import annotations

import numpy as np

from glass_nav.geometry import angles
from glass_nav.localization.bearings import inscribed_circles
from glass_nav.sensing import bearing_model, bearings
from glass_nav.world.landmark_map import LandmarkMap

STEPS = (-1.0, -0.5, 0.0, 0.5, 1.0)  # of the document's tables
MAX_STEP_DEG = 45.0
_LEAST_STEP_RAD = 1e-6  # no emitter has such steps


def step_sigma(step_rad: float) -> float:
    """Standard deviation [rad] of a bearing read in steps: uniform within half a step to either side."""
    return step_rad / float(np.sqrt(12.0))


def limits_of_error(landmarks_m: np.ndarray, point_m: np.ndarray, step_rad: float) -> np.ndarray:
    """The document's table: position errors if the two angles between three landmarks are wrong.

    Args:
        landmarks_m: (3, 2) in map.
        point_m: (2,) where the robot is.
        step_rad: the largest error of an angle between two landmarks.

    Returns:
        (5, 5) [m]: by rows the angle between the first two is off by STEPS of step_rad, by columns the one between the
        last two; inf where these angles fix no position.

    Raises:
        ValueError: two of the landmarks, or one and the robot, are at one place.
    """
    landmarks_m = np.asarray(landmarks_m, float)
    places = np.vstack([landmarks_m, point_m])
    if len(np.unique(places, axis=0)) < len(places):
        raise ValueError(f"the three landmarks and the robot must be at four places, got {places.tolist()}")
    sight_m = landmarks_m - point_m
    first, second = np.meshgrid(np.array(STEPS) * step_rad, np.array(STEPS) * step_rad, indexing="ij")
    direction = np.arctan2(sight_m[:, 1], sight_m[:, 0]) + np.stack([-first, np.zeros_like(first), second], axis=-1)
    poses, _ = inscribed_circles.intersect(np.broadcast_to(landmarks_m, (25, 3, 2)), direction.reshape(25, 3))
    error_m = np.hypot(*(poses[:, :2] - point_m).T).reshape(5, 5)
    return np.where(np.isfinite(error_m), error_m, np.inf)


def angles_between(landmarks_m: np.ndarray, point_m: np.ndarray) -> np.ndarray:
    """(2,) angles from each of three landmarks (3, 2) to the next, as seen from a point (2,), in (-pi, pi]."""
    sight_m = np.asarray(landmarks_m, float) - point_m
    return angles.wrap(np.diff(np.arctan2(sight_m[:, 1], sight_m[:, 0])))


def largest_step(landmarks_m: np.ndarray, point_m: np.ndarray, within_m: float) -> float:
    """The largest step [rad] whose limits_of_error() stay within a limit; by bisection, at most MAX_STEP_DEG.

    Raises:
        ValueError: as limits_of_error(), or no step keeps the limit: the robot is on the circle through the landmarks.
    """
    low, high = 0.0, float(np.radians(MAX_STEP_DEG))
    if limits_of_error(landmarks_m, point_m, high).max() <= within_m:
        return high
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        if limits_of_error(landmarks_m, point_m, middle).max() <= within_m:
            low = middle
        else:
            high = middle
        if high < _LEAST_STEP_RAD:
            raise ValueError(
                f"no step keeps the error within {within_m:g} m: the robot is on the circle through the landmarks"
            )
    return low


def covariance(landmarks: LandmarkMap, map_from_base: np.ndarray, sigma_rad: float) -> np.ndarray:
    """(3, 3) of x [m], y [m], yaw [rad] of a robot at a pose (3,) that sees all of the landmarks.

    To first order: the inverse of the information of the bearings, which includes the landmarks' uncertainty.

    Raises:
        ValueError: the landmarks do not fix the pose.
    """
    sight_m = landmarks.positions_m - map_from_base[:2]
    seen = bearing_model.sightings(
        bearings.standing(landmarks.ids, np.arctan2(sight_m[:, 1], sight_m[:, 0]), sigma_rad), landmarks
    )
    by_pose = bearing_model.jacobian(seen, np.asarray(map_from_base, float), sight_m)
    information = (by_pose / bearing_model.variances(seen, sight_m)[:, None]).T @ by_pose
    if np.linalg.matrix_rank(information) < 3:
        raise ValueError(
            f"{len(landmarks)} landmarks do not fix the pose at x {map_from_base[0]:.2f} m, "
            f"y {map_from_base[1]:.2f} m: three are needed that are not on one circle with it"
        )
    return np.linalg.inv(information)


def information_sums(
    points_m: np.ndarray, positions_m: np.ndarray, visible: np.ndarray, sigma_rad: float, place_sigma_m: float = 0.0
) -> np.ndarray:
    """Terms of sigma_from_sums(), to be summed over landmarks: one more landmark is one addition.

    Args:
        points_m: (M, 2).
        positions_m: (N, 2) of landmarks.
        visible: (M, N) bool.
        sigma_rad: of a bearing.
        place_sigma_m: of the landmarks' positions.

    Returns:
        (M, N, 6): weight, weighted gradient gx, gy of the bearing by x and y, and gx gx, gx gy, gy gy; 0 where hidden.
    """
    sight_m = positions_m - points_m[:, None]
    range2 = np.maximum((sight_m**2).sum(axis=-1), 1e-4)
    gradient = np.stack([sight_m[..., 1], -sight_m[..., 0]], axis=-1) / range2[..., None]
    weight = np.where(visible, 1.0 / (sigma_rad**2 + place_sigma_m**2 / range2), 0.0)
    gx, gy = gradient[..., 0], gradient[..., 1]
    return np.stack([weight, weight * gx, weight * gy, weight * gx * gx, weight * gx * gy, weight * gy * gy], axis=-1)


def sigma_from_sums(sums: np.ndarray) -> np.ndarray:
    """(...) largest standard deviation of the position [m] from information_sums() (..., 6), summed over the landmarks.

    inf where the landmarks do not fix a position. The unknown heading's share of the information is subtracted
    (Schur complement).
    """
    total = np.where(sums[..., 0] > 0.0, sums[..., 0], 1.0)
    xx = sums[..., 3] - sums[..., 1] * sums[..., 1] / total
    xy = sums[..., 4] - sums[..., 1] * sums[..., 2] / total
    yy = sums[..., 5] - sums[..., 2] * sums[..., 2] / total
    least = 0.5 * (xx + yy) - np.hypot(0.5 * (xx - yy), xy)  # eigenvalue of the position's information
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(least > 1e-9 * np.maximum(xx + yy, 1e-30), 1.0 / np.sqrt(least), np.inf)


def expected_sigma(landmarks: LandmarkMap, points_m: np.ndarray, visible: np.ndarray, sigma_rad: float) -> np.ndarray:
    """(M,) standard deviation [m] of the position along its worst direction at points (M, 2); inf without a fix.

    Args:
        landmarks: N of them.
        points_m: (M, 2).
        visible: (M, N) bool: the landmark is visible from the point.
        sigma_rad: of a bearing.
    """
    sums = information_sums(points_m, landmarks.positions_m, visible, sigma_rad, landmarks.sigma_m).sum(axis=1)
    return np.where(visible.sum(axis=1) >= 3, sigma_from_sums(sums), np.inf)
