"""Samples -> the four ranges that each beam may show.

Seed document glass_localization.txt, step 2 (cut off there; the formulation is ours): one ray cast
that goes on behind the first surface gives what a beam would measure if it came back from it (case 1),
was mirrored at it (case 2), or passed one or two panes (cases 3 and 4). The map does not say what is
glass. N samples, B beams; arrays by case have 4 rows, case k in row k - 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.geometry import se2
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan

LEAST_COS = 0.2  # a surface seen flatter than 78 degrees is no worse placed than at that


@dataclass(frozen=True)
class ReferenceRanges:
    """What the map offers to explain each beam, as seen from each sample."""
    range_m: np.ndarray          # (4, N, B) along the beam, inf where the map offers nothing
    cos_incidence: np.ndarray    # (4, N, B) |u . n| at the surface that answers; 1 where it has no normal
    thickness_m: np.ndarray      # (4, N, B) of the wall that answers, as drawn
    cell: np.ndarray             # (3, N, B) int32 flat cell of the first, second, third surface, -1: none
    pane_incidence: np.ndarray   # (N, B) angle to the normal of the first surface [rad], NaN without one


def of(caster: RayCaster, thickness_m: np.ndarray, samples: np.ndarray, scan: Scan,
       max_thickness_m: float, min_linearity: float) -> ReferenceRanges:
    """References of every beam of the scan from every sample.

    Args:
        caster: of the map.
        thickness_m: (H * W,) of the map's walls, sensing/wall_thickness.py.
        samples: (N, 3) robot poses in map.
        scan: its ranges are not looked at.
        max_thickness_m: a thicker run of occupied cells cannot be glass and ends the ray.
        min_linearity: below it a surface has no normal: no mirrored reference.
    """
    from_laser = se2.compose(samples, scan.base_from_laser)
    hits = caster.cast_surfaces(from_laser, scan.angles_rad, scan.range_max_m,
                                max_thickness_m=max_thickness_m, min_linearity=min_linearity)
    beam_rad = from_laser[:, 2:3] + scan.angles_rad

    def cos_at(cell: np.ndarray) -> np.ndarray:
        return cos_incidence(caster, beam_rad, cell, min_linearity)

    first = cos_at(hits.first_cell)
    return ReferenceRanges(
        np.stack([hits.first_m, hits.mirrored_m, hits.second_m, hits.third_m]),
        np.stack([first, first, cos_at(hits.second_cell), cos_at(hits.third_cell)]),
        thickness_m[np.stack([hits.first_cell, hits.first_cell, hits.second_cell, hits.third_cell])],
        np.stack([hits.first_cell, hits.second_cell, hits.third_cell]),
        np.where(hits.linearity >= min_linearity, np.arccos(np.clip(first, 0.0, 1.0)), np.nan))


def cos_incidence(caster: RayCaster, beam_rad: np.ndarray, cell: np.ndarray, min_linearity: float) -> np.ndarray:
    """|u . n| of beams (P, B) [rad, in map] at the cells (P, B) they meet; 1 where nothing or no normal is there."""
    normal_rad, linearity = caster.normals()
    usable = (cell >= 0) & (linearity[cell] >= min_linearity)
    return np.where(usable, np.abs(np.cos(beam_rad - normal_rad[cell])), 1.0)
