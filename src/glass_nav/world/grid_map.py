"""The map of one floor: an occupancy grid and its pose in the frame `map`.

Rows and columns as in nav_msgs/OccupancyGrid: occupancy[row, column], row 0 at the grid's own y = 0.
H rows, W columns. The grid may be rotated in the map (a map_server origin with yaw).
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from glass_nav.geometry import se2

UNKNOWN = -1
OCCUPIED_PERCENT = 65  # map_server's default thresholds, for grids that carry probabilities
FREE_PERCENT = 25


@dataclass(frozen=True)
class GridMap:
    """Cells of one floor. Glass is occupied, like any wall."""

    occupancy: np.ndarray  # (H, W) int8: 0 free ... 100 occupied [percent], -1 unknown
    resolution_m: float  # edge length of a cell
    map_from_grid: np.ndarray  # (3,) pose of the outer corner of cell [0, 0] in the frame map

    def __post_init__(self) -> None:
        shape = np.shape(self.occupancy)
        if len(shape) != 2 or 0 in shape:
            raise ValueError(f"a map needs occupancy (H, W) with at least one cell, got shape {shape}")
        if self.occupancy.dtype != np.int8:
            raise ValueError(f"a map needs occupancy of int8, got {self.occupancy.dtype}")
        if not (np.isfinite(self.resolution_m) and self.resolution_m > 0.0):
            raise ValueError(f"a map needs resolution > 0 m, got {self.resolution_m}")
        if np.shape(self.map_from_grid) != (3,) or not np.all(np.isfinite(self.map_from_grid)):
            raise ValueError(f"a map needs an origin of x, y, yaw, all finite, got {self.map_from_grid}")

    @property
    def place(self) -> str:
        """Geometry of the grid: rows, columns, resolution, x, y, yaw.

        The resolution counts to a micrometre (messages carry it as float32), the origin to a millimetre.
        """
        return f"{self.occupancy.shape[0]} {self.occupancy.shape[1]} {self.resolution_m:.6f} " + " ".join(
            f"{round(float(value), 3) + 0.0:.3f}" for value in self.map_from_grid
        )

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of cells and place, in hex: equal for the same map from a file and from a message."""
        digest = hashlib.sha256(self.place.encode())
        digest.update(np.ascontiguousarray(self.occupancy).tobytes())
        return digest.hexdigest()

    @property
    def digest(self) -> str:
        """The first 16 digits of the fingerprint, for people and small files."""
        return self.fingerprint[:16]

    @property
    def occupied(self) -> np.ndarray:
        """(H, W) bool: a beam ends here."""
        return self.occupancy >= OCCUPIED_PERCENT

    @property
    def free(self) -> np.ndarray:
        """(H, W) bool: a robot may stand here."""
        return (self.occupancy >= 0) & (self.occupancy <= FREE_PERCENT)

    @cached_property
    def occupied_count(self) -> int:
        """How many cells are occupied."""
        return int(np.count_nonzero(self.occupied))

    @cached_property
    def free_count(self) -> int:
        """How many cells are free."""
        return int(np.count_nonzero(self.free))

    def centres(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Cell centres (..., 2) [m] in the frame map."""
        grid = np.stack([np.asarray(columns) + 0.5, np.asarray(rows) + 0.5], axis=-1) * self.resolution_m
        return se2.transform_points(self.map_from_grid, grid)

    def cells(self, points_m: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
        """Row and column (...) of points (..., 2) [m] in the frame map; may lie outside the grid."""
        grid = se2.transform_points(se2.inverse(self.map_from_grid), points_m) / self.resolution_m
        column_row = np.floor(grid).astype(np.int64)
        return column_row[..., 1], column_row[..., 0]

    def contains(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """(...) bool: the cell exists."""
        return (rows >= 0) & (rows < self.occupancy.shape[0]) & (columns >= 0) & (columns < self.occupancy.shape[1])

    def is_free(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: points (..., 2) [m] of the frame map lie in a free cell."""
        rows, columns = self.cells(points_m)
        inside = self.contains(rows, columns)
        return inside & self.free[np.where(inside, rows, 0), np.where(inside, columns, 0)]
