"""One scan that is searched in the whole map, slice by slice, and the beams explained at the poses found."""

from __future__ import annotations

from typing import List, Optional

import numpy as np

from glass_nav.hypotheses.map_scans import MapScans, Search
from glass_nav.hypotheses.scan_explanation import BeamsExplained
from glass_nav.sensing.scan import Scan

AT_ONCE = 400  # poses found that are judged while one scan comes: 60 ms
_SLIDES_M, _SLIDES_RAD = 0.5, np.radians(15.0)  # a pose that is new


class SearchedScan:
    """A scan that is searched in the whole map: advance() until it is complete."""

    def __init__(
        self, scans: MapScans, search: Search, scan: Scan, odom_from_base: np.ndarray, driven_m: float, most: int
    ) -> None:
        self.scan, self.odom_from_base, self.driven_m = scan, odom_from_base, driven_m
        self._scans, self._search, self._most = scans, search, most
        self._left: Optional[np.ndarray] = None  # (N, 3) poses that are not judged yet; None: they are looked for
        self._judged: List[BeamsExplained] = []

    def advance(self) -> Optional[BeamsExplained]:
        """One slice; the poses found, once it is complete."""
        if self._left is None:
            if self._search.advance():
                self._left = self._search.places(self.odom_from_base)[: self._most]
            return None
        beams = self._scans.beams(self.scan, self._left[:AT_ONCE], _SLIDES_M, _SLIDES_RAD)
        assert beams is not None
        self._judged.append(beams)
        self._left = self._left[AT_ONCE:]
        if len(self._left):
            return None
        poses, explained, known, contradicted_at = (
            np.concatenate([getattr(part, name) for part in self._judged])
            for name in ("poses", "explained", "known", "contradicted_at")
        )
        return BeamsExplained(poses, beams.ends_m, explained, known, contradicted_at)
