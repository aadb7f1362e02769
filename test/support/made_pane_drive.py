"""A robot in an empty hall drives past something along y = 2 m; scans by plain geometry, no simulator."""

from __future__ import annotations

from typing import Callable, Iterator, Tuple

import numpy as np

from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

BEAMS = np.linspace(-0.75 * np.pi, 0.75 * np.pi, 541)
RESOLUTION_M = 0.05
NOTHING = np.full(len(BEAMS), np.inf)
SURE = np.zeros((3, 3))

Look = Callable[[np.ndarray, np.random.Generator], np.ndarray]  # pose -> (B,) ranges to what the map lacks, inf: passes


def hall(length_m: float = 10.0, width_m: float = 6.0) -> GridMap:
    """Walls around (0, 0) to (length, width), and nothing inside."""
    occupancy = np.zeros((round(width_m / RESOLUTION_M) + 2, round(length_m / RESOLUTION_M) + 2), np.int8)
    occupancy[[0, -1]] = 100
    occupancy[:, [0, -1]] = 100
    return GridMap(occupancy, RESOLUTION_M, np.array([-RESOLUTION_M, -RESOLUTION_M, 0.0]))


def wall_ranges(pose: np.ndarray, length_m: float = 10.0, width_m: float = 6.0) -> np.ndarray:
    """(B,) to the walls of the hall."""
    cos, sin = np.cos(pose[2] + BEAMS), np.sin(pose[2] + BEAMS)
    with np.errstate(divide="ignore"):
        across = np.where(cos > 0.0, (length_m - pose[0]) / cos, -pose[0] / cos)
        along = np.where(sin > 0.0, (width_m - pose[1]) / sin, -pose[1] / sin)
    return np.minimum(across, along)


def line_ranges(pose: np.ndarray, from_m: np.ndarray, to_m: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """(B,) to a straight line, inf where the beam misses it; and the incidence (B,) [rad]."""
    way = np.asarray(to_m, float) - from_m
    normal = np.array([-way[1], way[0]]) / np.hypot(*way)
    beam = np.stack([np.cos(pose[2] + BEAMS), np.sin(pose[2] + BEAMS)], axis=-1)
    cos = beam @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        range_m = ((from_m - pose[:2]) @ normal) / cos
        share = ((pose[:2] + range_m[:, None] * beam - from_m) @ way) / (way @ way)
        meets = (range_m > 0.0) & (share >= 0.0) & (share <= 1.0)
    return np.where(meets, range_m, np.inf), np.arccos(np.clip(np.abs(cos), 0.0, 1.0))


def pane(from_m: Tuple[float, float], to_m: Tuple[float, float], half_rad: float = 0.15) -> Look:
    """Answers near its normal only."""

    def look(pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        range_m, incidence = line_ranges(pose, np.array(from_m), np.array(to_m))
        return np.where(incidence < half_rad, range_m, np.inf)

    return look


def wall(from_m: Tuple[float, float], to_m: Tuple[float, float]) -> Look:
    """Answers from everywhere."""
    return lambda pose, rng: line_ranges(pose, np.array(from_m), np.array(to_m))[0]


def post(at_m: Tuple[float, float], half_m: float = 0.2) -> Look:
    """A thing that shows the robot a face of 2 * half_m from wherever it is."""

    def look(pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        way = np.array(at_m) - pose[:2]
        side = half_m * np.array([-way[1], way[0]]) / np.hypot(*way)
        return line_ranges(pose, np.array(at_m) - side, np.array(at_m) + side)[0]

    return look


def scans(*looks: Look, seed: int = 0, y_m: float = 1.0, noise_m: float = 0.015) -> Iterator[Tuple[Scan, np.ndarray]]:
    """Scans with the poses they were taken at, along the hall at y."""
    rng = np.random.default_rng(seed)
    for number, x_m in enumerate(np.arange(1.0, 9.0, 0.1)):
        pose = np.array([x_m, y_m, 0.0])
        ranges_m = np.min([wall_ranges(pose), *(look(pose, rng) for look in looks)], axis=0)
        ranges_m = ranges_m + noise_m * rng.standard_normal(len(BEAMS))
        yield Scan(number * 10**8, ranges_m, BEAMS, 0.1, 25.0, np.zeros(3)), pose
