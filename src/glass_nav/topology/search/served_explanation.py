"""Explains scans by the map that is served: there may be none yet, and another one later."""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np

from glass_nav.hypotheses.scan_explanation import ScanExplanation
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap


class ServedExplanation:
    """As ScanExplanation; without a map scans are no evidence."""

    def __init__(self) -> None:
        self._explanation: Optional[ScanExplanation] = None

    def take(self, grid_map: GridMap) -> None:
        """Use this map from now on."""
        self._explanation = ScanExplanation(grid_map)

    @property
    def has_map(self) -> bool:
        """Whether one was served."""
        return self._explanation is not None

    def shares(self, scan: Scan, map_from_base: np.ndarray) -> np.ndarray:
        """(C,) share of the scan that the map explains from each pose (C, 3); NaN without a map."""
        if self._explanation is None:
            return np.full(len(map_from_base), np.nan)
        return self._explanation.shares(scan, map_from_base)

    def fitted(
        self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float
    ) -> Tuple[np.ndarray, np.ndarray]:
        """(C, 3) poses moved to where the scan fits best, and (C,) shares; as given and NaN without a map."""
        if self._explanation is None:
            return np.array(map_from_base, float), np.full(len(map_from_base), np.nan)
        return self._explanation.fitted(scan, map_from_base, most_m, most_rad)

    def places(self, scan: Scan, most: int) -> np.ndarray:
        """(K, 3) poses where the scan may have been taken; none without a map."""
        return np.zeros((0, 3)) if self._explanation is None else self._explanation.places(scan, most)
