# cpp/vote; its face is localization/beam_classification/case_votes.py. N samples, B beams.
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
    mirrored_cos: np.ndarray,  # (B,) float64
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
