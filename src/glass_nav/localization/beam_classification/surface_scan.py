"""Cases, first surfaces that stand -> the scan as a costmap should see it.

A beam that passed a pane, or was mirrored at it, is cut at the pane: what is drawn on the map is an obstacle, whatever
the lidar sees behind. Where what is drawn is gone, the next surface behind it counts. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Tuple

import numpy as np

from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges
from glass_nav.vocabulary import BeamCase

_SURE = 0.5  # probability from which a wall counts as glass, and as being there
_NO_RETURN_GLASS, _NO_RETURN_WALL = 0.3, 0.01  # share of the beams that do not return
_DARK_TO_DIM = 3.0  # reflectance of nearly all walls over that of the darkest one a lidar sees
_SAME_WALL_M, _SAME_WALL_RAD = 0.05, np.radians(5.0)
_ALONG = (BeamCase.DIFFUSE - 1, BeamCase.FIRST_PENETRATION - 1, BeamCase.SECOND_PENETRATION - 1)  # rows, by range


@dataclass(frozen=True)
class FirstSurfaces:
    """The first mapped surface along each beam that is still there; (B,) each."""

    range_m: np.ndarray  # by the line of the wall, inf: none
    cos_incidence: np.ndarray  # 1 where it has no normal
    axis_rad: np.ndarray  # of its normal in map, up to half a turn; NaN: none
    cell: np.ndarray  # int, -1: none


def standing(expected: ExpectedRanges, is_gone: "Callable[[np.ndarray, np.ndarray], np.ndarray]") -> FirstSurfaces:
    """The first surfaces that stand, of up to three along each beam.

    Args:
        expected: of the pose, its sample 0.
        is_gone: for cells (G,) and axes (G,): (G,) bool.
    """
    beams = np.arange(expected.line_m.shape[1])
    row = np.full(len(beams), _ALONG[0])
    asked = beams
    for after in (*_ALONG[1:], None):
        at = row[asked]
        asked = asked[is_gone(expected.cell[at, 0, asked], expected.axis_rad[at, asked])]
        if after is None or not len(asked):
            break
        row[asked] = after
    range_m = expected.line_m[row, beams]
    range_m[asked] = np.inf
    return FirstSurfaces(
        range_m, expected.cos_incidence[row, 0, beams], expected.axis_rad[row, beams], expected.cell[row, 0, beams]
    )


@dataclass(frozen=True)
class SurfaceScan:
    """A scan in which glass is an obstacle."""

    ranges_m: np.ndarray  # (B,) as measured, or the range of the first mapped surface where cut
    cut: np.ndarray  # (B,) bool
    trusted: bool  # False: the pose is unreliable, and nothing is cut


def of(
    ranges_m: np.ndarray,
    case: np.ndarray,
    first: FirstSurfaces,
    glass: np.ndarray,
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
        first: along the beams from the pose.
        glass: (2, B) probabilities that the first surface can be seen through, and if so that it is there.
        gate_m: (B,) along the beam; what is measured within it of the first surface is that surface.
        max_range_m: at which the lidar still sees a dark wall, face on.
        trusted: whether the pose is.
    """
    if not trusted:
        return SurfaceScan(ranges_m, np.zeros(len(ranges_m), bool), False)
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
