"""A second opinion on expected ranges: in numpy, every surface from every sample by a ray cast of its own.

The tests hold the compiled expected ranges against it. N samples, B beams; arrays by case have 4 rows.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.localization.beam_classification.expected_ranges import MIN_COS, ExpectedRanges, cos_incidence
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import UNKNOWN, GridMap

_FIRST, _SECOND, _THIRD = 0, 2, 3  # rows
_NOWHERE_M = 1e-9
_BESIDE_CELLS = 2.5  # in front of a surface: past the steps of its staircase
_BOTH_FACES_CELLS = 3.0  # a wall up to so thick has one line through all its cells
_LINE_CELLS, _GRAZING_COS = 2.0, 0.02  # the line of a wall lies so near to the cells that a beam meets


def of(
    caster: RayCaster,
    thickness_m: np.ndarray,
    samples: np.ndarray,
    scan: Scan,
    max_thickness_m: float,
    min_linearity: float,
    behind_m: float = np.inf,
    mirrored_by_line: bool = True,
) -> ExpectedRanges:
    """As expected_ranges.of(), without a gate."""
    from_laser = se2.compose(samples, scan.base_from_laser)
    paths = caster.cast_paths(from_laser, scan.angles_rad, _reach_m(scan, behind_m), max_thickness_m, min_linearity)
    range_m, cos, cell = paths.range_m, paths.cos_incidence, paths.cell
    _miss_corners(caster, min_linearity, range_m, cos, cell)
    hits = caster.cast_surfaces(
        from_laser[:1], scan.angles_rad, scan.range_max_m, max_thickness_m=max_thickness_m, min_linearity=min_linearity
    )
    beam_rad = from_laser[0, 2] + scan.angles_rad
    mirrored_rad = 2.0 * hits.normal_rad[0] + np.pi - beam_rad
    range_m[:, 0] = np.concatenate([hits.first_m, hits.mirrored_m, hits.second_m, hits.third_m])
    cell[:, 0] = np.concatenate([hits.first_cell, hits.mirrored_cell, hits.second_cell, hits.third_cell])
    cos[:, 0] = cos_incidence(caster, np.stack([beam_rad, mirrored_rad, beam_rad, beam_rad]), cell[:, 0], min_linearity)
    if mirrored_by_line:
        range_m[1] = _mirrored_by_line(
            caster, thickness_m, from_laser, scan.angles_rad, range_m[1], cell[:2], min_linearity
        )
    has_normal = hits.linearity >= min_linearity
    incidence = np.where(has_normal, np.arccos(np.clip(cos[0, :1], 0.0, 1.0)), np.nan)
    normal_rad, linearity = caster.normals()
    directions_rad = np.stack([beam_rad, np.nan_to_num(mirrored_rad), beam_rad, beam_rad])
    axis_rad = np.where((cell[:, 0] >= 0) & (linearity[cell[:, 0]] >= min_linearity), normal_rad[cell[:, 0]], np.nan)
    line_m = _by_line(caster, thickness_m, from_laser[0], beam_rad, range_m[:, 0], cell[:, 0], axis_rad)
    face_m = 0.5 * caster.grid_map.resolution_m
    seen_side = _seen_side(caster.grid_map, cell[:, 0], axis_rad, directions_rad)
    line_m[1] = range_m[1, 0] + face_m / np.maximum(cos[1, 0], MIN_COS) + 2.0 * face_m * cos[0, 0]
    axis_rad[1] = 2.0 * hits.normal_rad[0] + np.pi - axis_rad[1]
    return ExpectedRanges(range_m, cos, thickness_m[cell], cell, incidence, line_m, axis_rad, face_m, seen_side)


def _reach_m(scan: Scan, behind_m: float) -> np.ndarray:
    """(B,) how far to look along each beam."""
    if not np.isfinite(behind_m):
        return np.full(len(scan), scan.range_max_m)
    return np.where(scan.answered, np.minimum(np.abs(scan.ranges_m) + behind_m, scan.range_max_m), _NOWHERE_M)


def _seen_side(grid_map: GridMap, cell: np.ndarray, axis_rad: np.ndarray, direction_rad: np.ndarray) -> np.ndarray:
    """(4, B) bool: the side of the cells (4, B) that the beams come from is not unknown.

    A mapper draws what it sees. A lidar that looks back at a building through its glass meets the outer faces of walls,
    which are on no map: decimetres in front of the inner ones.
    """
    facing_rad = np.where(np.isnan(axis_rad), direction_rad + np.pi, axis_rad)
    facing_rad = np.where(np.cos(direction_rad - facing_rad) > 0.0, facing_rad + np.pi, facing_rad)
    centre = grid_map.centres(*np.divmod(cell, grid_map.occupancy.shape[1]))
    step = np.stack([np.cos(facing_rad), np.sin(facing_rad)], axis=-1)
    rows, columns = grid_map.cells(centre + _BESIDE_CELLS * grid_map.resolution_m * step)
    inside = grid_map.contains(rows, columns)
    beside = grid_map.occupancy[np.where(inside, rows, 0), np.where(inside, columns, 0)]
    return (cell < 0) | (inside & (beside != UNKNOWN))


def _miss_corners(
    caster: RayCaster, min_linearity: float, range_m: np.ndarray, cos: np.ndarray, cell: np.ndarray
) -> None:
    """Let beams pass first and second surfaces without a normal: of each sample every other beam, for each beam every
    other sample but the first, which is the predicted pose itself. Works on expected (4, N, B) in place.
    """
    samples, beams = cell.shape[1:]
    missed = (np.arange(samples)[:, None] + np.arange(beams)) % 2 == 1
    missed[:1] = False
    at = np.flatnonzero(missed.ravel() & (cell[_FIRST].ravel() >= 0))
    linearity = caster.normals()[1]
    first, second = (cell[path].ravel()[at] for path in (_FIRST, _SECOND))
    _miss((_SECOND, _THIRD), at[(second >= 0) & (linearity[second] < min_linearity)], range_m, cos, cell)
    _miss((_FIRST, _SECOND, _THIRD), at[linearity[first] < min_linearity], range_m, cos, cell)


def _miss(order: Tuple[int, ...], at: np.ndarray, range_m: np.ndarray, cos: np.ndarray, cell: np.ndarray) -> None:
    """Take a surface out of the expected (4, N, B) at flat places (N, B); what is behind it moves up."""
    for values, nothing in ((range_m, np.inf), (cos, 1.0), (cell, -1)):
        flat = values.reshape(len(values), -1)
        for to, source in zip(order, order[1:]):
            flat[to, at] = flat[source, at]
        flat[order[-1], at] = nothing


def _by_line(
    caster: RayCaster,
    thickness_m: np.ndarray,
    from_laser: np.ndarray,
    beam_rad: np.ndarray,
    range_m: np.ndarray,
    cell: np.ndarray,
    axis_rad: np.ndarray,
) -> np.ndarray:
    """(4, B) ranges at which the beams of one sample cross the lines of the walls whose cells (4, B) they meet, half a
    cell behind the near faces; range_m (4, B) and half a cell where there is no line.

    A grazing beam enters the staircase of a wall's cells decimetres before it comes to the wall.
    """
    grid_map = caster.grid_map
    centre = grid_map.centres(*np.divmod(cell, grid_map.occupancy.shape[1]))
    normal = np.stack([np.cos(axis_rad), np.sin(axis_rad)], axis=-1)
    distance_m = np.sum((centre - from_laser[:2]) * normal, axis=-1) + caster.wall_offsets_m()[cell]
    cells = thickness_m[cell] / grid_map.resolution_m
    middle = np.where(cells <= _BOTH_FACES_CELLS, 0.5 * (cells - 1.0), 0.0)  # a thicker wall has a line for each face
    distance_m -= np.sign(distance_m) * np.maximum(middle, 0.0) * grid_map.resolution_m
    cos = np.cos(beam_rad - axis_rad)
    half_m = 0.5 * grid_map.resolution_m
    with np.errstate(divide="ignore", invalid="ignore"):
        line_m = distance_m / cos
        holds = np.abs(line_m - range_m) * np.abs(cos) <= _LINE_CELLS * grid_map.resolution_m
        return np.where(
            holds & (np.abs(cos) >= _GRAZING_COS),
            line_m,
            range_m + half_m / np.where(np.isnan(cos), 1.0, np.maximum(np.abs(cos), MIN_COS)),
        )


def _mirrored_by_line(
    caster: RayCaster,
    thickness_m: np.ndarray,
    from_laser: np.ndarray,
    angles_rad: np.ndarray,
    range_m: np.ndarray,
    cell: np.ndarray,
    min_linearity: float,
) -> np.ndarray:
    """(N, B) mirrored ranges to the near faces by the lines of both walls; range_m (N, B) where there is no line.

    The steps of a slanted mirror move the image by up to two cells.

    Args:
        from_laser: (N, 3) poses of the laser in map.
        cell: (2, N, B) that mirror and that return the beam.
    """
    normal_rad, linearity = caster.normals()
    at = np.nonzero((cell >= 0).all(axis=0) & (linearity[cell] >= min_linearity).all(axis=0))
    mirror, target = cell[:, at[0], at[1]]
    beam_rad = from_laser[at[0], 2] + angles_rad[at[1]]
    half_m = 0.5 * caster.grid_map.resolution_m
    to_mirror, to_mirror_m = _to_line(caster, thickness_m, from_laser[at[0], :2], mirror)
    image_m = from_laser[at[0], :2] + 2.0 * to_mirror_m[:, None] * to_mirror
    turned_rad = 2.0 * normal_rad[mirror] + np.pi - beam_rad
    to_target, to_target_m = _to_line(caster, thickness_m, image_m, target)
    cos_mirror = np.abs(np.cos(beam_rad - normal_rad[mirror]))
    cos = np.cos(turned_rad) * to_target[:, 0] + np.sin(turned_rad) * to_target[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        line_m = to_target_m / cos - half_m / np.maximum(np.abs(cos), MIN_COS) - 2.0 * half_m * cos_mirror
        near_m = _LINE_CELLS * caster.grid_map.resolution_m * (1.0 + 2.0 * cos_mirror)
        holds = (np.abs(line_m - range_m[at]) * np.abs(cos) <= near_m) & (np.abs(cos) >= _GRAZING_COS)
    by_line_m = range_m.copy()
    by_line_m[at] = np.where(holds, line_m, range_m[at])
    return by_line_m


def _to_line(
    caster: RayCaster, thickness_m: np.ndarray, from_m: np.ndarray, cell: np.ndarray
) -> Tuple[np.ndarray, np.ndarray]:
    """Normals (M, 2) of the walls of cells (M,), and along them the distances [m] from points (M, 2) to the walls' lines,
    half a cell behind the faces on the side of the points.
    """
    grid_map = caster.grid_map
    normal_rad = caster.normals()[0][cell]
    normal = np.stack([np.cos(normal_rad), np.sin(normal_rad)], axis=-1)
    centre = grid_map.centres(*np.divmod(cell, grid_map.occupancy.shape[1]))
    distance_m = np.sum((centre - from_m) * normal, axis=-1) + caster.wall_offsets_m()[cell]
    cells = thickness_m[cell] / grid_map.resolution_m
    middle = np.where(cells <= _BOTH_FACES_CELLS, 0.5 * (cells - 1.0), 0.0)  # a thicker wall has a line for each face
    return normal, distance_m - np.sign(distance_m) * np.maximum(middle, 0.0) * grid_map.resolution_m
