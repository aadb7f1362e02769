"""Where in a map a robot can localize by landmarks, and where one more landmark helps most.

Points are places of the map where a robot may stand; a landmark is visible from one if its range and view allow it and
no wall stands between. The cost of a point is its expected standard deviation, at most CAP_M; a point without three
landmarks costs CAP_M, plus CAP_M for each that is missing, so that the first tag of three has a value too. The best
place for another tag lowers the mean cost most; the next one is searched with that tag in place.
Assumptions: the sensor looks all round, and a tag can hang on everything that is occupied on the map.
M points, N landmarks, K candidates.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List

import numpy as np
from scipy import ndimage

from glass_nav.geometry import angles
from glass_nav.localization.bearings import bearing_errors
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world.grid_map import GridMap
from glass_nav.world.landmark_map import RANGE_M, VIEW_RAD, LandmarkMap

CAP_M = 1.0
CLEARANCE_M = 0.25  # of a point from walls: a robot has a body
NORMAL_CELLS = 4  # around a wall cell, to decide which side of it is free
OFF_WALL_M = 0.05  # a tag sticks out of its wall
TILTS_RAD = np.radians([0.0, 45.0, -45.0])  # a tag may be tilted against its wall, to look along a corridor
WALL_SLACK_CELLS = 3.0  # otherwise the cells of its own wall hide a tag


@dataclass(frozen=True)
class Suggestion:
    """An additional tag and its benefit, with the earlier ones in place."""

    position_m: np.ndarray  # (2,)
    facing_rad: float
    sigma_m: np.ndarray  # (M,) expected with it
    seen: np.ndarray  # (M,) int visible landmarks


def points(grid_map: GridMap, spacing_m: float) -> np.ndarray:
    """(M, 2) places where a robot may stand, spacing_m apart.

    Raises:
        ValueError: there are none.
    """
    every = max(int(round(spacing_m / grid_map.resolution_m)), 1)
    walls_m = ndimage.distance_transform_edt(np.pad(~grid_map.occupied, 1, constant_values=True))[1:-1, 1:-1]
    free = grid_map.free & (walls_m * grid_map.resolution_m > CLEARANCE_M)
    chosen = np.zeros_like(free)
    chosen[every // 2 :: every, every // 2 :: every] = True
    rows, columns = np.nonzero(free & chosen)
    if not len(rows):
        raise ValueError(f"the map has no free place {CLEARANCE_M:g} m away from walls, searched every {spacing_m:g} m")
    return grid_map.centres(rows, columns)


def visible(walls: RayCaster, landmarks: LandmarkMap, points_m: np.ndarray) -> np.ndarray:
    """(M, N) bool: the landmark is visible from the point."""
    seen = landmarks.in_view(points_m)
    point, landmark = np.nonzero(seen)
    if not len(point):
        return seen
    sight_m = landmarks.positions_m[landmark] - points_m[point]
    distance = np.hypot(sight_m[:, 0], sight_m[:, 1])
    rays = np.column_stack([points_m[point], np.arctan2(sight_m[:, 1], sight_m[:, 0])])
    free_m = walls.cast(rays, np.zeros(1), float(distance.max()) + 1.0)[:, 0]
    seen[point, landmark] = free_m >= distance - WALL_SLACK_CELLS * walls.grid_map.resolution_m
    return seen


def candidates(grid_map: GridMap, spacing_m: float) -> LandmarkMap:
    """Places for tags: on walls towards free space, about spacing_m apart, each straight and tilted to either side."""
    near_free = grid_map.occupied & ndimage.binary_dilation(grid_map.free, np.ones((3, 3), bool))
    every = max(int(round(spacing_m / grid_map.resolution_m)), 1)
    rows, columns = np.nonzero(near_free)
    _, chosen = np.unique((rows // every) * near_free.shape[1] + columns // every, return_index=True)
    rows, columns = rows[chosen], columns[chosen]
    offsets = np.arange(-NORMAL_CELLS, NORMAL_CELLS + 1)
    free = np.pad(grid_map.free, NORMAL_CELLS).astype(float)
    rise = ndimage.correlate(free, np.tile(offsets[:, None], (1, len(offsets))).astype(float), mode="constant")
    run = ndimage.correlate(free, np.tile(offsets, (len(offsets), 1)).astype(float), mode="constant")
    up, right = (part[rows + NORMAL_CELLS, columns + NORMAL_CELLS] for part in (rise, run))
    sure = np.hypot(up, right) > 2.0 * len(offsets)  # else free on both sides: the normal would be a guess
    rows, columns, up, right = rows[sure], columns[sure], up[sure], right[sure]
    normal = np.arctan2(up, right) + grid_map.map_from_grid[2]
    place = grid_map.centres(rows, columns) + OFF_WALL_M * np.stack([np.cos(normal), np.sin(normal)], axis=-1)
    facing = angles.wrap(normal[:, None] + TILTS_RAD).ravel()
    count = len(facing)
    return LandmarkMap(
        tuple(map(str, range(count))),
        np.repeat(place, len(TILTS_RAD), axis=0),
        facing,
        np.full(count, VIEW_RAD),
        np.full(count, RANGE_M),
    )


def suggest(
    walls: RayCaster,
    landmarks: LandmarkMap,
    seen: np.ndarray,
    points_m: np.ndarray,
    places: LandmarkMap,
    sigma_rad: float,
    count: int,
) -> List[Suggestion]:
    """The best places for more tags, one after the other; fewer than count if no more help.

    Args:
        walls: of the map.
        landmarks: the existing ones.
        seen: (M, N) bool, from visible().
        points_m: (M, 2).
        places: K candidates.
        sigma_rad: of a bearing.
        count: how many at most.
    """
    sums = bearing_errors.information_sums(points_m, landmarks.positions_m, seen, sigma_rad, landmarks.sigma_m).sum(
        axis=1
    )
    number = seen.sum(axis=1)
    could = visible(walls, places, points_m)
    suggestions: List[Suggestion] = []
    for _ in range(count):
        now = _cost(number, sums)
        gain = np.array(
            [
                _gain(points_m, places.positions_m[k], could[:, k], number, sums, now, sigma_rad, landmarks.sigma_m)
                for k in range(len(places))
            ]
        )
        if not len(gain) or gain.max() <= 0.0:
            break
        best = int(np.argmax(gain))
        sums = (
            sums
            + bearing_errors.information_sums(
                points_m, places.positions_m[best : best + 1], could[:, best : best + 1], sigma_rad, landmarks.sigma_m
            )[:, 0]
        )
        number = number + could[:, best]
        could[:, best] = False  # occupied now
        suggestions.append(
            Suggestion(places.positions_m[best], float(places.facing_rad[best]), _sigma(number, sums), number)
        )
    return suggestions


def _gain(
    points_m: np.ndarray,
    position_m: np.ndarray,
    could: np.ndarray,
    number: np.ndarray,
    sums: np.ndarray,
    now: np.ndarray,
    sigma_rad: float,
    place_sigma_m: float,
) -> float:
    """Decrease of the mean cost by a tag there; only points that see it change."""
    at = np.flatnonzero(could)
    more = bearing_errors.information_sums(
        points_m[at], position_m[None], np.ones((len(at), 1), bool), sigma_rad, place_sigma_m
    )[:, 0]
    return float((now[at] - _cost(number[at] + 1, sums[at] + more)).sum()) / len(points_m)


def _sigma(number: np.ndarray, sums: np.ndarray) -> np.ndarray:
    return np.where(number >= 3, bearing_errors.sigma_from_sums(sums), np.inf)


def _cost(number: np.ndarray, sums: np.ndarray) -> np.ndarray:
    """(M,) [m]"""
    return np.minimum(_sigma(number, sums), CAP_M) + CAP_M * np.maximum(3 - number, 0)
