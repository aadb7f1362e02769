"""The end points of a scan as coloured points, with what rviz' Select tool shows. B beams, N returns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import BeamCase

FIELDS = ("x", "y", "z", "rgb", "case", "range", "expected", "residual", "weight")

CASE_COLOURS = np.array([case.rgb for case in BeamCase], dtype=np.uint32)  # (5, 3) by the number of the case


def points(scan: Scan, cases: BeamCases, height_m: float = 0.0) -> np.ndarray:
    """(N, 9) float32, little-endian: FIELDS of each return, in the robot's frame.

    Args:
        scan: one revolution of a lidar.
        cases: of its beams.
        height_m: of the lidar above the robot's frame.
    """
    answered = scan.answered
    red, green, blue = CASE_COLOURS[cases.case[answered]].T
    ends = replace(scan, ranges_m=scan.ranges_m[answered], angles_rad=scan.angles_rad[answered], origins_m=None)
    rows = np.empty((len(ends), len(FIELDS)), dtype="<f4")
    rows[:, :2] = ends.points_in_base()
    rows[:, 2] = height_m
    rows[:, 3] = (red << 16 | green << 8 | blue).astype("<u4").view("<f4")  # PCL's packing
    for column, values in enumerate(
        (cases.case, scan.ranges_m, cases.expected_m, cases.residual_m, cases.weight), start=4
    ):
        rows[:, column] = values[answered]
    return rows
