"""Aligns a scan to the nearest walls, from many poses at once.

Gauss-Newton on the squared distance of the beams' end points to the nearest wall, with a Geman-McClure kernel that
narrows from coarse to fine, so that people, furniture and mirrored echoes have little influence. K poses are refined
at once; the steps are in the compiled module _distance_field. The formulation is ours; the field is the likelihood
field of sensing/distance_field.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List

import numpy as np

from glass_nav import _distance_field
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
    damping = _RIDGE * len(points_m)
    aligned = _distance_field.slid(
        field.compiled, points_m, poses, np.zeros((3, 3)), damping, iterations, first_scale_m, last_scale_m
    )
    return at(field, points_m, aligned, last_scale_m)


def at(field: DistanceField, points_m: np.ndarray, poses: np.ndarray, scale_m: float) -> Alignment:
    """Poses (K, 3) as they are, with the information of the scan there; scale_m of the kernel."""
    information = _distance_field.information(field.compiled, points_m, poses, scale_m)
    return Alignment(poses, information, fit(field, points_m, poses))


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
    return _distance_field.slid(
        field.compiled, points_m, poses, information, 0.0, iterations, first_scale_m, last_scale_m
    )


def fit(field: DistanceField, points_m: np.ndarray, poses: np.ndarray, scale_m: float = _FIT_SCALE_M) -> np.ndarray:
    """(K,) how well the scan fits at poses (K, 3), as Alignment.fit; a beam scale_m away from a wall by one half."""
    return _distance_field.fit(field.compiled, points_m, poses, scale_m)


def distinct(aligned: Alignment) -> Alignment:
    """At most 4 different places that fit about as well as the best, best first."""
    left = np.argsort(-aligned.fit)
    left = left[aligned.fit[left] > _AS_GOOD * aligned.fit.max(initial=0.0)]
    chosen: List[int] = []
    while len(left) and len(chosen) < _KEEP:
        best, left = left[0], left[1:]
        chosen.append(best)
        off = aligned.poses[left] - aligned.poses[best]
        same = (np.hypot(off[:, 0], off[:, 1]) < _SAME_M) & (np.abs(angles.wrap(off[:, 2])) < _SAME_RAD)
        left = left[~same]
    return Alignment(aligned.poses[chosen], aligned.information[chosen], aligned.fit[chosen])
