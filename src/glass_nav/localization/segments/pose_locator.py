"""Answers the service ~locate. The wall segments of a map are extracted once."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np

from glass_nav.localization.segments import segment_locator
from glass_nav.localization.segments.segment_correction import SegmentCorrection, SegmentQuality
from glass_nav.localization.segments.segment_locator import SegmentLocator
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap


@dataclass(frozen=True)
class LocateAnswer:
    """A rough pose after its correction."""

    map_from_base: np.ndarray  # (3,) corrected; the rough pose if it was refused
    refusal: Optional[str]  # why it was; None: it was not
    correction: SegmentCorrection  # with both qualities and the directions that are free

    @property
    def text(self) -> str:
        """The answer in one sentence."""
        return self.refusal or f"free: {segment_locator.free_in_words(self.correction)}"


class PoseLocator:
    """Answers requests on the map that is in use. Safe to call from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._prepared: Optional[Tuple[str, SegmentLocator]] = None  # digest of a map, and its segments

    def locate(self, grid_map: GridMap, scan: Scan, rough: np.ndarray) -> LocateAnswer:
        """Correct a rough pose (3,).

        Raises:
            ValueError: no beam answered, the map has no wall segment, or the pose is not finite or not on the map.
        """
        rough = np.asarray(rough, float)
        if rough.shape != (3,) or not np.all(np.isfinite(rough)):
            raise ValueError(f"the rough pose must be finite x, y, yaw, got {rough}")
        if not scan.answered.any():
            raise ValueError("no beam of the scan returned")
        with self._lock:
            locator = self._locator(grid_map)
            if not len(locator.segments_m):
                raise ValueError("no wall of the map is long enough for a segment")
            located = locator.locate(scan, rough)
        refusal = segment_locator.refusal(scan, located, rough)
        pose = located.correction.map_from_base if refusal is None else rough
        return LocateAnswer(pose, refusal, located.correction)

    def quality(
        self, grid_map: GridMap, scan: Scan, case: np.ndarray, map_from_base: np.ndarray
    ) -> Optional[SegmentQuality]:
        """How well a scan of known cases (B,) lies on the segments at a pose (3,).

        Does not wait: None while another thread is asking, or finds the segments of the map, which takes seconds. Such a
        thread is started by the first call for a map.
        """
        if not self._lock.acquire(blocking=False):
            return None
        try:
            if self._prepared is not None and self._prepared[0] == grid_map.digest:
                return self._prepared[1].quality(scan, case, map_from_base)
        finally:
            self._lock.release()
        threading.Thread(target=self._prepare, args=(grid_map,), daemon=True).start()
        return None

    def _prepare(self, grid_map: GridMap) -> None:
        with self._lock:
            self._locator(grid_map)

    def _locator(self, grid_map: GridMap) -> SegmentLocator:
        if self._prepared is None or self._prepared[0] != grid_map.digest:
            self._prepared = grid_map.digest, SegmentLocator(grid_map)
        return self._prepared[1]
