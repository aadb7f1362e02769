"""Building -> GridMap: the map that a lidar mapper drew before anything changed.

The mapper drove all paths and looked into the rooms that contain the points `seen`. Cells that can be reached from
there without crossing a surface are free; surfaces that border on them are occupied, glass like any wall. The rest is
unknown: the inside of walls and furniture, the far side of walls, unseen rooms, outside. H rows, W columns.
"""

from __future__ import annotations

import os
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Collection, List, Tuple, Union

import numpy as np
from scipy import ndimage

from glass_nav.simulation import building_file
from glass_nav.simulation.building import OPAQUE, Building
from glass_nav.world import landmark_file, map_file
from glass_nav.world.grid_map import UNKNOWN, GridMap

LANDMARKS_NAME = "landmarks.yaml"
MARGIN_M = 1.0  # of unknown cells around the building
RESOLUTION_M = 0.05
STEPS_PER_CELL = 10
MIN_SHARE = 0.35  # of a cell's width that a surface must cross: where it only cuts a corner, more beams pass than end


def draw(building: Building, resolution_m: float = RESOLUTION_M, erased: Collection[int] = ()) -> GridMap:
    """The map of a building: mapped things only, removed ones included.

    Args:
        building: if it is open to the outside, the outside within MARGIN_M counts as seen.
        resolution_m: edge length of a cell, > 0.
        erased: indices of panes that the mapper took for free space; the rest of the map is the same.
    """
    if not (np.isfinite(resolution_m) and resolution_m > 0.0):
        raise ValueError(f"a map needs resolution > 0 m, got {resolution_m}")
    from_m, to_m = _mapped_lines(building)
    seeds = np.concatenate(
        [
            building.start[None, :2],
            building.seen_m,
            *(_points(path[:-1], path[1:], resolution_m) for path in building.paths.values()),
        ]
    )
    ends = np.concatenate([from_m, to_m, seeds])
    low = np.floor((ends.min(axis=0) - MARGIN_M) / resolution_m).astype(int)
    columns, rows = np.ceil((ends.max(axis=0) + MARGIN_M) / resolution_m).astype(int) - low
    grid = GridMap(np.full((rows, columns), UNKNOWN, np.int8), resolution_m, np.append(low * resolution_m, 0.0))
    surface = _surface(grid, from_m, to_m)
    regions, _ = ndimage.label(~surface)  # connected by edges
    reached = np.unique(regions[grid.cells(seeds)])
    free = np.isin(regions, reached[reached > 0])
    grid.occupancy[free] = 0
    grid.occupancy[surface & ndimage.binary_dilation(free, np.ones((3, 3), bool))] = 100
    if erased:
        kept = tuple(pane for index, pane in enumerate(building.panes) if index not in erased)
        grid.occupancy[grid.occupied & ~_surface(grid, *_mapped_lines(replace(building, panes=kept)))] = 0
    return grid


def redraw(folder: "Union[str, os.PathLike[str]]") -> None:
    """Write map.yaml, map.png and, if the building has tags, landmarks.yaml beside a folder's building.yaml."""
    building = building_file.load(folder)
    map_file.save(draw(building), Path(folder) / "map.yaml", ".png")
    if len(building.tags):
        landmark_file.save(building.tags, Path(folder) / LANDMARKS_NAME, f"the tags of {building.name}, drawn")


def is_drawn(building: Building, points_m: np.ndarray) -> np.ndarray:
    """(...) bool: the building's map has a surface at the point (..., 2) or in a neighbouring cell."""
    grid, near = _near_surfaces(building)
    rows, columns = grid.cells(points_m)
    inside = grid.contains(rows, columns)
    return inside & near[np.where(inside, rows, 0), np.where(inside, columns, 0)]


@lru_cache(maxsize=16)
def _near_surfaces(building: Building) -> Tuple[GridMap, np.ndarray]:
    """The map, and (H, W) bool: occupied there or in one of the 8 cells around."""
    grid = draw(building)
    return grid, ndimage.binary_dilation(grid.occupied, np.ones((3, 3), bool))


def _mapped_lines(building: Building) -> Tuple[np.ndarray, np.ndarray]:
    """Ends (L, 2), (L, 2) of the lines to draw; a glazing is one line."""
    surfaces = building.surfaces
    opaque = surfaces.mapped & (surfaces.kind == OPAQUE)
    lines: List[np.ndarray] = [pane.line_m for pane in building.panes if not pane.film]
    lines += [mirror.line_m for mirror in building.mirrors]
    glass = np.array(lines, float).reshape(-1, 2, 2)
    return (
        np.concatenate([surfaces.from_m[opaque], glass[:, 0]]),
        np.concatenate([surfaces.to_m[opaque], glass[:, 1]]),
    )


def _surface(grid: GridMap, from_m: np.ndarray, to_m: np.ndarray) -> np.ndarray:
    """(H, W) bool: cells that a line crosses, not only at a corner."""
    rows, columns = grid.occupancy.shape
    row, column = grid.cells(_points(from_m, to_m, grid.resolution_m / STEPS_PER_CELL))
    points = np.bincount(row * columns + column, minlength=rows * columns).reshape(rows, columns)
    return points >= MIN_SHARE * STEPS_PER_CELL


def _points(from_m: np.ndarray, to_m: np.ndarray, step_m: float) -> np.ndarray:
    """(N, 2) points along all the lines, both ends included, no further apart than step_m."""
    steps = np.ceil(np.hypot(*(to_m - from_m).T) / step_m).astype(int) + 1
    line = np.repeat(np.arange(len(steps)), steps + 1)
    number = np.arange(len(line)) - np.repeat(np.cumsum(steps + 1) - (steps + 1), steps + 1)
    return from_m[line] + (number / steps[line])[:, None] * (to_m - from_m)[line]
