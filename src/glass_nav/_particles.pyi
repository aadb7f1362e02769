# cpp/particles; its faces are localization/particle_filter/{pose_estimate,resampling,proposal}.py. P particles, K alignments.
import numpy as np

def moments(
    poses: np.ndarray,  # (P, 3) float64
    weights: np.ndarray,  # (P,) float64
) -> tuple[np.ndarray, np.ndarray]: ...  # (3,), (3, 3) float64
def best_cluster(
    poses: np.ndarray,  # (P, 3) float64
    weights: np.ndarray,  # (P,) float64
    bin: np.ndarray,  # (3,) float64
    yaw_bins: int,
) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]: ...  # (3,), (3, 3) float64; share; (P,) bool
def count_bins(
    poses: np.ndarray,  # (P, 3) float64
    bin: np.ndarray,  # (3,) float64
) -> int: ...
def low_variance(
    weights: np.ndarray,  # (P,) float64
    count: int,
    offset: float,
) -> np.ndarray: ...  # (count,) intp
def proposal_log_ratio(
    poses: np.ndarray,  # (P, 3) float64
    kept: int,
    mean: np.ndarray,  # (3,) float64
    near: np.ndarray,  # (3, 3) float64
    slipped: np.ndarray,  # (3, 3) float64
    aligned: np.ndarray,  # (K, 3) float64
    around: np.ndarray,  # (K, 3, 3) float64
    slip_probability: float,
    scan_share: float,
) -> np.ndarray: ...  # (P,) float64
