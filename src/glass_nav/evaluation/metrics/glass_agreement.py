"""Compares a glass map with a reference on the same walls: precision and recall within a distance.

N, M places in the map.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict

import numpy as np

NEAR_M = 0.15


@dataclass(frozen=True)
class GlassAgreement:
    """How far two lists of glass cells are the same."""

    reported: int  # cells called glass
    other: int  # cells that the other opinion calls glass
    precision: float  # share of those that have one of the other's near; NaN: none reported
    recall: float  # share of the other's that have a reported one near; NaN: the other has none
    wall_share: float  # of the wall cells that are called glass; NaN: no walls

    def summary(self) -> Dict[str, Any]:
        return {
            "glass_cells": self.reported,
            "other_cells": self.other,
            "precision": self.precision,
            "recall": self.recall,
            "wall_share": self.wall_share,
        }


def of(told_m: np.ndarray, other_m: np.ndarray, wall_cells: int, near_m: float = NEAR_M) -> GlassAgreement:
    """Compare cells reported (N, 2) and the other's (M, 2) [m], on a map with so many wall cells."""
    return GlassAgreement(
        len(told_m),
        len(other_m),
        _share_near(told_m, other_m, near_m),
        _share_near(other_m, told_m, near_m),
        len(told_m) / wall_cells if wall_cells else float("nan"),
    )


def _share_near(points_m: np.ndarray, others_m: np.ndarray, near_m: float) -> float:
    if not len(points_m):
        return float("nan")
    if not len(others_m):
        return 0.0
    from scipy.spatial import cKDTree

    distance_m, _ = cKDTree(others_m).query(points_m)
    return float(np.mean(distance_m <= near_m + 1e-9))
