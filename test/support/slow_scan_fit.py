"""A second opinion on the fit of a scan: in numpy, formula by formula.

The tests hold the compiled fit against it. B beams, C clusters.
"""

from __future__ import annotations

import numpy as np

from glass_nav.geometry import angles
from glass_nav.localization.integrity.fit_information import FREE_M, FitInformation
from glass_nav.sensing.distance_field import DistanceField

_SAME_WALL_M, _SAME_WALL_COS = 0.5, np.cos(np.radians(25.0))  # of neighbouring beams
_PIECE_M = 1.0  # of a wall: pieces err by themselves
_SIDES = 8  # directions that walls face
_BEFORE_WALL_M = 0.25  # where the field is looked at: there it has one direction
_BEFORE_CELLS = 1.5  # the same square to the wall
_KERNEL_SCALES = 3.0  # residuals beyond are not of that wall
_CLOSE_M = 0.3  # residuals that tell how much map and lidar disagree
_NEAR_M = 0.15  # the kernel of a scan that may fit beside the pose
_EDGE_CELLS = 0.29  # deviation of an edge that is drawn in whole cells
_MIN_DEVIATION_M, _MIN_SQUARE_M = 0.002, 0.0005  # of walls and of their pieces
_PRIOR_WEIGHT, _MEMORY = 10.0, 0.98  # beams that _EDGE_CELLS is worth, and weight of the past per scan
_FITTED = 2.0  # sides whose error the fit takes up: their offset is a shift of the robot
_PRIOR_BEAMS = 0.01  # weight of FREE_M
_UNMAPPED_BEAMS = 1.0, 4.0  # least and most that may have ended at another thing as near as a piece of a wall errs
_COMMON = 0.5  # of the variances of walls, in that of what all walls err by
_ANOTHER_M = 0.1  # as far off, a beam may have met another thing
_STEPS_M = np.array([0.04, 0.08, 0.13, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0])
_STEPS_M = np.concatenate([-_STEPS_M[::-1], [0.0], _STEPS_M])
_STEP_WIDTHS_M = np.gradient(_STEPS_M)


