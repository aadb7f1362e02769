"""Corrects a rough pose by a scan and wall segments, and measures the fit: Emse, Ecf and both combined.

Seed document segment_localization.txt, after MacKenzie and Dudek, Precise positioning using model-based maps (ICRA
1994). Each end point of a beam belongs to the nearest segment and pulls the robot perpendicular to that segment's
line. Nearer points pull harder, and the neighbourhood c of points that count shrinks: c(t) = c(0) (1 - t / T). The
document's formulas are lost in the transcript; the sigmoid c^m / (d^m + c^m) with m = 2 is given in words.

`method: document` moves by the weighted mean of the perpendicular displacements, all points together. The
document leaves open how to correct the orientation; ours (`correct_orientation`) turns the robot after each move by
weighted least squares of the residuals. `method: least_squares` solves for x, y and yaw at once and does not move along
directions that no segment constrains: the document's hallway effect, for walls of any direction.

The quality measures use neighbourhoods of their own: Ecf has classification_neighbourhood_m, whatever the iterations
were. Combined quality, ours too: Ecf s^2 / (s^2 + Emse) over all points, so that it falls with the distance from the
true pose. N points, S segments.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np

from glass_nav.geometry import angles
from glass_nav.geometry.segment_index import SegmentIndex

METHODS = ("least_squares", "document")
STEEPNESS = 2  # m of the document
_ALL_FREE = np.eye(3)


@dataclass(frozen=True)
class SegmentCorrectionParams:
    """How a pose is corrected and judged."""

    method: str = "least_squares"
    neighbourhood_m: float = 1.0  # c(0)
    iterations: int = 15  # T
    correct_orientation: bool = True
    least_constraint: float = 0.01  # share of the points' pull below which a direction is not corrected
    classification_neighbourhood_m: float = 0.07  # c of the classification factor, and of the directions left free
    outlier_m: float = 0.15  # a point further from its segment is an outlier
    fit_scale_m: float = 0.05  # s: root of Emse at which the combined quality halves

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method must be one of {', '.join(METHODS)}, got {self.method!r}")
        for name in ("neighbourhood_m", "classification_neighbourhood_m", "outlier_m", "fit_scale_m"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ValueError(f"{name} must be finite and > 0 m, got {getattr(self, name)}")
        if not self.iterations >= 1:
            raise ValueError(f"iterations must be >= 1, got {self.iterations}")
        if not 0.0 < self.least_constraint < 1.0:
            raise ValueError(f"least_constraint must be in (0, 1), got {self.least_constraint}")


@dataclass(frozen=True)
class SegmentQuality:
    """How well end points lie on segments at one pose."""

    points: int  # finite ones
    mse_m2: float  # Emse: mean squared distance of all points; NaN: no points, inf: no segments
    mse_inliers_m2: float  # Emse of points within the outlier limit; NaN: none
    inlier_share: float  # 0..1
    classification_factor: float  # Ecf: mean of c^m / (d^m + c^m), 0..1; 0 without points or segments
    combined: float  # Ecf s^2 / (s^2 + Emse), 0..1


@dataclass(frozen=True)
class SegmentCorrection:
    """A pose moved onto the walls."""

    map_from_base: np.ndarray  # (3,) corrected pose
    before: SegmentQuality  # at the pose given
    after: SegmentQuality  # at the corrected one
    free: np.ndarray  # (K, 3) orthonormal directions of x [m], y [m], yaw [lever m] that no segment constrains
    lever_m: float  # length by which free scales yaw to a distance; 0: no points

    @property
    def free_heading_rad(self) -> Optional[float]:
        """Direction of the map in which the position is unconstrained, in [0, pi); None: no or every direction."""
        shifts = self.free[:, :2]
        if len(self.free) != 1 or float(np.hypot(*shifts[0])) < 0.5:
            return None
        return float(np.mod(np.arctan2(shifts[0, 1], shifts[0, 0]), np.pi))


class SegmentCorrector:
    """The walls of one map, prepared for correcting many poses."""

    def __init__(self, segments_m: np.ndarray, params: SegmentCorrectionParams = SegmentCorrectionParams()) -> None:
        """
        Args:
            segments_m: (S, 4) x1 y1 x2 y2 [m] in map, as world/wall_segments.py gives them; S = 0 is allowed.
            params: how to correct.

        Raises:
            ValueError: invalid segments.
        """
        self._index = SegmentIndex(segments_m)
        self._params = params

    def correct(self, points_m: np.ndarray, map_from_base: np.ndarray) -> SegmentCorrection:
        """Move a rough pose so that the end points lie on the segments.

        Args:
            points_m: (N, 2) end points of beams in the robot's frame; rows that are not finite are left out.
            map_from_base: (3,) rough pose.

        Raises:
            ValueError: a pose that is not finite, points of another shape.
        """
        points = _finite(points_m)
        pose = np.array(map_from_base, float)
        if pose.shape != (3,) or not np.all(np.isfinite(pose)):
            raise ValueError(f"a rough pose needs finite x, y, yaw, got {map_from_base}")
        if not len(points) or not len(self._index):
            nothing = self._judge(points, pose)
            return SegmentCorrection(pose, nothing, nothing, _ALL_FREE, 0.0)
        lever_m = max(float(np.sqrt(np.mean(np.sum(points**2, axis=1)))), 1e-6)
        pull = self._pull(points, pose)
        before = self._judged(pull.distance_m)
        step = self._least_squares_step if self._params.method == "least_squares" else self._document_step
        for neighbourhood_m in self._neighbourhoods_m():
            pose = step(points, pose, pull, neighbourhood_m, lever_m)
            pull = self._pull(points, pose)
        pose[2] = angles.wrap(pose[2])
        weight = votes(pull.distance_m, self._params.classification_neighbourhood_m)
        information, _ = _normal_equations(pull, weight, lever_m)
        _, free = _constrained(information, float(weight.sum()), self._params.least_constraint)
        return SegmentCorrection(pose, before, self._judged(pull.distance_m), free, lever_m)

    def quality(self, points_m: np.ndarray, map_from_base: np.ndarray) -> SegmentQuality:
        """How well end points (N, 2) in the robot's frame fit at a pose (3,), without moving it."""
        return self._judge(_finite(points_m), np.asarray(map_from_base, float))

    def _neighbourhoods_m(self) -> np.ndarray:
        """(T,) c(t) = c(0) (1 - t / T)."""
        return self._params.neighbourhood_m * (1.0 - np.arange(self._params.iterations) / self._params.iterations)

    def _judge(self, points: np.ndarray, pose: np.ndarray) -> SegmentQuality:
        if not len(points):
            return SegmentQuality(0, float("nan"), float("nan"), 0.0, 0.0, 0.0)
        return self._judged(self._index.nearest(_placed(points, pose)[0]).distance)

    def _judged(self, distance_m: np.ndarray) -> SegmentQuality:
        p = self._params
        return judged(distance_m, p.classification_neighbourhood_m, p.outlier_m, p.fit_scale_m)

    def _pull(self, points: np.ndarray, pose: np.ndarray) -> _Pull:
        placed, turned = _placed(points, pose)
        nearest = self._index.nearest(placed)
        normal_x, normal_y, offset = self._index.lines[nearest.segment].T
        return _Pull(
            nearest.distance,
            normal_x,
            normal_y,
            offset - normal_x * placed[:, 0] - normal_y * placed[:, 1],
            normal_y * turned[:, 0] - normal_x * turned[:, 1],
        )

    def _document_step(
        self, points: np.ndarray, pose: np.ndarray, pull: _Pull, neighbourhood_m: float, lever_m: float
    ) -> np.ndarray:
        weight = votes(pull.distance_m, neighbourhood_m)
        share = weight / weight.sum()
        pose = pose + np.array([share @ (pull.normal_x * pull.across_m), share @ (pull.normal_y * pull.across_m), 0.0])
        if self._params.correct_orientation:
            pull = self._pull(points, pose)
            weight = votes(pull.distance_m, neighbourhood_m)
            stiffness = float(weight @ pull.lever_m**2)
            if stiffness > self._params.least_constraint * float(weight.sum()) * lever_m**2:
                pose[2] += float(weight @ (pull.lever_m * pull.across_m)) / stiffness
        return pose

    def _least_squares_step(
        self, points: np.ndarray, pose: np.ndarray, pull: _Pull, neighbourhood_m: float, lever_m: float
    ) -> np.ndarray:
        weight = votes(pull.distance_m, neighbourhood_m)
        information, gradient = _normal_equations(pull, weight, lever_m)
        if not self._params.correct_orientation:
            information[2], information[:, 2], gradient[2] = 0.0, 0.0, 0.0
        inverse, _ = _constrained(information, float(weight.sum()), self._params.least_constraint)
        step = inverse @ gradient
        return pose + np.array([step[0], step[1], step[2] / lever_m])


