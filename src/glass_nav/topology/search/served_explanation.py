"""Explains scans by the served map, which may be missing at first and may be replaced later."""

from __future__ import annotations

from typing import Optional

import numpy as np

from glass_nav.hypotheses.place_search import PlaceSearch
from glass_nav.hypotheses.scan_explanation import BeamsExplained, ScanExplanation
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap


class ServedExplanation:
    """A ScanExplanation of the served map; without a map scans are no evidence."""

    def __init__(self) -> None:
        self._explanation: Optional[ScanExplanation] = None

    def take(self, grid_map: GridMap) -> None:
        """Use this map from now on."""
        self._explanation = ScanExplanation(grid_map)
        self._explanation.prepare()

    @property
    def has_map(self) -> bool:
        """Whether one was served."""
        return self._explanation is not None

    def search(self, scan: Scan, odom_from_base: np.ndarray) -> Optional[PlaceSearch]:
        """As of ScanExplanation; None without a map."""
        return None if self._explanation is None else self._explanation.search(scan, odom_from_base)

    def beams(self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float) -> Optional[BeamsExplained]:
        """As of ScanExplanation; None without a map."""
        if self._explanation is None:
            return None
        return self._explanation.beams(scan, map_from_base, most_m, most_rad)

    def seen_from(self, map_from_base: np.ndarray) -> Scan:
        """As of ScanExplanation; without a map nothing is seen."""
        if self._explanation is None:
            return Scan(0, np.zeros(0), np.zeros(0), 0.0, 1.0, np.zeros(3))
        return self._explanation.seen_from(map_from_base)

    def is_free(self, points_m: np.ndarray) -> np.ndarray:
        """As of ScanExplanation; without a map a robot may stand everywhere."""
        if self._explanation is None:
            return np.ones(points_m.shape[:-1], bool)
        return self._explanation.is_free(points_m)
