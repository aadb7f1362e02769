"""Compares the wall segments seen along an edge with those of the atlas: how much do they contradict each other?

The feature maps of the seed document global_localization_procedure.txt are one more test of a candidate. The document
does not define how to compare them; the formulation is ours. With glass the maps need not be equal: where beams pass
a pane, the walls behind it are seen instead. But glass never shows a wall where the atlas has free space in front of
its walls. So the segments seen are laid over those of the atlas. Each piece either lies on a wall, or is in free
space, if the line of sight continues beyond it to a wall of the atlas. The contradiction is the share of pieces in
free space; pieces beyond the walls of the atlas, or where it has none, do not count.

The exact alignment is not known. The segments are aligned from several headings (as in the seed document
segment_localization.txt, with a shrinking neighbourhood), within the tolerances. The smallest contradiction of all
alignments, and of none, is used. K alignments, P pieces, S segments of the atlas, W points of the path.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np

_PIECE_M, _MAX_PIECES = 0.2, 200
_HEADINGS, _STEPS = 5, 6
_FIRST_M = 1.0  # of the neighbourhood
_PARALLEL = 0.4  # sine of the angle between a piece and the wall that it may lie on
_PRIOR = np.array([0.5, 0.5, 2.0])  # stiffness of the alignment towards no shift: metres of wall
_CELL_SIGMA_M = 0.06  # of a wall, in both maps
_DRIFT = 0.5  # share of the dead reckoning error that is left after the alignment
_DOUBT_M = 0.5  # of wall in favour of a candidate, without being seen
_MIN_M = 1.0  # of wall in free space; less is furniture


@dataclass(frozen=True)
class SegmentTest:
    """Whether the walls seen along an edge are evidence."""

    match_segments: bool = True  # not with vote_mode seed
    segments_max_contradiction: float = 0.6  # share of the walls seen that may stand where a candidate has free space

    def __post_init__(self) -> None:
        if not 0.0 < self.segments_max_contradiction <= 1.0:
            raise ValueError(f"~segments_max_contradiction must be in (0, 1], got {self.segments_max_contradiction}")


@dataclass(frozen=True)
class Reach:
    """Errors of what was seen."""

    shift_m: float  # at the start of the edge
    turn_rad: float  # there
    sigmas: float  # standard deviations that a wall may be off after the alignment
    drift_share: float  # of dead reckoning, per metre


def contradiction(seen_m: np.ndarray, atlas_m: np.ndarray, path_m: np.ndarray, reach: Reach) -> Tuple[float, float]:
    """Share and length of the walls seen that stand in the free space of a candidate.

    Args:
        seen_m: (n, 4) segments seen, in the frame at the start, x along the edge.
        atlas_m: (S, 4) of the candidate, in the same frame as if the candidate were right.
        path_m: (W, 2) viewpoints along the candidate.
        reach: errors of what was seen.

    Returns:
        share 0..1 of the walls that are compared, and metres of wall that stand in free space.
    """
    atlas_m, seen_m = _without_points(atlas_m), _without_points(seen_m)
    if not len(seen_m) or not len(atlas_m):
        return 0.0, 0.0
    pieces = _Pieces(seen_m)
    walls = _Walls(atlas_m)
    poses = np.vstack([_fitted(pieces, walls, reach), np.zeros(3)])
    placed, directions, _ = pieces.placed(poses)
    away, _, _ = walls.nearest(placed, directions)
    allowed = reach.sigmas * np.hypot(_CELL_SIGMA_M, _DRIFT * reach.drift_share * np.hypot(*pieces.middle_m.T))
    on_wall = away <= allowed
    in_free_space = ~on_wall & (walls.beyond(placed, path_m) > allowed)
    supports, contradicts = (np.sum(pieces.length_m * which, axis=1) for which in (on_wall, in_free_space))
    share = contradicts / (supports + contradicts + _DOUBT_M)
    best = int(np.argmin(share))
    return float(share[best]), float(contradicts[best])


def _without_points(segments_m: np.ndarray) -> np.ndarray:
    """The segments (n, 4) that have a length."""
    along_m = segments_m[:, 2:] - segments_m[:, :2]
    return segments_m[np.hypot(along_m[:, 0], along_m[:, 1]) > 1e-6]


class _Pieces:
    """Segments cut into short pieces."""

    def __init__(self, segments_m: np.ndarray) -> None:
        along = segments_m[:, 2:] - segments_m[:, :2]
        length = np.hypot(*along.T)
        each = max(_PIECE_M, float(length.sum()) / _MAX_PIECES)
        count = np.maximum(np.ceil(length / each).astype(int), 1)
        of = np.repeat(np.arange(len(segments_m)), count)
        number = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
        self.middle_m = segments_m[of, :2] + ((number + 0.5) / count[of])[:, None] * along[of]  # (P, 2)
        self.length_m = (length / count)[of]  # (P,)
        self._direction = (along / length[:, None])[of]  # (P, 2)

    def placed(self, poses: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Middles and directions at poses (K, 3), and from the origin of the pose to the middles; (K, P, 2) each."""
        cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
        turned, direction = (
            np.stack([cos * rows[:, 0] - sin * rows[:, 1], sin * rows[:, 0] + cos * rows[:, 1]], -1)
            for rows in (self.middle_m, self._direction)
        )
        return turned + poses[:, None, :2], direction, turned


