"""The scan for a costmap: beams that passed a mapped surface, or were mirrored at it, end there.

Every surface on the map is an obstacle, whatever the lidar sees behind it. If the surface is gone, the next one
behind it counts. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

from glass_nav import _beam_vote
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
    first = _ALONG[0]
    gone = np.flatnonzero(is_gone(expected.cell[first, 0], expected.axis_rad[first]))
    surfaces = FirstSurfaces(
        expected.line_m[first], expected.cos_incidence[first, 0], expected.axis_rad[first], expected.cell[first, 0]
    )
    if not len(gone):
        return surfaces
    range_m, cos, axis_rad, cell = (value.copy() for value in vars(surfaces).values())
    for row in _ALONG[1:]:
        range_m[gone], cos[gone] = expected.line_m[row, gone], expected.cos_incidence[row, 0, gone]
        axis_rad[gone], cell[gone] = expected.axis_rad[row, gone], expected.cell[row, 0, gone]
        gone = gone[is_gone(cell[gone], axis_rad[gone])]
    range_m[gone] = np.inf
    return FirstSurfaces(range_m, cos, axis_rad, cell)


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
    as_cut_m, cut = _beam_vote.cut(
        ranges_m,
        case,
        first.range_m,
        first.cos_incidence,
        first.axis_rad,
        glass,
        gate_m,
        max_range_m,
        _SURE,
        _NO_RETURN_GLASS,
        _NO_RETURN_WALL,
        _DARK_TO_DIM,
        _SAME_WALL_M,
        _SAME_WALL_RAD,
    )
    return SurfaceScan(as_cut_m, cut, True)
