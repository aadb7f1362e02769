"""The map of a Building, as a lidar mapper drew it before anything changed.

The mapper drove all paths and looked into the rooms that contain the points `seen`. Cells that can be reached from
there without crossing a surface are free; surfaces that border on them are occupied, glass like any wall. The rest is
unknown: the inside of walls and furniture, the far side of walls, unseen rooms, outside.

Lines are drawn in whole micrometres: floating point would put the border of a cell here on one processor and there on
another. H rows, W columns.
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
UM = 1_000_000  # micrometres in a metre


def draw(building: Building, resolution_m: float = RESOLUTION_M, erased: Collection[int] = ()) -> GridMap:
    """The map of a building: mapped things only, removed ones included.

    Args:
        building: if it is open to the outside, the outside within MARGIN_M counts as seen.
        resolution_m: edge length of a cell, > 0.
        erased: indices of panes that the mapper took for free space; the rest of the map is the same.
    """
    if not (np.isfinite(resolution_m) and resolution_m > 0.0):
        raise ValueError(f"a map needs resolution > 0 m, got {resolution_m}")
    cell_um = int(_micrometres(np.asarray(resolution_m)))
    if not cell_um:
        raise ValueError(f"a map needs resolution >= 1e-6 m, got {resolution_m}")
    from_um, to_um = _mapped_lines(building)
    paths_um = [_micrometres(path) for path in building.paths.values()]
    seeds_um = np.concatenate(
        [
            _micrometres(np.concatenate([building.start[None, :2], building.seen_m])),
            *(_cells(path[:-1], path[1:], cell_um, 1) * cell_um + cell_um // 2 for path in paths_um),
        ]
    )
    ends_um, margin_um = np.concatenate([from_um, to_um, seeds_um]), int(MARGIN_M * UM)
    low = (ends_um.min(axis=0) - margin_um) // cell_um
    columns, rows = -((-ends_um.max(axis=0) - margin_um) // cell_um) - low
    grid = GridMap(np.full((rows, columns), UNKNOWN, np.int8), resolution_m, np.append(low * resolution_m, 0.0))
    surface = _surface(grid, low, from_um, to_um)
    seed_column, seed_row = (seeds_um // cell_um - low).T
    regions, _ = ndimage.label(~surface)  # connected by edges
    reached = np.unique(regions[seed_row, seed_column])
    free = np.isin(regions, reached[reached > 0])
    grid.occupancy[free] = 0
    grid.occupancy[surface & ndimage.binary_dilation(free, np.ones((3, 3), bool))] = 100
    if erased:
        kept = tuple(pane for index, pane in enumerate(building.panes) if index not in erased)
        grid.occupancy[grid.occupied & ~_surface(grid, low, *_mapped_lines(replace(building, panes=kept)))] = 0
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
    """The drawn map, and (H, W) bool: occupied, or one of the 8 cells around an occupied one."""
    grid = draw(building)
    return grid, ndimage.binary_dilation(grid.occupied, np.ones((3, 3), bool))


def _mapped_lines(building: Building) -> Tuple[np.ndarray, np.ndarray]:
    """Ends (L, 2), (L, 2) [um] of the lines to draw; a glazing is one line."""
    surfaces = building.surfaces
    opaque = surfaces.mapped & (surfaces.kind == OPAQUE)
    lines: List[np.ndarray] = [pane.line_m for pane in building.panes if not pane.film]
    lines += [mirror.line_m for mirror in building.mirrors]
    glass = np.array(lines, float).reshape(-1, 2, 2)
    return (
        _micrometres(np.concatenate([surfaces.from_m[opaque], glass[:, 0]])),
        _micrometres(np.concatenate([surfaces.to_m[opaque], glass[:, 1]])),
    )


def _micrometres(points_m: np.ndarray) -> np.ndarray:
    """(...) rounded to whole micrometres."""
    return np.rint(np.asarray(points_m, float) * UM).astype(np.int64)


def _surface(grid: GridMap, low: np.ndarray, from_um: np.ndarray, to_um: np.ndarray) -> np.ndarray:
    """(H, W) bool: cells that a line crosses, not only at a corner; low (2,) is the column and row of the first cell."""
    rows, columns = grid.occupancy.shape
    column, row = (_cells(from_um, to_um, int(_micrometres(np.asarray(grid.resolution_m))), STEPS_PER_CELL) - low).T
    points = np.bincount(row * columns + column, minlength=rows * columns).reshape(rows, columns)
    return points >= MIN_SHARE * STEPS_PER_CELL


def _cells(from_um: np.ndarray, to_um: np.ndarray, cell_um: int, per_cell: int) -> np.ndarray:
    """(N, 2) column and row, from the frame's origin, of points along lines (L, 2), both ends included, each line in steps
    of at most a cell / per_cell.
    """
    length2 = ((to_um - from_um) ** 2).sum(axis=1)
    length_um = np.sqrt(length2.astype(float)).astype(np.int64)
    length_um -= length_um**2 > length2  # rounded up to whole micrometres, whatever the square root was rounded to
    length_um += length_um**2 < length2
    steps = -(-per_cell * length_um // cell_um) + 1
    line = np.repeat(np.arange(len(steps)), steps + 1)
    number = np.arange(len(line)) - np.repeat(np.cumsum(steps + 1) - (steps + 1), steps + 1)
    count = steps[line][:, None]
    cells: np.ndarray = (from_um[line] * count + number[:, None] * (to_um - from_um)[line]) // (cell_um * count)
    return cells
