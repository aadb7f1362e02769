"""Fits line segments to the walls of a map as seen from free space.

The outline of free space is followed face by face, a face being a side between a free cell and another. Segments are
fitted to the centres of the occupied cells behind the faces: beams that end at a wall draw it there. Glass is a wall.
Mappers leave gaps in walls and unknown cells before them, so unknown cells close to an occupied one count as occupied.
F faces, S segments.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List

import numpy as np
from scipy import ndimage

from glass_nav.geometry import se2, segments
from glass_nav.world.grid_map import GridMap

TOLERANCE_CELLS = 1.5  # a wall that was mapped rough is still one segment
FINE_TOLERANCE_CELLS = 1.0  # for placing a scan: what stands out of a wall must not tilt it
CLOSE_CELLS = 2  # an unknown cell this close to an occupied one is wall
MIN_LENGTH_M = 0.3
GAP_M = 0.3  # of unknown cells within one wall

_STEP = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])  # along a face: east, north, west, south; free space to the left
_BEHIND = np.array([[0, -1], [1, 0], [0, 1], [-1, 0]])  # from the free cell to the one behind the face
_START = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])  # corner of the free cell where the face starts


@dataclass(frozen=True)
class WallSegments:
    """Segments in the frame map, and which face of the outline belongs to which."""

    segments_m: np.ndarray  # (S, 4) x1 y1 x2 y2, with the free space to the left
    faces_m: np.ndarray  # (F, 2) middles of the faces of occupied cells
    face_segment: np.ndarray  # (F,) int: its segment, segments.NO_SEGMENT for none


def walls_closed(grid_map: GridMap) -> GridMap:
    """The map with unknown cells in and before its walls marked occupied."""
    near = ndimage.binary_dilation(grid_map.occupied, np.ones((3, 3), bool), iterations=CLOSE_CELLS)
    occupancy = np.where(near & (grid_map.occupancy < 0), np.int8(100), grid_map.occupancy)
    return GridMap(occupancy, grid_map.resolution_m, grid_map.map_from_grid)


def extract(grid_map: GridMap, tolerance_cells: float = TOLERANCE_CELLS) -> WallSegments:
    """Fits segments to all walls of a map, each cell within tolerance of its line; none without walls."""
    grid_map = walls_closed(grid_map)
    resolution_m = grid_map.resolution_m
    cell, side = _faces(grid_map.free)
    behind = cell + _BEHIND[side]
    inside = grid_map.contains(behind[:, 1], behind[:, 0])
    wall = inside.copy()
    wall[inside] = grid_map.occupied[behind[inside, 1], behind[inside, 0]]
    gap = max(int(GAP_M / resolution_m), 1)
    rows: List[np.ndarray] = []
    label = np.full(len(cell), segments.NO_SEGMENT)
    count = 0
    for loop in _loops(cell, side):
        for chain in _without_gaps(loop, wall, gap):
            found, its = segments.split_and_merge(behind[chain] + 0.5, tolerance_cells, MIN_LENGTH_M / resolution_m)
            label[chain] = np.where(its >= 0, its + count, its)
            count += len(found)
            rows.append(found)
    ends = np.concatenate(rows).reshape(-1, 2) if rows else np.zeros((0, 2))
    faces = cell + 0.5 + 0.5 * _BEHIND[side]
    return WallSegments(_in_map(grid_map, ends).reshape(-1, 4), _in_map(grid_map, faces[wall]), label[wall])


def outlines(cells: np.ndarray) -> List[np.ndarray]:
    """Closed lines (n, 2) of corners x, y, in cells, around each piece (H, W) bool and each hole in it; the piece is to
    the left.
    """
    cell, side = _faces(cells)
    return [(cell + _START[side])[loop] for loop in _loops(cell, side)]


def _in_map(grid_map: GridMap, points: np.ndarray) -> np.ndarray:
    return se2.transform_points(grid_map.map_from_grid, points * grid_map.resolution_m)


def _faces(free: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """Column and row (F, 2) of the free cell of each face, and (F,) its side as in _STEP."""
    padded = np.pad(free, 1)
    cells, sides = [], []
    for side, (right, up) in enumerate(_BEHIND):
        beyond = padded[1 + up : padded.shape[0] - 1 + up, 1 + right : padded.shape[1] - 1 + right]
        rows, columns = np.nonzero(free & ~beyond)
        cells.append(np.column_stack([columns, rows]))
        sides.append(np.full(len(rows), side))
    return np.concatenate(cells), np.concatenate(sides)


def _loops(cell: np.ndarray, side: np.ndarray) -> List[np.ndarray]:
    """Faces in order along each closed outline; where two outlines touch, free space is cut at the corner."""
    width = int(cell[:, 0].max()) + 2 if len(cell) else 1
    start = cell + _START[side]
    end = start + _STEP[side]
    key = (start[:, 1] * width + start[:, 0]) * 4 + side
    order = np.argsort(key)
    following = np.full(len(cell), -1)
    for turn in (1, 0, 3):  # left, straight on, right
        wanted = (end[:, 1] * width + end[:, 0]) * 4 + (side + turn) % 4
        at = np.minimum(np.searchsorted(key[order], wanted), max(len(key) - 1, 0))
        there = (following < 0) & (key[order][at] == wanted) if len(key) else np.zeros(0, bool)
        following[there] = order[at[there]]
    after = following.tolist()
    walked = [False] * len(after)
    loops = []
    for first in range(len(after)):
        if not walked[first]:
            loop, face = [], first
            while not walked[face]:
                walked[face] = True
                loop.append(face)
                face = after[face]
            loops.append(np.array(loop))
    return loops


def _without_gaps(loop: np.ndarray, wall: np.ndarray, gap: int) -> List[np.ndarray]:
    """The wall faces of a closed outline, cut where as many consecutive faces are no wall; else at a corner."""
    at = np.flatnonzero(wall[loop])
    if not len(at):
        return []
    missing = np.diff(at, append=at[0] + len(loop)) - 1
    cuts = np.flatnonzero(missing >= gap) + 1
    if not len(cuts):
        return [loop]
    return [loop[piece] for piece in np.split(np.roll(at, -int(cuts[-1])), (cuts[:-1] + len(at) - cuts[-1]))]
