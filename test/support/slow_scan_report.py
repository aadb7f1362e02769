"""A second opinion on what a scan says of the pose and where it is cut: in numpy. The tests hold the compiled one against it.

B beams.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np

from glass_nav.localization.beam_classification.beam_evidence import BeamEvidence
from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges
from glass_nav.localization.beam_classification.surface_scan import (
    _DARK_TO_DIM,
    _NO_RETURN_GLASS,
    _NO_RETURN_WALL,
    _SAME_WALL_M,
    _SAME_WALL_RAD,
    _SURE,
    FirstSurfaces,
    SurfaceScan,
)
from glass_nav.vocabulary import BeamCase


def evidence(
    measured_m: np.ndarray, case: np.ndarray, expected: ExpectedRanges, seen_through: np.ndarray, known_end: np.ndarray
) -> BeamEvidence:
    """As beam_evidence.of()."""
    answered = np.isfinite(measured_m)
    unexplained = answered & (case == 0)
    with np.errstate(invalid="ignore"):
        crossed = measured_m > expected.line_m[0]
    weight = np.where(known_end, 1.0, np.where(crossed, 1.0 - seen_through, 0.0))
    return BeamEvidence(
        float(np.count_nonzero(answered)),
        float(np.count_nonzero(answered & (case > 0))),
        float(weight[unexplained & ~crossed].sum()),
        float(weight[unexplained & crossed].sum()),
    )


def cut(
    ranges_m: np.ndarray,
    case: np.ndarray,
    first: FirstSurfaces,
    glass: np.ndarray,
    gate_m: np.ndarray,
    max_range_m: float,
) -> SurfaceScan:
    """As surface_scan.of() at a trusted pose."""
    seen_through, there = glass
    beside, within = _walls_beside(first)
    with np.errstate(invalid="ignore"):
        behind = np.isfinite(first.range_m) & (ranges_m > first.range_m + gate_m)  # also without a return
    explained = np.isin(case, (BeamCase.SPECULAR, BeamCase.FIRST_PENETRATION, BeamCase.SECOND_PENETRATION))
    lost = np.isposinf(ranges_m) & _would_answer(first, max_range_m)
    silent = _NO_RETURN_GLASS * seen_through
    gone_through = silent > _SURE * (silent + _NO_RETURN_WALL * (1.0 - seen_through))
    known = seen_through * there > _SURE
    passed = (there > _SURE) & np.where(
        np.isfinite(ranges_m), within, beside & gone_through & lost & _has_beside(behind)
    )
    cut = behind & (explained | known | passed)
    return SurfaceScan(np.where(cut, first.range_m, ranges_m), cut, True)


def _walls_beside(first: FirstSurfaces) -> "Tuple[np.ndarray, np.ndarray]":
    """(B,) bool each: a beam beside it, and both of them, meet the same straight wall first.

    Where both do, no edge is near that a beam could have missed the wall at.
    """
    with np.errstate(invalid="ignore"):
        apart_m = np.abs(np.diff(first.range_m * first.cos_incidence))  # as distances from the lidar
        turned_rad = np.abs(np.diff(first.axis_rad))
        same = (apart_m < _SAME_WALL_M) & (np.minimum(turned_rad, np.pi - turned_rad) < _SAME_WALL_RAD)
    before, after = np.append(False, same), np.append(same, False)
    return before | after, before & after


def _would_answer(first: FirstSurfaces, max_range_m: float) -> np.ndarray:
    """(B,) bool: a wall instead of the first surface would be bright enough: power falls with cosine and distance."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return _DARK_TO_DIM * first.cos_incidence > (first.range_m / max_range_m) ** 2


def _has_beside(beams: np.ndarray) -> np.ndarray:
    """(B,) bool: one of the beams is beside it; a single one without a return may be a fault of the lidar."""
    return np.append(False, beams[:-1]) | np.append(beams[1:], False)
