"""The four ranges that each beam may measure, from each preliminary sample.

Seed document glass_localization.txt, step 2 (cut off there; the formulation is ours). One ray cast that continues
behind the first surface gives the range of a beam that returned from that surface (case 1), was mirrored there (case
2), or passed one or two panes (cases 3 and 4). The map does not mark glass. A corner or a post without a normal is
drawn up to a cell too large, and beams that graze it on the map may miss it: half of the samples see past it. N
samples, B beams; arrays by case have 4 rows, case k in row k - 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.geometry import se2
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan

MIN_COS = 0.2  # a surface seen flatter than 78 degrees is no worse placed than at that
_NOWHERE_M = 1e-9


@dataclass(frozen=True)
class ExpectedRanges:
    """Ranges that the map predicts for each beam from each sample; for sample 0, the pose itself, with more detail."""

    range_m: np.ndarray  # (4, N, B) along the beam, inf where the map has no surface
    cos_incidence: np.ndarray  # (4, N, B) |u . n| at the surface that returns it; 1 where it has no normal
    thickness_m: np.ndarray  # (4, N, B) of the wall that returns it, as drawn
    cell: np.ndarray  # (4, N, B) int32 flat cell that returns it, -1: none
    pane_incidence: np.ndarray  # (1, B) angle to the normal of sample 0's first surface [rad], NaN without one
    line_m: np.ndarray  # (4, B) range of sample 0 by the lines of the walls, face_m behind the near faces
    axis_rad: np.ndarray  # (4, B) axes of their normals in map, up to half a turn; NaN: none. Case 2: mirrored
    face_m: float  # half a cell
    seen_side: np.ndarray  # (4, B) bool: sample 0's surfaces are met from a side that is not unknown


def of(
    caster: RayCaster,
    thickness_m: np.ndarray,
    samples: np.ndarray,
    scan: Scan,
    max_thickness_m: float,
    min_linearity: float,
    behind_m: float = np.inf,
    gate_m: float = np.inf,
    depth_share: float = 1.0,
    mirrored_by_line: bool = True,
) -> ExpectedRanges:
    """Expected ranges of every beam of the scan from every sample.

    Args:
        caster: of the map.
        thickness_m: (H * W,) of the map's walls, sensing/wall_thickness.py.
        samples: (N, 3) robot poses in map.
        scan: its ranges matter for behind_m and gate_m only.
        max_thickness_m: a thicker run of occupied cells cannot be glass and ends the ray.
        min_linearity: below it a surface has no normal: no mirrored range.
        behind_m: all samples but the first look no farther behind the end of a beam than that, and nowhere where a beam
            did not return; inf: everywhere.
        gate_m: across a surface; samples other than the first may leave out the second, third and mirrored surfaces
            that are farther from the end of a beam; inf: they see all.
        depth_share: of the drawn thickness of a wall: how deep in it beams end; for the gate.
        mirrored_by_line: the mirrored ranges are those by the lines of the walls; else by their cells.
    """
    found = caster.expected_paths(
        thickness_m,
        se2.compose(samples, scan.base_from_laser),
        scan.angles_rad,
        scan.range_max_m,
        scan.ranges_m,
        _reach_m(scan, behind_m),
        gate_m,
        depth_share,
        max_thickness_m,
        min_linearity,
        mirrored_by_line=mirrored_by_line,
    )
    return ExpectedRanges(**vars(found), face_m=0.5 * caster.grid_map.resolution_m)


def _reach_m(scan: Scan, behind_m: float) -> np.ndarray:
    """(B,) how far to look along each beam."""
    if not np.isfinite(behind_m):
        return np.full(len(scan), scan.range_max_m)
    return np.where(scan.answered, np.minimum(np.abs(scan.ranges_m) + behind_m, scan.range_max_m), _NOWHERE_M)


def cos_incidence(caster: RayCaster, beam_rad: np.ndarray, cell: np.ndarray, min_linearity: float) -> np.ndarray:
    """|u . n| of beams (P, B) [rad, in map] at the cells (P, B) they meet; 1 where nothing or no normal is there."""
    normal_rad, linearity, _ = caster.walls_at(cell)
    usable = (cell >= 0) & (linearity >= min_linearity)
    return np.where(usable, np.abs(np.cos(beam_rad - normal_rad)), 1.0)
