"""A building made from a map, with opaque walls where the map shows them.

The floor is the largest part of the map's free space that a robot fits into. Everything that bounds it is a wall:
occupied cells, and unknown ones, although a real floor might go on there. Only specks of unknown cells without an
occupied one are ignored, as in the atlas. Outlines run through the middles of the cells' faces and are straightened by
less than a cell, so that oblique walls have no steps.
"""

from __future__ import annotations

from typing import List

import numpy as np
from scipy import ndimage

from glass_nav.geometry import se2, segments
from glass_nav.simulation.building import Building, Thing
from glass_nav.simulation.start_place import PASSAGE_M
from glass_nav.world.grid_map import GridMap
from glass_nav.world.wall_segments import outlines

STRAIGHTENED_CELLS = 0.75  # the face middles of a straight wall lie nearer than this to a line
SPECK_M = 0.25  # smaller things that are entirely unknown are ignored


def build(grid_map: GridMap, name: str) -> Building:
    """The floor of a map.

    Args:
        grid_map: any.
        name: of the building.

    Raises:
        ValueError: the map has no room for a robot.
    """
    floor = grid_map.free | _specks(grid_map)
    room_m = ndimage.distance_transform_edt(np.pad(floor, 1))[1:-1, 1:-1] * grid_map.resolution_m
    parts, count = ndimage.label(room_m >= PASSAGE_M, np.ones((3, 3), bool))
    if not count:
        raise ValueError(f"{name}: no free place in the map has {PASSAGE_M:g} m of room around it")
    largest = int(np.bincount(parts[parts > 0]).argmax())
    row, column = np.divmod(np.argmax(np.where(parts == largest, room_m, 0.0)), floor.shape[1])
    pieces, _ = ndimage.label(floor)
    things = tuple(
        Thing(se2.transform_points(grid_map.map_from_grid, line * grid_map.resolution_m))
        for line in map(_straightened, outlines(pieces == pieces[row, column]))
    )
    start = np.append(grid_map.centres(np.array(row), np.array(column)), 0.0)
    return Building((), things=things, start=start, name=name)


def _specks(grid_map: GridMap) -> np.ndarray:
    """(H, W) bool: unknown cells in small pieces without an occupied cell."""
    pieces, count = ndimage.label(~grid_map.free, np.ones((3, 3), bool))
    nothing = np.ones(count + 1, bool)
    nothing[0] = False
    nothing[pieces[grid_map.occupied]] = False
    for number, window in enumerate(ndimage.find_objects(pieces), start=1):
        nothing[number] &= max(side.stop - side.start for side in window) * grid_map.resolution_m < SPECK_M
    return nothing[pieces]


def _straightened(outline: np.ndarray) -> np.ndarray:
    """(k, 2) the significant corners of a closed line (n, 2), at least three."""
    middles = 0.5 * (outline + np.roll(outline, -1, axis=0))
    begin = int(np.argmax(np.hypot(*(middles - middles.mean(axis=0)).T)))
    closed = np.concatenate([middles[begin:], middles[: begin + 1]])
    kept: List[int] = segments.corners(closed, STRAIGHTENED_CELLS)[:-1].tolist()
    return closed[kept] if len(kept) > 2 else closed[:-1]
