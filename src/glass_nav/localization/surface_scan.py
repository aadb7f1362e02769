"""Cases, first surfaces -> the scan as a costmap should see it.

A beam that passed a pane, or was mirrored at it, is cut at the pane: what is drawn on the map stands in
the robot's way, whatever the lidar sees behind. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.localization.beam_cases import FIRST_PENETRATION, SECOND_PENETRATION, SPECULAR

_SURE = 0.5  # a beam without an answer, or with an unexplained one behind a wall, is cut at such a cell


@dataclass(frozen=True)
class SurfaceScan:
    """A scan in which glass is an obstacle."""
    ranges_m: np.ndarray  # (B,) as measured, or the range of the first mapped surface where cut
    cut: np.ndarray       # (B,) bool
    trusted: bool         # False: the pose is not to be relied on, and nothing is cut


def of(ranges_m: np.ndarray, case: np.ndarray, first_m: np.ndarray, seen_through: np.ndarray, gate_m: np.ndarray,
       trusted: bool) -> SurfaceScan:
    """Cut a scan.

    Args:
        ranges_m: (B,) as measured, REP 117.
        case: (B,) what each beam met.
        first_m: (B,) range of the first surface of the map at the pose, inf: none.
        seen_through: (B,) chance of that surface to let beams pass.
        gate_m: (B,) along the beam; what is measured within it of the first surface is that surface.
        trusted: whether the pose is.
    """
    if not trusted:
        return SurfaceScan(ranges_m, np.zeros(len(ranges_m), bool), False)
    with np.errstate(invalid="ignore"):
        behind = ranges_m > first_m + gate_m  # also without an answer (inf)
    explained = np.isin(case, (SPECULAR, FIRST_PENETRATION, SECOND_PENETRATION))
    cut = np.isfinite(first_m) & behind & (explained | (seen_through > _SURE))
    return SurfaceScan(np.where(cut, first_m, ranges_m), cut, True)
