# cpp/grid; its faces are sensing/raycast.py and hypotheses/scan_matcher.py. P poses, B beams, H x W cells.
from typing import TypedDict

import numpy as np

class _Surfaces(TypedDict):
    first_m: np.ndarray  # (P, B) float64, as all but the cells
    first_cell: np.ndarray  # (P, B) int32, as all cells
    first_thickness_m: np.ndarray
    second_m: np.ndarray
    second_cell: np.ndarray
    second_thickness_m: np.ndarray
    third_m: np.ndarray
    third_cell: np.ndarray
    normal_rad: np.ndarray
    linearity: np.ndarray
    mirrored_m: np.ndarray
    mirrored_cell: np.ndarray

class FreeRanges: ...  # made by _mrpt_rays

class Grid:
    def __init__(
        self,
        occupancy: np.ndarray,  # (H, W) int8
        resolution_m: float,
        occupied_percent: int,
        unknown_stops: bool,
        guide: FreeRanges | None,
    ) -> None: ...
    def cast(
        self,
        poses: np.ndarray,  # (P, 3) float64
        angles: np.ndarray,  # (B,) float64
        max_range_m: float,
        threads: int,
    ) -> np.ndarray: ...  # (P, B) float64
    def cast_first(
        self, poses: np.ndarray, angles: np.ndarray, max_range_m: float, threads: int
    ) -> tuple[np.ndarray, np.ndarray]: ...  # (P, B) float64 ranges, int32 cells
    def cast_surfaces(
        self,
        poses: np.ndarray,
        angles: np.ndarray,
        max_range_m: float,
        max_thickness_m: float,
        min_linearity: float,
        min_gap_m: float,
        threads: int,
    ) -> _Surfaces: ...
    def cast_paths(
        self,
        poses: np.ndarray,
        angles: np.ndarray,
        reach_m: np.ndarray,  # (B,) float64
        max_thickness_m: float,
        min_linearity: float,
        min_gap_m: float,
        threads: int,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...  # (4, P, B) float64 ranges, float64 cosines, int32 cells
    def expected_ranges(
        self,
        occupancy: np.ndarray,  # (H, W) int8
        thickness_m: np.ndarray,  # (H * W,) float32
        poses: np.ndarray,  # (N, 3) float64
        angles: np.ndarray,
        measured_m: np.ndarray,  # (B,) float64
        reach_m: np.ndarray,  # (B,) float64
        gate_m: float,
        depth_share: float,
        max_range_m: float,
        max_thickness_m: float,
        min_linearity: float,
        min_gap_m: float,
        mirrored_by_line: bool,
        grid_yaw: float,
        threads: int,
    ) -> tuple[
        np.ndarray,  # (4, N, B) float64 ranges
        np.ndarray,  # (4, N, B) float64 cosines
        np.ndarray,  # (4, N, B) float32 thicknesses
        np.ndarray,  # (4, N, B) int32 cells
        np.ndarray,  # (1, B) float64 incidences of the first sample
        np.ndarray,  # (4, B) float64 ranges by lines
        np.ndarray,  # (4, B) float64 axes
        np.ndarray,  # (4, B) bool, seen side
    ]: ...
    def free_ranges(
        self, rays: FreeRanges, poses: np.ndarray, angles: np.ndarray, max_range_m: float
    ) -> np.ndarray: ...  # (P, B) float64
    def walls_at(self, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...  # float32, like (...) int32
    def redraw(
        self, occupancy: np.ndarray, first_row: int, first_column: int, rows: int, columns: int
    ) -> None: ...  # occupancy: (H, W) int8, as before but for a box

class MatchGrid:
    def __init__(
        self,
        scores: np.ndarray,  # (H, W) uint8
        allowed: np.ndarray,  # (H, W) uint8 or bool
    ) -> None: ...

class ScanSearch:
    def __init__(
        self,
        grid: MatchGrid,
        points: np.ndarray,  # (B, 2) float64
        headings_rad: np.ndarray,  # (A,) float64
        keep: int,
        max_behind: float,
    ) -> None: ...
    look_ups: int
    def advance(self, look_ups: int) -> bool: ...
    def places(
        self,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]: ...  # row, column, heading int32, score float32
