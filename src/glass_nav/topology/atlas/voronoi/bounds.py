"""The cells that bound the free space of a map: walls, unknown space, and separately small objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import Delaunay, cKDTree

from glass_nav.topology.atlas import components
from glass_nav.world.grid_map import GridMap


@dataclass(frozen=True)
class Bounds:
    """Coordinates are cells, x along columns, y along rows."""

    points: np.ndarray  # (G, 2) centres of cells that bound free space
    doubt: np.ndarray  # (G,) distance of the nearest wall
    posts: np.ndarray  # (K, 2) centres of cells of things that make no meetpoints
    open: np.ndarray  # (H + 2, W + 2) bool: free, or within such a thing; one more cell on each side


def of(grid_map: GridMap, clearance: float, smallest: float) -> Bounds:
    """The bounds of the free space of a map.

    Args:
        grid_map: any grid.
        clearance: radius of the robot, with its margin [cells].
        smallest: free-standing things that measure less are posts [cells].
    """
    free = np.pad(grid_map.free, 1)
    _drop_specks(free, np.pi * clearance**2)
    rows, columns = np.nonzero(_around(free) & ~free)
    points = np.column_stack([columns, rows]) - 0.5  # centre of cell 0 is at 0.5, less the border of 1
    occupied = np.pad(grid_map.occupied, 1)
    doubt = _distance_of_walls(occupied, rows, columns)
    blobs, count = ndimage.label(~free, np.ones((3, 3), bool))
    blob = blobs[rows, columns]
    has_wall = np.zeros(count + 1, bool)
    has_wall[blobs[occupied]] = True
    speck = _is_small(points, blob, smallest) & ~has_wall[blob]
    post = np.zeros(len(points), bool)
    post[~speck] = _posts(points[~speck], blob[~speck], 2.0 * clearance, smallest)
    if (post | speck).any():
        passed = np.zeros(count + 1, bool)
        passed[blob[post | speck]] = True
        free |= passed[blobs]
    bound = ~(post | speck)
    return Bounds(points[bound], doubt[bound], points[post], free)


def _drop_specks(free: np.ndarray, least_cells: float) -> None:
    """Mark free cells as not free, in place, where a piece of them is too small for the robot."""
    label, count = ndimage.label(free)
    large = np.bincount(label.ravel(), minlength=count + 1) >= least_cells
    large[0] = False
    np.take(large, label, out=free)


def _around(cells: np.ndarray) -> np.ndarray:
    """(H, W) bool: the cell or one of its 8 neighbours is set."""
    beside = cells.copy()
    beside[1:] |= cells[:-1]
    beside[:-1] |= cells[1:]
    around = beside.copy()
    around[:, 1:] |= beside[:, :-1]
    around[:, :-1] |= beside[:, 1:]
    return around


def _distance_of_walls(occupied: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """(G,) distance from each cell to the nearest occupied one [cells]; inf if there is none."""
    away = np.where(occupied[rows, columns], 0.0, np.inf)
    walls = np.argwhere(occupied & _around(~occupied))
    if len(walls):
        doubtful = away > 0.0
        away[doubtful], _ = cKDTree(walls).query(np.column_stack([rows[doubtful], columns[doubtful]]))
    return away


def _posts(points: np.ndarray, blob: np.ndarray, gap: float, smallest: float) -> np.ndarray:
    """(G,) bool: belongs to a thing smaller than that along both axes, and further than the gap from all others.

    Points (G, 2) of one blob of cells are one thing, and so are those that the robot cannot pass between.
    """
    post = _is_small(points, blob, smallest)
    small = np.flatnonzero(post)
    if not len(small):
        return post
    if len(small) < len(points):
        away, _ = cKDTree(points[~post]).query(points[small], distance_upper_bound=gap)
        attached = np.isfinite(away)
    else:
        attached = np.zeros(len(small), bool)
    thing = _things(points[small], gap)
    of_large = np.zeros(thing.max() + 1, bool)
    of_large[thing[attached]] = True
    post[small] = _is_small(points[small], thing, smallest) & ~of_large[thing]
    return post


def _is_small(points: np.ndarray, thing: np.ndarray, smallest: float) -> np.ndarray:
    """(G,) bool: all points with this number lie within less than that along both axes, cells and all."""
    if not len(points):
        return np.zeros(0, bool)
    order = np.argsort(thing, kind="stable")
    starts = np.flatnonzero(np.diff(thing[order], prepend=-1))
    size = (np.maximum.reduceat(points[order], starts) - np.minimum.reduceat(points[order], starts) + 1.0).max(axis=1)
    small = np.empty(len(points), bool)
    small[order] = np.repeat(size < smallest, np.diff(starts, append=len(points)))
    return small


def _things(points: np.ndarray, gap: float) -> np.ndarray:
    """(G,) the number of the group of each point: groups are further apart than the gap.

    The Delaunay triangulation holds the shortest tree that spans all points, so its short sides are enough.
    """
    far = 1e3 * (1.0 + np.abs(points).max()) * np.array([[-1, -1], [2, -1], [-1, 2]])  # points in a line have no mesh
    sides = _sides(Delaunay(np.concatenate([points, far])).simplices)
    sides = sides[(sides < len(points)).all(axis=1)]
    short = np.hypot(*(points[sides[:, 0]] - points[sides[:, 1]]).T) <= gap
    return components.connected(len(points), sides[short, 0], sides[short, 1])[1]


def _sides(triangles: np.ndarray) -> np.ndarray:
    """(3T, 2) the sides of triangles (T, 3)."""
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
