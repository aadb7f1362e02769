# cpp/vote; its faces are in localization/beam_classification. N samples, B beams, W wall cells.
from typing import Sequence

import numpy as np

def case_votes(
    measured_m: np.ndarray,  # (B,) float64
    range_m: np.ndarray,  # (4, N, B) float64
    cos: np.ndarray,  # (4, N, B) float64
    thickness_m: np.ndarray,  # (4, N, B) float32
    prior: np.ndarray,  # (5, B) float64
    nothing: float,
    depth_share: float,
    sigma_m: float,
    gate_m: float,
    min_cos: float,
    temper: float,
) -> np.ndarray: ...  # (5, B) float64
def soft_votes(
    measured_m: np.ndarray,  # (B,) float64
    range_m: np.ndarray,  # (4, N, B) float64
    cos: np.ndarray,  # (4, N, B) float64
    thickness_m: np.ndarray,  # (4, N, B) float32
    axis_rad: np.ndarray,  # (4, B) float64
    seen_side: np.ndarray,  # (4, B) bool
    reflectance: np.ndarray,  # (B,) float64
    returns: np.ndarray,  # (B,) float64
    unmapped_end: np.ndarray,  # (B,) bool
    glass: np.ndarray,  # (2, 2, B) float64
    target_returns: np.ndarray,  # (B,) float64
    gains: np.ndarray,  # (C,) float64
    frequencies: np.ndarray,  # (C,) float64
    porous_returns: float,
    uncertain: float,
    uncertain_behind: float,
    max_range_m: float,
    depth_share: float,
    sigma_m: float,
    gate_m: float,
    min_cos: float,
    temper: float,
    pull: float,
) -> np.ndarray: ...  # (5, B) float64

_Cases = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # (B,) uint8 cases; float64 ranges, residuals, weights

def decided(
    share: np.ndarray,  # (5, B) float64
    measured_m: np.ndarray,
    range_m: np.ndarray,
    cos: np.ndarray,
    thickness_m: np.ndarray,
    min_share: float,
    gate_m: float,
    depth_share: float,
    min_cos: float,
) -> _Cases: ...
def seen_from(
    case: np.ndarray,  # (B,) uint8
    expected_m: np.ndarray,  # (B,) float64
    weight: np.ndarray,  # (B,) float64
    measured_m: np.ndarray,
    range_m: np.ndarray,
    cos: np.ndarray,
    thickness_m: np.ndarray,
    gate_m: float,
    depth_share: float,
    min_cos: float,
) -> _Cases: ...
def pane_echoes(
    measured_m: np.ndarray,  # (B,) float64
    range_m: np.ndarray,  # (4, B) float64
    cos: np.ndarray,  # (4, B) float64
    turned_rad: np.ndarray,  # (B,) float64
    reflectance: np.ndarray,  # (B,) float64
    seen_side: np.ndarray,  # (4, B) bool
    unmapped_end: np.ndarray,  # (B,) bool
    gains: np.ndarray,  # (C,) float64
    frequencies: np.ndarray,  # (C,) float64
    sigma_m: float,
    max_range_m: float,
    min_cos: float,
) -> tuple[np.ndarray, np.ndarray]: ...  # (B,) float64 each
def reflectance(incidence_rad: np.ndarray, index: float) -> np.ndarray: ...  # (...) float64 -> (...) float64

class WallCells:
    def __init__(self, wall: np.ndarray, rows: int, columns: int) -> None: ...  # (W,) int64, with a border of 2 cells
    def chances(  # (2, ...) float64
        self,
        log_odds: np.ndarray,  # (2, W) float32
        through: float,
        there: float,
        cell: np.ndarray,  # (...) int, without the border
    ) -> np.ndarray: ...
    def gone(  # (B,) bool
        self,
        log_odds: np.ndarray,  # (W,) float32
        cell: np.ndarray,  # (B,) int
        axis_rad: np.ndarray,  # (B,) float64
        opaque: np.ndarray,  # (B,) bool
        grid_yaw_rad: float,
        prior: float,
        limit: float,
        opaque_prior: float,
        opaque_limit: float,
        spread: float,
        reach: int,
    ) -> np.ndarray: ...
    def learn(
        self,
        log_odds: np.ndarray,  # (2, W) float32, changed
        crossed: np.ndarray,  # (W,) bool, changed
        cell: np.ndarray,  # (B,) int
        evidence: np.ndarray,  # (2, B) float64
        spread: Sequence[float],
        scan_share: Sequence[float],
        limit: float,
    ) -> None: ...

def evidence(
    measured_m: np.ndarray,  # (B,) float64
    case: np.ndarray,  # (B,) uint8
    first_m: np.ndarray,  # (B,) float64
    seen_through: np.ndarray,  # (B,) float64
    known_end: np.ndarray,  # (B,) bool
) -> tuple[float, float, float, float]: ...  # answered, explained, short, passed
def cut(
    measured_m: np.ndarray,  # (B,) float64
    case: np.ndarray,  # (B,) uint8
    range_m: np.ndarray,  # (B,) float64
    cos: np.ndarray,  # (B,) float64
    axis_rad: np.ndarray,  # (B,) float64
    glass: np.ndarray,  # (2, B) float64
    gate_m: np.ndarray,  # (B,) float64
    max_range_m: float,
    sure: float,
    no_return_glass: float,
    no_return_wall: float,
    dark_to_dim: float,
    same_wall_m: float,
    same_wall_rad: float,
) -> tuple[np.ndarray, np.ndarray]: ...  # ranges (B,) float64, cut (B,) bool
