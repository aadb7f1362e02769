"""Landmarks and what a robot sees of them, worked out by the definition of a bearing."""

from __future__ import annotations

from typing import Optional, Sequence

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.sensing import bearings
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.world import landmark_map
from glass_nav.world.landmark_map import LandmarkMap

# Four tags in front of four viewers, after Figure 6 of the seed document, the text of which gives no coordinates.
FIELD = landmark_map.seen_from_all_sides("ABCD", np.array([[-5.0, 4.5], [-3.0, 8.0], [3.0, 7.0], [5.0, 4.0]]), 15.0)
VIEWERS = np.array([[-1.0, 3.0, 0.3], [1.0, 3.0, -2.0], [1.0, 2.0, 1.6], [-1.0, 2.0, 3.0]])  # P1 to P4


def directions(landmarks: LandmarkMap, map_from_sensor: np.ndarray) -> np.ndarray:
    """(..., N) exact angles in the frame of sensors (..., 3)."""
    way = landmarks.positions_m - map_from_sensor[..., None, :2]
    return angles.wrap(np.arctan2(way[..., 1], way[..., 0]) - map_from_sensor[..., None, 2])


def seen(
    landmarks: LandmarkMap,
    map_from_base: np.ndarray,
    sigma_rad: float = 1e-6,
    rng: Optional[np.random.Generator] = None,
    base_from_sensor: Sequence[float] = (0.0, 0.0, 0.0),
    ids: Optional[Sequence[str]] = None,
) -> LandmarkBearings:
    """What a standing robot sees, with normal errors if there is an rng."""
    chosen = list(landmarks.ids if ids is None else ids)
    place = np.array(base_from_sensor, float)
    exact = directions(landmarks, se2.compose(map_from_base, place))[landmarks.numbers(chosen)]
    noise = 0.0 if rng is None else rng.normal(0.0, sigma_rad, len(exact))
    return bearings.standing(chosen, exact + noise, sigma_rad, base_from_sensor=place)
