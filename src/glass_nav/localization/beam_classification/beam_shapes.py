"""The beams of one scan as a display draws them: a namespace for each case. B beams."""

from __future__ import annotations

from dataclasses import replace
from typing import List

import numpy as np

from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.sensing.scan import Scan
from glass_nav.shapes import Shape, ShapeKind, figures_at
from glass_nav.vocabulary import CASES_IN_ORDER

_POINT_M = 0.08  # side of the square at the end of a beam
_FIGURE_M = 0.2  # size of the figure around it
_LINE_M, _FIGURE_LINE_M = 0.018, 0.022  # width of the line from the surface to that end, and of the figure's
_LINE_ALPHA = 0.6


def beam_shapes(scan: Scan, cases: BeamCases, surface: SurfaceScan, height_m: float) -> List[Shape]:
    """Shapes of each case: lines from the first surface to the ends of its beams, squares there, an outline.

    A case without beams has one line of zero length, so that rviz shows the checkbox of its namespace from the first
    scan on.

    Args:
        scan: of one lidar.
        cases: of its beams.
        surface: where each beam met the first surface of the map; cut beams get a line.
        height_m: of the lidar above the robot's frame, in which the shapes are.
    """
    ends = scan.points_in_base()
    cut = surface.cut & scan.answered
    starts = replace(scan, ranges_m=np.where(cut, surface.ranges_m, np.nan)).points_in_base()
    shapes: List[Shape] = []
    for case in CASES_IN_ORDER:
        in_case = (cases.case == case) & scan.answered
        lines = in_case & cut
        pairs = np.stack([starts[lines], ends[lines]], axis=1).reshape(-1, 2)
        if not lines.any():
            pairs = np.zeros((2, 2)) + scan.base_from_laser[:2]
        figures = figures_at(case.mark, ends[in_case], _FIGURE_M)
        shapes += [
            Shape(case.label, 0, ShapeKind.LINES, pairs, height_m, _LINE_M, case.rgb, _LINE_ALPHA),
            Shape(case.label, 1, ShapeKind.SQUARES, ends[in_case], height_m, _POINT_M, case.rgb),
            Shape(case.label, 2, ShapeKind.LINES, figures, height_m, _FIGURE_LINE_M, case.rgb),
        ]
    return shapes
