"""Ray casts on a GridMap: the Python interface of the compiled modules _grid and _mrpt_rays.

P poses, B beams, H rows and W columns of the map. Poses are in the frame map, beam angles in the frame of their
pose; a cell is named by its flat index row * W + column. Ranges are exact: the length of the ray from its origin
to the boundary of the cell it meets.

What a ray meets: every occupied cell that it enters or, where it goes exactly through a corner between cells, that
touches the corner; so a wall of cells that only touch at their corners lets nothing through. A ray along a
grid line belongs to the cells above or to the right of it, as GridMap.cells() has it. A ray that starts in an occupied
cell meets it at 0; one that starts outside the map meets what it enters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav import _grid
from glass_nav.geometry import angles, se2
from glass_nav.world.grid_map import OCCUPIED_PERCENT, GridMap

BACKENDS = ("exact", "mrpt")
UNKNOWN_CELLS = ("pass", "stop")


@dataclass(frozen=True)
class FirstHits:
    """The first surface along each ray."""

    range_m: np.ndarray  # (P, B) inf: nothing within max_range
    cell: np.ndarray  # (P, B) int32 flat index of the occupied cell met, -1: nothing


@dataclass(frozen=True)
class SurfaceHits:
    """Up to three surfaces along each ray, what was passed between them, and the mirrored path. All (P, B)."""

    first_m: np.ndarray  # range to the surface, inf: none
    second_m: np.ndarray
    third_m: np.ndarray
    first_cell: np.ndarray  # int32 flat index of the cell met, -1: none
    second_cell: np.ndarray
    third_cell: np.ndarray
    first_thickness_m: np.ndarray  # along the normal, along the ray where the wall has no normal; inf: not passed
    second_thickness_m: np.ndarray
    normal_rad: np.ndarray  # of the first surface in map, towards the ray's origin; NaN: none
    linearity: np.ndarray  # of the first surface: 1 straight wall ... 0 no direction
    mirrored_m: np.ndarray  # origin -> first surface -> next surface by reflection; inf: none
    mirrored_cell: np.ndarray  # int32 flat index of the cell where that ends, -1: none


@dataclass(frozen=True)
class Paths:
    """The four paths along each ray, (4, P, B): to the first surface, mirrored there, to the second and the third."""

    range_m: np.ndarray  # whole length, inf: none
    cos_incidence: np.ndarray  # |u . n| where it ends, 1 where nothing or no normal is
    cell: np.ndarray  # int32 flat index of the cell met, -1: none


@dataclass(frozen=True)
class ExpectedPaths:
    """The four paths along each ray as in Paths, of N poses; of the first pose in more detail."""

    range_m: np.ndarray  # (4, N, B) whole length, inf: none
    cos_incidence: np.ndarray  # (4, N, B) |u . n| where it ends, 1 where nothing or no normal is
    thickness_m: np.ndarray  # (4, N, B) float32 of the wall that is met
    cell: np.ndarray  # (4, N, B) int32 flat index of the cell met, -1: none
    pane_incidence: np.ndarray  # (1, B) angle to the normal of the first pose's first surface [rad], NaN without one
    line_m: np.ndarray  # (4, B) range of the first pose by the lines of the walls, half a cell behind the near faces
    axis_rad: np.ndarray  # (4, B) axes of their normals in map, up to half a turn; NaN: none. Of mirrored ones: image's
    seen_side: np.ndarray  # (4, B) bool: the surfaces are met from a side that is not unknown


class RayCaster:
    """Casts rays on one map. Safe to share between threads."""

    def __init__(self, grid_map: GridMap, backend: str = "exact", threads: int = 1, unknown: str = "pass") -> None:
        """
        Args:
            grid_map: cells of at least OCCUPIED_PERCENT end a ray.
            backend: "exact" leaps by the chessboard distance; "mrpt" is MRPT's simulateScanRay with its known faults
                corrected, slower, for comparison.
            threads: of each cast; the poses are dealt out to them. The results do not depend on it.
            unknown: "pass", unknown cells are like free ones; "stop", a ray that comes to one meets nothing (inf).

        Raises:
            ValueError: unknown backend, threads < 1, another word for unknown.
        """
        if backend not in BACKENDS:
            raise ValueError(f"ray caster: backend must be one of {', '.join(BACKENDS)}, got {backend!r}")
        if unknown not in UNKNOWN_CELLS:
            raise ValueError(f"ray caster: unknown must be one of {', '.join(UNKNOWN_CELLS)}, got {unknown!r}")
        if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or threads < 1:
            raise ValueError(f"ray caster: threads must be a whole number >= 1, got {threads!r}")
        self._grid_map = grid_map
        self._threads = int(threads)
        self._grid_from_map = se2.inverse(grid_map.map_from_grid)
        self._guide = _mrpt_rays(grid_map) if backend == "mrpt" else None
        self._grid = _grid.Grid(
            grid_map.occupancy, grid_map.resolution_m, OCCUPIED_PERCENT, unknown == "stop", self._guide
        )

    @property
    def grid_map(self) -> GridMap:
        return self._grid_map

    def redraw(self, grid_map: GridMap) -> None:
        """Go on with the same map after some of its cells changed. Not while another thread casts.

        Takes as long as the box around the changed cells is large, not the map.

        Raises:
            ValueError: the map has other cells: shape, resolution or place.
        """
        rows, columns = changed_box(self._grid_map, grid_map)
        self._grid_map = grid_map
        if rows.start == rows.stop:
            return
        self._grid.redraw(
            grid_map.occupancy, rows.start, columns.start, rows.stop - rows.start, columns.stop - columns.start
        )

    def cast(self, poses: np.ndarray, angles_rad: np.ndarray, max_range_m: float) -> np.ndarray:
        """Ranges to the first surface.

        Args:
            poses: (P, 3) x [m], y [m], yaw [rad] in map.
            angles_rad: (B,) directions in the frame of the pose.
            max_range_m: how far to look, > 0 and finite.

        Returns:
            (P, B) ranges [m]; inf: nothing within max_range_m.

        Raises:
            ValueError: wrong shapes, poses or angles that are not finite, max_range_m not > 0.
        """
        poses, angles_rad = self._checked(poses, angles_rad, max_range_m)
        return self._grid.cast(poses, angles_rad, max_range_m, self._threads)

    def cast_first(self, poses: np.ndarray, angles_rad: np.ndarray, max_range_m: float) -> FirstHits:
        """Like cast(), but also returns the cells that the rays met."""
        poses, angles_rad = self._checked(poses, angles_rad, max_range_m)
        return FirstHits(*self._grid.cast_first(poses, angles_rad, max_range_m, self._threads))

    def cast_surfaces(
        self,
        poses: np.ndarray,
        angles_rad: np.ndarray,
        max_range_m: float,
        max_thickness_m: float = 0.3,
        min_linearity: float = 0.9,
        min_gap_m: float = 0.1,
    ) -> SurfaceHits:
        """The first three surfaces along each ray and the path mirrored at the first.

        The thickness of a surface is the length of the ray in it times |cos incidence|. max_range_m bounds all paths,
        the mirrored one in its whole length. The mirrored ray does not meet the cells of the mirror itself: those
        within 8 cells of the hit and 1.5 cells of the line of the wall.

        Args:
            poses, angles_rad, max_range_m: as for cast().
            max_thickness_m: a surface thicker than this ends the ray; >= 0, inf: none does.
            min_linearity: a cell less straight than this counts as one without normal: nothing is mirrored, and
                its thickness is taken along the ray; 0 to 1.
            min_gap_m: occupied cells on a ray that are less than this apart are one surface (the staircase of a
                slanted wall); >= 0.

        Raises:
            ValueError: as cast(), or a limit outside its bounds.
        """
        _check_limits(max_thickness_m, min_linearity, min_gap_m)
        poses, angles_rad = self._checked(poses, angles_rad, max_range_m)
        found = self._grid.cast_surfaces(
            poses, angles_rad, max_range_m, max_thickness_m, min_linearity, min_gap_m, self._threads
        )
        found["normal_rad"] = self._in_map(found["normal_rad"])
        return SurfaceHits(**found)

    def cast_paths(
        self,
        poses: np.ndarray,
        angles_rad: np.ndarray,
        reach_m: np.ndarray,
        max_thickness_m: float = 0.3,
        min_linearity: float = 0.9,
        min_gap_m: float = 0.1,
    ) -> Paths:
        """Ends of the paths of cast_surfaces(), each beam followed only as far as it matters.

        Args:
            poses, angles_rad, max_thickness_m, min_linearity, min_gap_m: as for cast_surfaces().
            reach_m: (B,) how far to look along each beam, > 0 and finite.

        Raises:
            ValueError: as cast_surfaces().
        """
        _check_limits(max_thickness_m, min_linearity, min_gap_m)
        reach_m = _checked_reach(reach_m, angles_rad)
        poses, angles_rad = self._checked(poses, angles_rad, 1.0)
        return Paths(
            *self._grid.cast_paths(poses, angles_rad, reach_m, max_thickness_m, min_linearity, min_gap_m, self._threads)
        )

    def expected_paths(
        self,
        thickness_m: np.ndarray,
        poses: np.ndarray,
        angles_rad: np.ndarray,
        max_range_m: float,
        measured_m: np.ndarray,
        reach_m: np.ndarray,
        gate_m: float = np.inf,
        depth_share: float = 1.0,
        max_thickness_m: float = 0.3,
        min_linearity: float = 0.9,
        min_gap_m: float = 0.1,
        mirrored_by_line: bool = True,
    ) -> ExpectedPaths:
        """The ranges that beams may measure from poses near the first of them.

        Ranges are as of cast_paths(), but from all poses except the first every other beam passes surfaces without a
        normal. With a gate, paths that cannot have ended a beam are left out: besides the first surface only those are
        cast that may have ended it by what the first pose sees along the beam and those beside it.

        Args:
            thickness_m: (H * W,) float32 of the map's walls.
            poses: (N, 3) in map, N > 0.
            angles_rad, max_thickness_m, min_linearity, min_gap_m: as for cast_paths().
            max_range_m: how far to look from the first pose.
            measured_m: (B,) ranges by REP 117; for the gate.
            reach_m: (B,) how far to look along each beam from the others.
            gate_m: across a surface; one that is farther from the end of a beam did not end it. inf: any may have.
            depth_share: of the drawn thickness of a wall: how deep in it beams end, 0 to 1; for the gate.
            mirrored_by_line: mirrored ranges are those by the lines of both walls; else all are by their cells.

        Raises:
            ValueError: as cast_paths(); no pose.
        """
        _check_limits(max_thickness_m, min_linearity, min_gap_m)
        reach_m = _checked_reach(reach_m, angles_rad)
        poses, angles_rad = self._checked(poses, angles_rad, max_range_m)
        found = self._grid.expected_ranges(
            self._grid_map.occupancy,
            thickness_m,
            poses,
            angles_rad,
            measured_m,
            reach_m,
            gate_m,
            depth_share,
            max_range_m,
            max_thickness_m,
            min_linearity,
            min_gap_m,
            mirrored_by_line,
            float(self._grid_map.map_from_grid[2]),
            self._threads,
        )
        return ExpectedPaths(*found)

    def simulate_scan_ray_raw(self, poses: np.ndarray, angles_rad: np.ndarray, max_range_m: float) -> np.ndarray:
        """As cast(), by MRPT's unmodified simulateScanRay with its faults: for comparison only."""
        poses, angles_rad = self._checked(poses, angles_rad, max_range_m)
        return self._grid.free_ranges(self._guide or _mrpt_rays(self._grid_map), poses, angles_rad, max_range_m)

    def normals(self) -> Tuple[np.ndarray, np.ndarray]:
        """Normals of all cells that a ray may meet first.

        Returns:
            normal_rad: (H * W,) float32 axis of the normal in map, up to half a turn; NaN: none.
            linearity: (H * W,) float32, 1 straight wall ... 0 no direction, or no normal.
        """
        return self.walls_at(self._cells())[:2]

    def wall_offsets_m(self) -> np.ndarray:
        """(H * W,) float32 from the centre of each cell to the line of its wall, along the normal; NaN: none.

        A slanted wall is a staircase of cells; the line through them is the wall.
        """
        return self.walls_at(self._cells())[2]

    def walls_at(self, cell: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """normals() and wall_offsets_m() at flat cells (...) alone: normal_rad, linearity, offset_m, each (...) float32.

        NaN, 0 and NaN for a cell without a normal, and for -1.

        Raises:
            ValueError: a cell that the map has not.
        """
        normal_rad, linearity, offset_m = self._grid.walls_at(cell)
        return self._in_map(normal_rad), linearity, offset_m

    def _cells(self) -> np.ndarray:
        return np.arange(self._grid_map.occupancy.size, dtype=np.int32)

    def _in_map(self, grid_angle_rad: np.ndarray) -> np.ndarray:
        yaw = self._grid_map.map_from_grid[2]
        if yaw == 0.0:
            return grid_angle_rad
        return angles.wrap(grid_angle_rad + grid_angle_rad.dtype.type(yaw))

    def _checked(
        self, poses: np.ndarray, angles_rad: np.ndarray, max_range_m: float
    ) -> "Tuple[np.ndarray, np.ndarray]":
        """Poses in the frame of the grid, and the angles; ValueError for invalid ones."""
        poses, angles_rad = np.asarray(poses, float), np.asarray(angles_rad, float)
        if poses.ndim != 2 or poses.shape[1] != 3:
            raise ValueError(f"ray caster: poses must have shape (P, 3), got {poses.shape}")
        if angles_rad.ndim != 1:
            raise ValueError(f"ray caster: angles must have shape (B,), got {angles_rad.shape}")
        if not np.isfinite(poses).all():
            bad = int(np.flatnonzero(~np.isfinite(poses).all(axis=1))[0])
            raise ValueError(f"ray caster: pose {bad} is not finite: {poses[bad]}")
        if not np.isfinite(angles_rad).all():
            bad = int(np.flatnonzero(~np.isfinite(angles_rad))[0])
            raise ValueError(f"ray caster: angle {bad} is not finite: {angles_rad[bad]}")
        if not (np.isfinite(max_range_m) and max_range_m > 0.0):
            raise ValueError(f"ray caster: max_range must be finite and > 0 m, got {max_range_m}")
        return se2.compose(self._grid_from_map, poses), angles_rad


def changed_box(before: GridMap, after: GridMap) -> Tuple[slice, slice]:
    """Rows and columns of the box around all cells that differ between two maps of the same cells; empty: none does.

    Raises:
        ValueError: they have other cells: shape, resolution or place.
    """
    if after.place != before.place:
        raise ValueError(f"ray caster: a redrawn map must have the cells {before.place}, got {after.place}")
    differs = before.occupancy != after.occupancy
    rows, columns = (np.flatnonzero(differs.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return slice(0, 0), slice(0, 0)
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def _checked_reach(reach_m: np.ndarray, angles_rad: np.ndarray) -> np.ndarray:
    reach_m = np.asarray(reach_m, float)
    if reach_m.shape != np.shape(angles_rad):
        raise ValueError(
            f"ray caster: reach must have the shape of the angles {np.shape(angles_rad)}, got {reach_m.shape}"
        )
    if not (np.isfinite(reach_m) & (reach_m > 0.0)).all():
        raise ValueError(f"ray caster: reach must be finite and > 0 m, got {reach_m.min()} to {reach_m.max()}")
    return reach_m


def _mrpt_rays(grid_map: GridMap) -> _grid.FreeRanges:
    """Function that casts rays on the map with MRPT's simulateScanRay."""
    from glass_nav import _mrpt_rays  # 56 MB: MRPT brings OpenCV and more

    return _mrpt_rays.SimulatedRays(grid_map.occupancy, grid_map.resolution_m, OCCUPIED_PERCENT)


def _check_limits(max_thickness_m: float, min_linearity: float, min_gap_m: float) -> None:
    if not max_thickness_m >= 0.0:
        raise ValueError(f"ray caster: max_thickness must be >= 0 m, got {max_thickness_m}")
    if not 0.0 <= min_linearity <= 1.0:
        raise ValueError(f"ray caster: min_linearity must be in [0, 1], got {min_linearity}")
    if not 0.0 <= min_gap_m < np.inf:
        raise ValueError(f"ray caster: min_gap must be finite and >= 0 m, got {min_gap_m}")
