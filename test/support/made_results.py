"""A small result of a replay, and the map under it."""

from __future__ import annotations

from collections import Counter

import numpy as np

from glass_nav.evaluation.metrics.replay_result import NO_BEAM, ReplayResult
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.world.grid_map import GridMap

GRID = GridMap(
    np.where(np.indices((80, 60)).sum(axis=0) % 17 == 0, 100, 0).astype(np.int8), 0.1, np.array([-1.0, -2.0, 0.3])
)


def a_result(**changes):
    """Four scans a second apart along x, 0.1 m beside the reference; two beams, one in the last scan."""
    stamps = 10**18 + 10**9 * np.arange(4)
    fields = {
        "stamps_ns": stamps,
        "map_from_base": np.array([[i, 0.1, 0.0] for i in range(4)], float),
        "odom_from_base": np.zeros((4, 3)),
        "covariance": np.tile(0.05**2 * np.eye(3), (4, 1, 1)),
        "level_95": np.full((4, 3), 0.13),
        "level_999": np.full((4, 3), 0.27),
        "states": ["UNKNOWN", "LOCALIZED", "LOCALIZED", "LOCALIZED"],
        "reasons": ["none", "a, b", "c", "d"],
        "used_share": np.array([0.5, 1.0, 1.0, np.nan]),
        "updated": np.array([True, False, True, False]),
        "reliability": np.array([0.0, 0.9, 0.95, 1.0]),
        "places": np.array([7, 1, 1, 1]),
        "particles": np.full(4, 100),
        "cpu_ms": np.array([10.0, 2.0, 20.0, 4.0]),
        "cases": np.array([[1, 1], [3, 0], [1, 2], [1, NO_BEAM]], np.uint8),
        "refusals": Counter({"time runs backwards": 2}),
        "reference": Trajectory(stamps[:3], np.array([[i, 0.0, 0.0] for i in range(3)], float)),
        "wall_s": 0.5,
        "seed": 7,
    }
    return ReplayResult(**{**fields, **changes})
