"""What a belief over poses asks of a map: where a scan fits, what explains its beams, what would be seen."""

from __future__ import annotations

from typing import Optional, Protocol

import numpy as np

from glass_nav.hypotheses.scan_explanation import BeamsExplained
from glass_nav.sensing.scan import Scan


class Search(Protocol):
    """A search of one scan in the whole map, such as hypotheses/place_search.py."""

    def advance(self) -> bool:
        """One slice; whether it is complete."""

    def places(self, odom_from_base: np.ndarray) -> np.ndarray:
        """(N, 3) poses of the robot at that odometry (3,), the best first."""


class MapScans(Protocol):
    """How a map would be seen; hypotheses/scan_explanation.py is one."""

    def search(self, scan: Scan, odom_from_base: np.ndarray) -> Optional[Search]:
        """Begins a search for poses where the scan fits; None: the scan is no evidence."""

    def beams(self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float) -> Optional[BeamsExplained]:
        """Poses (K, 3) slid by no more than that, with the beams explained from there; None: no evidence."""

    def seen_from(self, map_from_base: np.ndarray) -> Scan:
        """The scan that a robot at a pose (3,) would see if the map were right."""

    def is_free(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: by the map a robot may stand at points (..., 2) [m]."""
