"""The beams of a scan at the reported pose: case of each, the scan cut at glass, share explained by the map."""

from __future__ import annotations

from dataclasses import dataclass

from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan


@dataclass(frozen=True)
class BeamReport:
    """The report on the beams of one scan."""

    cases: BeamCases  # of every beam
    surface_scan: SurfaceScan  # the scan in which glass is an obstacle
    inlier_ratio: float  # of the beams that say something, see beam_evidence.py; NaN without any
