"""Cases, first surfaces -> the scan as a costmap should see it.

A beam that passed a pane, or was mirrored at it, is cut at the pane: what is drawn on the map is an obstacle, whatever
the lidar sees behind. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges
from glass_nav.vocabulary import BeamCase

_SURE = 0.5  # probability from which a wall counts as glass, and as being there
_NO_RETURN_GLASS, _NO_RETURN_WALL = 0.3, 0.01  # share of the beams that do not return
_DARK_TO_DIM = 3.0  # reflectance of nearly all walls over that of the darkest one a lidar sees
_SAME_WALL_M, _SAME_WALL_RAD = 0.05, np.radians(5.0)


@dataclass(frozen=True)
class SurfaceScan:
    """A scan in which glass is an obstacle."""

    ranges_m: np.ndarray  # (B,) as measured, or the range of the first mapped surface where cut
    cut: np.ndarray  # (B,) bool
    trusted: bool  # False: the pose is unreliable, and nothing is cut


def of(
    ranges_m: np.ndarray,
    case: np.ndarray,
    expected: ExpectedRanges,
    glass: np.ndarray,
    gone: np.ndarray,
    gate_m: np.ndarray,
    max_range_m: float,
    trusted: bool,
) -> SurfaceScan:
    """Cut a scan.

    A beam is cut if its case says that it passed or was mirrored; if it ended beyond the middle of a wall that stands
    there, whatever it met behind; and if it did not return although a wall would have been seen, unless the wall is
    known to be solid.

    Args:
        ranges_m: (B,) as measured, REP 117.
        case: (B,) what each beam met.
        expected: of the pose, its sample 0.
        glass: (2, B) probabilities that the first surface can be seen through, and if so that it is there.
        gone: (B,) bool: the first surface is no longer there, and what passed it passed nothing.
        gate_m: (B,) along the beam; what is measured within it of the first surface is that surface.
        max_range_m: at which the lidar still sees a dark wall, face on.
        trusted: whether the pose is.
    """
    if not trusted:
        return SurfaceScan(ranges_m, np.zeros(len(ranges_m), bool), False)
    seen_through, there = glass
    first_m = expected.line_m[0]
    beside, within = _walls_beside(expected)
    with np.errstate(invalid="ignore"):
        behind = np.isfinite(first_m) & (ranges_m > first_m + gate_m)  # also without a return
    explained = np.isin(case, (BeamCase.SPECULAR, BeamCase.FIRST_PENETRATION, BeamCase.SECOND_PENETRATION))
    lost = np.isposinf(ranges_m) & _would_answer(expected, max_range_m)
    silent = _NO_RETURN_GLASS * seen_through
    gone_through = silent > _SURE * (silent + _NO_RETURN_WALL * (1.0 - seen_through))
    known = seen_through * there > _SURE
    passed = (there > _SURE) & np.where(
        np.isfinite(ranges_m), within, beside & gone_through & lost & _has_beside(behind)
    )
    cut = behind & ~gone & (explained | known | passed)
    return SurfaceScan(np.where(cut, first_m, ranges_m), cut, True)


def _walls_beside(expected: ExpectedRanges) -> "Tuple[np.ndarray, np.ndarray]":
    """(B,) bool each: a beam beside it, and both of them, meet the same straight wall first.

    Where both do, no edge is near that a beam could have missed the wall at.
    """
    first_m = expected.line_m[0]
    with np.errstate(invalid="ignore"):
        apart_m = np.abs(np.diff(first_m * expected.cos_incidence[0, 0]))  # as distances from the lidar
        turned_rad = np.abs(np.diff(expected.axis_rad[0]))
        same = (apart_m < _SAME_WALL_M) & (np.minimum(turned_rad, np.pi - turned_rad) < _SAME_WALL_RAD)
    before, after = np.append(False, same), np.append(same, False)
    return before | after, before & after


def _would_answer(expected: ExpectedRanges, max_range_m: float) -> np.ndarray:
    """(B,) bool: a wall instead of the first surface would be bright enough: power falls with cosine and distance."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return _DARK_TO_DIM * expected.cos_incidence[0, 0] > (expected.line_m[0] / max_range_m) ** 2


def _has_beside(beams: np.ndarray) -> np.ndarray:
    """(B,) bool: one of the beams is beside it; a single one without a return may be a fault of the lidar."""
    return np.append(False, beams[:-1]) | np.append(beams[1:], False)
