"""The start of a robot: a random free pose of a building, or one given as text."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
from scipy import ndimage

from glass_nav.simulation import building_map
from glass_nav.simulation.building import Building, distances

RANDOM = "random"
ROOM_M = 0.45  # to the nearest surface: it can turn and drive off in any direction
PASSAGE_M = 0.3  # from its centre to a wall, where it passes through
_STREAM = 0x57A27  # of the seed: no other part of a simulation draws from it
_TRIES = 1000


def start(words: str, building: Building, seed: int) -> Optional[np.ndarray]:
    """(3,) map_from_base; None for "": the building's own.

    Args:
        words: "x y yaw" [m, m, rad], or "random".
        building: as it is now, with moved furniture.
        seed: of the random place.

    Raises:
        ValueError: neither, or no room anywhere.
    """
    if not words.strip():
        return None
    if words.strip() == RANDOM:
        return random_place(building, np.random.default_rng([seed, _STREAM]))
    try:
        pose = np.array([float(word) for word in words.replace(",", " ").split()])
    except ValueError:
        pose = np.zeros(0)
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise ValueError(f"start must be x y yaw in m and rad, or {RANDOM}, got {words!r}")
    return pose


def random_place(building: Building, rng: np.random.Generator, passage_m: float = PASSAGE_M) -> np.ndarray:
    """(3,) map_from_base with room to every surface, that a robot can reach from the building's own start.

    Args:
        building: as it is now.
        rng: draws the place.
        passage_m: half the width of the narrowest gap that it passes on its way; 0: every gap.

    Raises:
        ValueError: no room anywhere.
    """
    grid = building_map.draw(building)
    room_m = ndimage.distance_transform_edt(np.pad(grid.free, 1))[1:-1, 1:-1] * grid.resolution_m
    parts, _ = ndimage.label(grid.free & (room_m >= passage_m), np.ones((3, 3), bool))
    nearest = ndimage.distance_transform_edt(parts == 0, return_distances=False, return_indices=True)
    row, column = nearest[(slice(None), *grid.cells(building.start[:2]))]
    rows, columns = np.nonzero((parts == parts[row, column]) & (room_m >= ROOM_M))
    surfaces = building.surfaces
    from_m, to_m = surfaces.from_m[surfaces.present], surfaces.to_m[surfaces.present]
    for _ in range(_TRIES if len(rows) else 0):
        pick = int(rng.integers(len(rows)))
        point_m = grid.centres(rows[pick], columns[pick])
        yaw = float(rng.uniform(-math.pi, math.pi))
        if distances(point_m[None], from_m, to_m).min() >= ROOM_M:  # unmapped surfaces count, too
            return np.array([*point_m, yaw])
    raise ValueError(f"{building.name}: no place with {ROOM_M:g} m of room around it")
