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
