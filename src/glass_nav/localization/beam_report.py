"""The beams of a scan at the reported pose: case of each, the scan cut at glass, share explained by the map."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Callable

from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan


@dataclass(frozen=True)
class BeamReport:
    """The report on the beams of one scan."""

    cases: BeamCases  # of every beam
    inlier_ratio: float  # of the beams that say something, see beam_evidence.py; NaN without any
    cut: Callable[[], SurfaceScan]  # by what the filter knows when it is called

    @cached_property
    def surface_scan(self) -> SurfaceScan:
        """The scan in which glass is an obstacle. Computed on first access, which must be before the next scan."""
        return self.cut()