class _Walls:
    """Wall segments along the edge of a candidate."""

    def __init__(self, segments_m: np.ndarray) -> None:
        self._start = segments_m[:, :2]
        self._along = segments_m[:, 2:] - segments_m[:, :2]
        self._length = np.hypot(*self._along.T)
        self._unit = self._along / self._length[:, None]
        self.normal = np.column_stack([-self._unit[:, 1], self._unit[:, 0]])

    def nearest(self, points: np.ndarray, directions: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distance (K, P) to the nearest segment about parallel to the piece, which one, and how far left of it."""
        x, y = (points[..., None, each] - self._start[:, each] for each in (0, 1))
        unit_x, unit_y = self._unit.T
        along, across = x * unit_x + y * unit_y, y * unit_x - x * unit_y
        beyond = along - np.clip(along, 0.0, self._length)
        skew = np.abs(directions[..., None, 0] * unit_y - directions[..., None, 1] * unit_x)
        squared = np.where(skew <= _PARALLEL, across**2 + beyond**2, np.inf)
        best = squared.argmin(axis=-1)[..., None]
        return (
            np.sqrt(np.take_along_axis(squared, best, -1)[..., 0]),
            best[..., 0],
            np.take_along_axis(across, best, -1)[..., 0],
        )

    def beyond(self, points: np.ndarray, path_m: np.ndarray) -> np.ndarray:
        """(K, P) metres from a piece to the first segment on the line of sight from the nearest viewpoint.

        Negative: the segment is in front of the piece; -inf: there is none.
        """
        near = np.argmin(np.sum((points[..., None, :] - path_m) ** 2, axis=-1), axis=-1)
        eye = path_m[near]
        sight = points - eye
        offset_x, offset_y = (self._start[:, each] - eye[..., None, each] for each in (0, 1))
        along_x, along_y = self._along.T
        with np.errstate(divide="ignore", invalid="ignore"):
            cross = sight[..., None, 0] * along_y - sight[..., None, 1] * along_x
            share = (offset_x * along_y - offset_y * along_x) / cross
            at = (offset_x * sight[..., None, 1] - offset_y * sight[..., None, 0]) / cross
            met = (share > 1e-6) & (at >= 0.0) & (at <= 1.0)
        first = np.where(met, share, np.inf).min(axis=-1)
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(first), (first - 1.0) * np.hypot(sight[..., 0], sight[..., 1]), -np.inf)


def _fitted(pieces: _Pieces, walls: _Walls, reach: Reach) -> np.ndarray:
    """(K, 3) shifts and turns that lay the pieces on walls, from headings within reach."""
    poses = np.zeros((_HEADINGS, 3))
    poses[:, 2] = np.linspace(-reach.turn_rad, reach.turn_rad, _HEADINGS)
    limit = np.array([reach.shift_m, reach.shift_m, reach.turn_rad])
    for step in range(_STEPS):
        neighbourhood = (_FIRST_M * (1.0 - step / _STEPS)) ** 2
        placed, directions, turned = pieces.placed(poses)
        away, wall, across = walls.nearest(placed, directions)
        weight = pieces.length_m * neighbourhood / (away**2 + neighbourhood)
        normal = walls.normal[wall]
        lever = normal[..., 1] * turned[..., 0] - normal[..., 0] * turned[..., 1]
        jacobian = np.concatenate([normal, lever[..., None]], axis=-1)
        information = np.einsum("kp,kpi,kpj->kij", weight, jacobian, jacobian) + np.diag(_PRIOR)
        pull = np.einsum("kp,kpi->ki", -weight * np.where(np.isfinite(away), across, 0.0), jacobian)
        poses = np.clip(poses + np.linalg.solve(information, pull[..., None])[..., 0], -limit, limit)
    return poses


def matches(share: float, contradicting_m: float, test: SegmentTest) -> bool:
    """Whether a candidate may be the edge that was driven."""
    return contradicting_m < _MIN_M or share <= test.segments_max_contradiction