class SlowScanFit:
    """Learns how much map and lidar disagree, and says how well each scan determines its pose."""

    def __init__(self, field: DistanceField, resolution_m: float, square: bool = False) -> None:
        """
        Args:
            field: distances to the walls.
            resolution_m: of the map's cells.
            square: measure residuals of fitted scans square to the walls.
        """
        self._field, self._square = field, square
        self._edge_m, self._before_m = _EDGE_CELLS * resolution_m, _BEFORE_CELLS * resolution_m
        self._scale_m = self._edge_m  # of what is left between beams and walls
        self._squares = np.full(4, _PRIOR_WEIGHT * self._edge_m**2)  # what fits left: offset, sides, pieces, beams
        self._freedom = np.full(4, _PRIOR_WEIGHT)  # beams, less what the fits took up

    def of(
        self, points_m: np.ndarray, laser_m: np.ndarray, map_from_base: np.ndarray, beam_share: float, matched: bool
    ) -> FitInformation:
        """How well a scan determines its pose.

        Args:
            points_m: (B, 2) finite end points of the beams in the robot's frame, by ascending angle; B > 0.
            laser_m: (2,) the lidar in the robot's frame.
            map_from_base: (3,) pose to look at.
            beam_share: of all beams that the pose was fitted to, how many these are; the noise of one beam averages out.
            matched: the pose was fitted to this scan: learn from what is left, and look at other places where it fits.
        """
        cos, sin = np.cos(map_from_base[2]), np.sin(map_from_base[2])
        turn = np.array([[cos, sin], [-sin, cos]])
        arms_m = points_m @ turn  # from the robot to the ends, in map's axes
        beams = arms_m - laser_m @ turn
        beams /= np.maximum(np.sqrt(np.einsum("bi,bi->b", beams, beams)), 1e-9)[:, None]
        before = -_BEFORE_WALL_M * beams
        normals, steepness, distance_m = self._wall_at(arms_m + before + map_from_base[:2])
        for _ in range(2 if matched and self._square else 0):
            before = self._before_m * normals
            normals, steepness, distance_m = self._wall_at(arms_m + before + map_from_base[:2])
        facing = -np.einsum("bi,bi->b", beams, normals)
        residual_m = np.einsum("bi,bi->b", before, normals) - distance_m  # of the end behind the wall
        steepness = np.where(facing > 0.0, np.minimum(steepness, 1.0), 0.0)  # 0: the beam ended far behind a wall
        if matched:
            left_m = np.abs(residual_m)
            left_m = left_m[left_m < _CLOSE_M]
            self._scale_m = max(self._edge_m, 1.4826 * float(np.median(left_m)) if len(left_m) else 0.0)
        kernel_m = _KERNEL_SCALES * self._scale_m
        weight, near = (
            (kernel**2 / (kernel**2 + residual_m**2) * steepness) ** 2 for kernel in (kernel_m, max(kernel_m, _NEAR_M))
        )
        if not matched:
            weight = near
        lever_m = max(float(np.sqrt(2.0 * np.mean(arms_m**2))), 0.5)
        lever = normals[:, 1] * arms_m[:, 0] - normals[:, 0] * arms_m[:, 1]
        jacobian = np.column_stack([normals, lever / lever_m])  # of x [m], y [m], yaw times lever_m [m]
        weighted = weight[:, None] * jacobian
        inverse = np.linalg.inv(weighted.T @ jacobian + _PRIOR_BEAMS * np.eye(3))
        side = np.round(np.arctan2(normals[:, 1], normals[:, 0]) * (_SIDES / (2.0 * np.pi))).astype(int) % _SIDES
        first = _first_of_each_piece(points_m, normals)
        if matched:
            piece = np.cumsum(np.bincount(first, minlength=len(points_m))) - 1
            self._learn(weight, residual_m, piece, side[first])
        unmapped = _unmapped_beams(residual_m, steepness, kernel_m) ** 2 * (self._variance(1) + self._variance(2))
        variance = ((_PRIOR_BEAMS * FREE_M) ** 2 + unmapped) * np.eye(3)
        clusters = (
            weighted.sum(axis=0)[None],
            (side == np.arange(_SIDES)[:, None]).astype(float) @ weighted,
            np.add.reduceat(weighted, first, axis=0),
            weighted * np.sqrt(beam_share),
        )
        for size, sums in enumerate(clusters):
            variance += self._variance(size) * sums.T @ sums
        covariance = inverse @ variance @ inverse
        if matched:
            if self._square:
                covariance = covariance + _COMMON * (self._variance(1) + self._variance(2)) * np.eye(3)
            covariance = self._widened(covariance, weighted.T @ jacobian, arms_m, map_from_base, lever_m, len(first))
        to_yaw = np.array([1.0, 1.0, 1.0 / lever_m])
        weighted = near[:, None] * jacobian
        offset = np.linalg.solve(weighted.T @ jacobian + _PRIOR_BEAMS * np.eye(3), weighted.T @ -residual_m) * to_yaw
        return FitInformation(covariance * np.outer(to_yaw, to_yaw), offset, float(near.mean()))

    def _wall_at(self, points: np.ndarray) -> "tuple[np.ndarray, np.ndarray, np.ndarray]":
        """Of the wall nearest to points (B, 2): its normals (B, 2), steepness (B,) of the field, distances (B,) [m]."""
        distance_m, along_x, along_y = self._field.at(points[:, 0], points[:, 1])
        steepness = np.sqrt(along_x**2 + along_y**2)
        normals = np.stack([along_x, along_y], axis=1) / np.maximum(steepness, 1e-9)[:, None]
        return normals, steepness, distance_m

    def _learn(self, weight: np.ndarray, residual_m: np.ndarray, piece: np.ndarray, side: np.ndarray) -> None:
        """Split what is left between walls and scan after the fit into an offset, sides, pieces and beams: a nested
        analysis of variance, Searle, Casella, McCulloch, Variance Components (1992), ch. 4.

        Args:
            weight, residual_m, piece: (B,) of the beams; the piece of a wall that each ended at.
            side: (C,) that each piece faces.
        """
        total = weight.sum()
        if total < 1.0:
            return
        beam, offset_m = 0.0, float(weight @ residual_m / total)
        of_piece = np.bincount(piece, weight)
        piece_m = np.bincount(piece, weight * residual_m) / np.maximum(of_piece, 1e-9)
        of_side = np.bincount(side, of_piece, _SIDES)
        side_m = np.bincount(side, of_piece * piece_m, _SIDES) / np.maximum(of_side, 1e-9)
        alone = np.bincount(piece, weight**2) / np.maximum(of_piece, 1e-9)  # (C,) weight of one beam of the piece
        in_side = np.bincount(side, of_piece**2, _SIDES) / np.maximum(of_side, 1e-9)  # (8,) of one piece of the side
        in_side_alone = np.bincount(side, of_piece * alone, _SIDES) / np.maximum(of_side, 1e-9)
        self._add(3, weight @ (residual_m - piece_m[piece]) ** 2, total - alone.sum())
        beam = self._variance(3)
        squares = of_piece @ (piece_m - side_m[side]) ** 2 - beam * (alone.sum() - in_side_alone.sum())
        self._add(2, squares, total - in_side.sum())
        squares = of_side @ (side_m - offset_m) ** 2
        squares -= self._variance(2) * (in_side.sum() - of_side @ in_side / total)
        squares -= beam * (in_side_alone.sum() - of_side @ in_side_alone / total)
        self._add(1, squares, total - of_side @ of_side / total - _FITTED * of_side.mean())
        self._add(0, total * offset_m**2, total)

    def _variance(self, size: int) -> float:
        return max(
            self._squares[size] / max(self._freedom[size], 1e-3),
            (_MIN_SQUARE_M if self._square else _MIN_DEVIATION_M) ** 2,
        )

    def _add(self, size: int, squares: float, freedom: float) -> None:
        total = self._squares, self._freedom
        for each, value in zip(total, (squares, freedom)):
            each[size] = _MEMORY * each[size] + (1.0 - _MEMORY) * value

    def _widened(
        self,
        covariance: np.ndarray,
        information: np.ndarray,
        arms_m: np.ndarray,
        map_from_base: np.ndarray,
        lever_m: float,
        pieces: int,
    ) -> np.ndarray:
        """Covariance (3, 3), in metres, with what the loss along its longest axis adds to its linearization there, and
        along the direction in which the walls hold a robot that keeps its heading least.

        Args:
            covariance: (3, 3) of the linearized fit.
            information: (3, 3) of that fit, for beams of deviation 1.
            arms_m: (B, 2) from the robot to the ends, in map's axes.
            map_from_base: (3,) pose.
            lever_m: a turn by 1 rad is as long as this.
            pieces: of walls that the beams ended at.
        """
        slide = np.append(np.linalg.eigh(information[:2, :2])[1][:, 0], 0.0)
        for axis in (np.linalg.eigh(covariance)[1][:, 2], slide):
            cos, sin = angles.cos_sin(_STEPS_M[:, None] * (axis[2] / lever_m))
            x, y = arms_m[:, 0], arms_m[:, 1]
            distance_m = self._field.distance(
                map_from_base[0] + _STEPS_M[:, None] * axis[0] + cos * x - sin * y,
                map_from_base[1] + _STEPS_M[:, None] * axis[1] + sin * x + cos * y,
            )
            squared = distance_m**2
            kernel = max(_KERNEL_SCALES * self._scale_m, _ANOTHER_M if self._square else 0.0) ** 2
            share = 0.5 * _KERNEL_SCALES**2 * pieces / len(arms_m)
            loss = share * np.sum(squared / (squared + kernel), axis=1)
            linearized = share * float(axis @ information @ axis) / kernel * _STEPS_M**2
            added = _variance_of(loss) - max(_variance_of(linearized), float(axis @ covariance @ axis))
            covariance = covariance + max(0.0, added) * np.outer(axis, axis)
        return covariance