def votes(distance_m: np.ndarray, neighbourhood_m: float) -> np.ndarray:
    """(N,) weights of points by their distances from their segments: c^m / (d^m + c^m), the document's sigmoid."""
    c = neighbourhood_m**STEEPNESS
    return c / (distance_m**STEEPNESS + c)


def judged(distance_m: np.ndarray, neighbourhood_m: float, outlier_m: float, fit_scale_m: float) -> SegmentQuality:
    """The measures of distances (N,), inf where there is no segment; N >= 1."""
    inlier = distance_m <= outlier_m
    mse_inliers_m2 = float(np.mean(distance_m[inlier] ** 2)) if inlier.any() else float("nan")
    factor = float(np.mean(votes(distance_m, neighbourhood_m)))
    mse_m2 = float(np.mean(distance_m**2))
    combined = factor * fit_scale_m**2 / (fit_scale_m**2 + mse_m2)
    return SegmentQuality(len(distance_m), mse_m2, mse_inliers_m2, float(np.mean(inlier)), factor, combined)


@dataclass(frozen=True)
class _Pull:
    """The displacement by each point."""

    distance_m: np.ndarray  # (N,) from its segment
    normal_x: np.ndarray  # (N,) of its segment, in map
    normal_y: np.ndarray  # (N,)
    across_m: np.ndarray  # (N,) along that normal from the point to the line of the segment
    lever_m: np.ndarray  # (N,) along that normal that the point moves per radian of the robot's turn


def _finite(points_m: np.ndarray) -> np.ndarray:
    points = np.asarray(points_m, float)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"end points must have shape (N, 2), got {points.shape}")
    return points[np.isfinite(points).all(axis=1)]


def _placed(points: np.ndarray, pose: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Points (N, 2) of the robot's frame in map, and from the robot."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    turned = points @ np.array([[cos, sin], [-sin, cos]])
    return turned + pose[:2], turned


def _normal_equations(pull: _Pull, weight: np.ndarray, lever_m: float) -> Tuple[np.ndarray, np.ndarray]:
    """Information (3, 3) and gradient (3,) of x, y and yaw times lever."""
    rows = np.stack([pull.normal_x, pull.normal_y, pull.lever_m / lever_m, pull.across_m])
    products = (rows[:3] * weight) @ rows.T
    return products[:, :3], products[:, 3]


def _constrained(information: np.ndarray, weight: float, least: float) -> Tuple[np.ndarray, np.ndarray]:
    """The inverse of the information in the directions that are constrained, and (K, 3) those that are not."""
    pull, axes = np.linalg.eigh(information)
    kept = pull > least * weight
    inverse = (axes[:, kept] / pull[kept]) @ axes[:, kept].T
    return inverse, axes[:, ~kept].T
