"""What the beams of a scan say at the reported pose: what each met, the scan cut at glass, how much the map explains."""

from __future__ import annotations

from dataclasses import dataclass

from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan


@dataclass(frozen=True)
class BeamReport:
    """Of one scan."""

    cases: BeamCases  # of every beam
    surface_scan: SurfaceScan  # the scan in which glass is an obstacle
    inlier_ratio: float  # of the beams that say something, see beam_evidence.py; NaN without any