def _variance_of(loss: np.ndarray) -> float:
    """[m2] of a step, with such negative log likelihoods of _STEPS_M."""
    likelihood = np.exp(-np.maximum(loss - loss[len(loss) // 2], 0.0)) * _STEP_WIDTHS_M
    return float(likelihood @ _STEPS_M**2 / likelihood.sum())


def _unmapped_beams(residual_m: np.ndarray, steepness: np.ndarray, kernel_m: float) -> float:
    """How many beams within the kernel (half a width of kernel_m) are not of the wall, as dense as they are just outside."""
    beside = (np.abs(residual_m) > kernel_m) & (np.abs(residual_m) < 3.0 * kernel_m) & (steepness > 0.0)
    least, most = _UNMAPPED_BEAMS
    return min(max(0.5 * float(np.count_nonzero(beside)), least), most)


def _first_of_each_piece(points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(C,) first beam of each row of beams that ended at one piece of a wall."""
    steps = points_m[1:] - points_m[:-1]
    steps_m = np.sqrt(np.einsum("bi,bi->b", steps, steps))
    other = (steps_m > _SAME_WALL_M) | (np.einsum("bi,bi->b", normals[1:], normals[:-1]) < _SAME_WALL_COS)
    part = np.floor(np.cumsum(np.where(other, 0.0, steps_m)) / _PIECE_M)
    new = other
    new[1:] |= part[1:] > part[:-1]
    return np.concatenate([[0], np.nonzero(new)[0] + 1])
