"""The wall segments that a robot sees along each edge, in each direction.

These are the two directional feature maps per edge of the seed document global_localization_procedure.txt. A robot is
put at equal distances along the line, looking along it; rays find the segments that are seen, and their visible parts.
A segment has free space to its left, so one that runs with the robot is a wall to its right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np
from scipy.spatial import cKDTree

from glass_nav.geometry import angles, polyline
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world import wall_segments
from glass_nav.world.grid_map import GridMap

MIN_RAYS = 3  # that must meet a segment


@dataclass(frozen=True)
class ViewParams:
    """The lidar that the feature maps are made for."""

    view_range_m: float = 8.0
    field_of_view_deg: float = 270.0  # around straight ahead
    view_step_m: float = 0.5  # along the line
    ray_step_deg: float = 1.0

    def __post_init__(self) -> None:
        for name in ("view_range_m", "view_step_m", "ray_step_deg"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"{name} must be finite and > 0, got {getattr(self, name)}")
        if not 0.0 < self.field_of_view_deg <= 360.0:
            raise ValueError(f"field_of_view_deg must be > 0 and <= 360, got {self.field_of_view_deg}")


class EdgeViews:
    """Sees the walls of one map."""

    def __init__(self, grid_map: GridMap, params: ViewParams = ViewParams()) -> None:
        self._params = params
        self._caster = RayCaster(wall_segments.walls_closed(grid_map), unknown="stop")
        self._cell_m = grid_map.resolution_m
        self.walls = wall_segments.extract(grid_map)
        self._faces = cKDTree(self.walls.faces_m) if len(self.walls.faces_m) else None
        self._angles_rad = np.radians(np.arange(0.0, 360.0, params.ray_step_deg))

    def of(self, line_m: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Segments seen along a line (n, 2) of the frame map, and those seen in the other direction.

        Returns:
            two arrays (k, 4) of x1 y1 x2 y2 [m] in the frame map, cut to what is seen, with free space to the left.
        """
        poses = poses_along(line_m, self._params.view_step_m)
        hits = self._caster.cast_first(poses, self._angles_rad, self._params.view_range_m)
        pose, ray = np.nonzero(np.isfinite(hits.range_m))
        if not len(pose) or self._faces is None:
            return np.zeros((0, 4)), np.zeros((0, 4))
        bearing = poses[pose, 2] + self._angles_rad[ray]
        points = poses[pose, :2] + hits.range_m[pose, ray, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])
        away, face = self._faces.query(points)
        segment = self.walls.face_segment[face]
        segment[away > self._cell_m] = -1
        half_rad = np.radians(self._params.field_of_view_deg) / 2.0 + 1e-9
        forward, backward = (np.abs(angles.wrap(self._angles_rad - ahead))[ray] <= half_rad for ahead in (0.0, np.pi))
        return self._seen(segment, points, poses[pose, :2], forward), self._seen(
            segment, points, poses[pose, :2], backward
        )

    def _seen(self, segment: np.ndarray, points: np.ndarray, origins: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        chosen = chosen & (segment >= 0)
        segment, points, origins = segment[chosen], points[chosen], origins[chosen]
        start, end = self.walls.segments_m[segment, :2], self.walls.segments_m[segment, 2:]
        length = np.hypot(*(end - start).T)
        direction = (end - start) / length[:, None]
        offset = origins - start
        facing = direction[:, 0] * offset[:, 1] - direction[:, 1] * offset[:, 0] > 0.0
        along = np.clip(np.sum((points - start) * direction, axis=1), 0.0, length)
        segment, along = segment[facing], along[facing]
        order = np.argsort(segment, kind="stable")
        which, first, count = np.unique(segment[order], return_index=True, return_counts=True)
        if not len(which):
            return np.zeros((0, 4))
        low, high = np.minimum.reduceat(along[order], first), np.maximum.reduceat(along[order], first)
        kept = (count >= MIN_RAYS) & (high - low >= wall_segments.MIN_LENGTH_M)
        rows = self.walls.segments_m[which[kept]]
        step = rows[:, 2:] - rows[:, :2]
        step /= np.hypot(*step.T)[:, None]
        return np.column_stack([rows[:, :2] + low[kept, None] * step, rows[:, :2] + high[kept, None] * step])


def poses_along(line_m: np.ndarray, step_m: float) -> np.ndarray:
    """(P, 3) poses along a line (n, 2), looking along it: at both ends, and between them at most one step apart."""
    pieces, along = np.diff(line_m, axis=0), polyline.distances_along(line_m)
    at = np.linspace(0.0, along[-1], int(np.ceil(along[-1] / step_m)) + 1)
    piece = np.clip(np.searchsorted(along, at, side="right") - 1, 0, len(pieces) - 1)
    return np.column_stack(
        [
            np.interp(at, along, line_m[:, 0]),
            np.interp(at, along, line_m[:, 1]),
            np.arctan2(pieces[piece, 1], pieces[piece, 0]),
        ]
    )
