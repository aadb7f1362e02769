"""Finds all poses of the map from which a scan may have been taken, without an initial pose.

Correlative scan matching (Olson (2009)) of the beams' end points against a likelihood field, over every position and
heading, by branch and bound (Hess, Kohler, Rapp, Andor (2016)): the Python interface of MatchGrid and ScanSearch in
the compiled module _grid. It ignores what the beams passed and which wall they met, so it proposes poses and does not
judge them. On a large map that takes longer than a robot may wait for its pose, so a search can be done in slices. A
slice is a number of look-ups, not a time, so that a replay gives the same result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav import _grid
from glass_nav.geometry import angles, se2
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.world.grid_map import GridMap

_CELL_M = 0.1  # of the positions that are tried
_SCALE_M = 0.15  # a point that ends this far from a wall scores by one half
_HEADINGS_RAD = np.arange(180) * (2.0 * np.pi / 180)  # 2 degrees apart
_HIGHEST = 255
_STRIP_ROWS = 64
_ALL = 2**62  # look-ups: more than any search needs


@dataclass(frozen=True)
class Places:
    """K places, the best first; neighbouring ones may belong to one and the same."""

    poses: np.ndarray  # (K, 3) in map
    score: np.ndarray  # (K,) mean over the points of how near to a wall they lie, 0..1


class ScanMatcher:
    """Matches scans against every pose in the free cells of one map."""

    def __init__(self, grid_map: GridMap, field: DistanceField, area: Optional[np.ndarray] = None) -> None:
        """
        Args:
            grid_map: the robot is in one of its free cells.
            field: of that map.
            area: (H, W) bool: in one of these cells, None: anywhere.

        Raises:
            ValueError: there is no free cell to be in.
        """
        free = grid_map.free if area is None else grid_map.free & area
        if not free.any():
            raise ValueError("the map has no free cell to be in" if area is None else "no free cell lies in the area")
        self._per_cell = max(1, int(round(_CELL_M / grid_map.resolution_m)))
        self._cell_m = self._per_cell * grid_map.resolution_m
        self._map_from_grid = grid_map.map_from_grid
        allowed = _any_in_blocks(free, self._per_cell)
        self.cell_count = allowed.size  # of the positions that are tried, and of those that are not free
        strips = range(0, allowed.shape[0], _STRIP_ROWS)  # those of a large map would not fit in the cache at once
        scores = np.concatenate(
            [
                self._scores(field, first, min(first + _STRIP_ROWS, allowed.shape[0]), allowed.shape[1])
                for first in strips
            ]
        )
        self._grid = _grid.MatchGrid(scores, allowed)

    def _scores(self, field: DistanceField, first: int, last: int, columns: int) -> np.ndarray:
        """(last - first, W) uint8: how near to a wall the centres of the cells of some rows lie."""
        centres = np.stack(np.meshgrid(np.arange(columns) + 0.5, np.arange(first, last) + 0.5), axis=-1) * self._cell_m
        points = se2.transform_points(self._map_from_grid, centres)
        distance = field.distance(points[..., 0], points[..., 1])
        return np.rint(_HIGHEST * _SCALE_M**2 / (_SCALE_M**2 + distance**2)).astype(np.uint8)

    def search(self, points_m: np.ndarray, keep: int, max_behind: float = 1.0) -> Places:
        """Find at most this number of places, one for each square of 0.8 m and each of the headings.

        Args:
            points_m: (B, 2) finite end points of beams in the robot's frame.
            keep: >= 1.
            max_behind: of scores behind the best; less saves time.
        """
        search = self.begin(points_m, keep, max_behind)
        search.advance(_ALL)
        return search.places

    def begin(self, points_m: np.ndarray, keep: int, max_behind: float = 1.0) -> SlicedSearch:
        """A search as of search() that is done in slices."""
        search = _grid.ScanSearch(self._grid, points_m / self._cell_m, _HEADINGS_RAD, keep, min(max_behind, 1.0))
        return SlicedSearch(search, self._map_from_grid, self._cell_m)


class SlicedSearch:
    """A search of one scan, done slice by slice."""

    def __init__(self, search: _grid.ScanSearch, map_from_grid: np.ndarray, cell_m: float) -> None:
        """Made by ScanMatcher.begin()."""
        self._search, self._map_from_grid, self._cell_m = search, map_from_grid, cell_m

    def advance(self, look_ups: int) -> bool:
        """Go on until about so many cells of the map were looked up; whether the search is complete."""
        return bool(self._search.advance(look_ups))

    @property
    def look_ups(self) -> int:
        """Number of look-ups so far."""
        return int(self._search.look_ups)

    @property
    def places(self) -> Places:
        """The places found, once the search is complete."""
        row, column, heading, score = self._search.places()
        grid_from_base = np.stack(
            [(column + 0.5) * self._cell_m, (row + 0.5) * self._cell_m, _HEADINGS_RAD[heading]], -1
        )
        poses = se2.compose(self._map_from_grid, grid_from_base)
        poses[:, 2] = angles.wrap(poses[:, 2])
        return Places(poses, score.astype(float) / _HIGHEST)


def _any_in_blocks(cells: np.ndarray, size: int) -> np.ndarray:
    """(ceil(H / size), ceil(W / size)) bool: some cell of the square is set."""
    height, width = (-(-length // size) * size for length in cells.shape)
    padded = np.zeros((height, width), bool)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    return padded.reshape(height // size, size, width // size, size).any(axis=(1, 3))
