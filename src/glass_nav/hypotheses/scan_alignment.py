"""Poses, scan -> the poses nearby where the scan fits the walls best.

Gauss-Newton on the squared distance of the beams' end points to the nearest wall, with a
Geman-McClure kernel that narrows from coarse to fine, so that people, furniture and mirrored echoes do
not pull. K poses are refined at once. The formulation is ours; the field is the likelihood field of
sensing/distance_field.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.geometry import angles
from glass_nav.sensing.distance_field import DistanceField

_FIT_SCALE_M = 0.1  # a beam that ends this far from a wall fits by one half
_KEEP = 4  # alignments that are different places
_AS_GOOD = 0.9  # of the best fit: worth particles
_SAME_M, _SAME_RAD = 0.05, np.radians(1.5)
_RIDGE = 1e-3  # keeps directions that no wall constrains where they are


@dataclass(frozen=True)
class Alignment:
    """K refined poses."""

    poses: np.ndarray  # (K, 3) in map
    information: np.ndarray  # (K, 3, 3) sum of J J^T over the beams that fit [1/m2 for 1 m of noise]
    fit: np.ndarray  # (K,) mean over beams of s^2 / (s^2 + d^2), 0..1


def align(
    field: DistanceField,
    points_m: np.ndarray,
    poses: np.ndarray,
    iterations: int = 6,
    first_scale_m: float = 0.3,
    last_scale_m: float = 0.06,
) -> Alignment:
    """Slide the scan along the field from each start.

    Args:
        field: distances to the walls.
        points_m: (B, 2) finite end points of the beams in the robot's frame.
        poses: (K, 3) starts in map.
        iterations: Gauss-Newton steps; the kernel's scale falls geometrically over them.
        first_scale_m, last_scale_m: scale of the kernel in the first and the last step.
    """
    poses = np.array(poses, float)
    x, y = points_m[:, 0], points_m[:, 1]
    shrink = (last_scale_m / first_scale_m) ** (1.0 / max(iterations - 1, 1))
    scale = first_scale_m
    for _ in range(iterations):
        distance, jacobian = _residuals(field, x, y, poses)
        information, gradient = _normal_equations(distance, jacobian, scale)
        step = np.linalg.solve(information + _RIDGE * len(x) * np.eye(3), gradient[..., None])[..., 0]
        poses -= step
        scale *= shrink
    poses[:, 2] = angles.wrap(poses[:, 2])
    distance, jacobian = _residuals(field, x, y, poses)
    information, _ = _normal_equations(distance, jacobian, last_scale_m)
    return Alignment(poses, information, np.mean(_FIT_SCALE_M**2 / (_FIT_SCALE_M**2 + distance**2), axis=1))


def align_near(
    field: DistanceField,
    points_m: np.ndarray,
    poses: np.ndarray,
    information: np.ndarray,
    iterations: int = 4,
    first_scale_m: float = 0.2,
    last_scale_m: float = 0.06,
) -> np.ndarray:
    """Slide the scan along the field, each start held back by prior information about it.

    Args:
        field, points_m, iterations, first_scale_m, last_scale_m: as for align().
        poses: (K, 3) starts in map.
        information: (3, 3) of the starts, in units of one beam's [1 / 1 m of noise].

    Returns:
        (K, 3) poses.
    """
    starts = np.asarray(poses, float)
    poses = starts.copy()
    x, y = points_m[:, 0], points_m[:, 1]
    shrink = (last_scale_m / first_scale_m) ** (1.0 / max(iterations - 1, 1))
    for iteration in range(iterations):
        distance, jacobian = _residuals(field, x, y, poses)
        of_beams, gradient = _normal_equations(distance, jacobian, first_scale_m * shrink**iteration)
        off = poses - starts
        off[:, 2] = angles.wrap(off[:, 2])
        poses -= np.linalg.solve(of_beams + information, (gradient + off @ information)[..., None])[..., 0]
    poses[:, 2] = angles.wrap(poses[:, 2])
    return poses


def fit(field: DistanceField, points_m: np.ndarray, poses: np.ndarray, scale_m: float = _FIT_SCALE_M) -> np.ndarray:
    """(K,) how well the scan fits at poses (K, 3), as Alignment.fit; a beam scale_m away from a wall by one half."""
    poses = np.asarray(poses, float)
    cos, sin = angles.cos_sin(poses[:, 2:])
    x, y = points_m[:, 0], points_m[:, 1]
    distance = field.distance(poses[:, :1] + cos * x - sin * y, poses[:, 1:2] + sin * x + cos * y)
    return np.mean(scale_m**2 / (scale_m**2 + distance**2), axis=1)


def median_distance(field: DistanceField, points_m: np.ndarray, pose: np.ndarray) -> float:
    """Median distance [m] of the beams' end points from the walls at one pose (3,)."""
    distance, _ = _residuals(field, points_m[:, 0], points_m[:, 1], pose[None])
    return float(np.median(distance))


def _residuals(
    field: DistanceField, x: np.ndarray, y: np.ndarray, poses: np.ndarray
) -> "tuple[np.ndarray, np.ndarray]":
    """Distances (K, B) and their derivatives (3, K, B) by the pose."""
    cos, sin = angles.cos_sin(poses[:, 2:])
    turned_x, turned_y = cos * x - sin * y, sin * x + cos * y
    distance, along_x, along_y = field.at(poses[:, :1] + turned_x, poses[:, 1:2] + turned_y)
    return distance, np.stack([along_x, along_y, along_y * turned_x - along_x * turned_y])


def _normal_equations(distance: np.ndarray, jacobian: np.ndarray, scale_m: float) -> "tuple[np.ndarray, np.ndarray]":
    """Information (K, 3, 3) and gradient (K, 3) with Geman-McClure weights."""
    weight = (scale_m**2 / (scale_m**2 + distance**2)) ** 2
    weighted = jacobian * weight
    information = np.einsum("ikb,jkb->kij", weighted, jacobian)
    return information, np.einsum("ikb,kb->ki", weighted, distance)


def distinct(aligned: Alignment) -> Alignment:
    """At most 4 different places that fit about as well as the best, best first."""
    chosen: "list[int]" = []
    for index in np.argsort(-aligned.fit):
        off = aligned.poses[chosen] - aligned.poses[index]
        same = (np.hypot(off[:, 0], off[:, 1]) < _SAME_M) & (np.abs(angles.wrap(off[:, 2])) < _SAME_RAD)
        if not same.any() and aligned.fit[index] > _AS_GOOD * aligned.fit.max():
            chosen.append(int(index))
        if len(chosen) == _KEEP:
            break
    return Alignment(aligned.poses[chosen], aligned.information[chosen], aligned.fit[chosen])
