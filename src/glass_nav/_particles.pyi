# cpp/particles; its face is localization/particle_filter/pose_estimate.py. P particles.
import numpy as np

def clusters(
    poses: np.ndarray,  # (P, 3) float64
    bin: np.ndarray,  # (3,) float64
    yaw_bins: int,
) -> np.ndarray: ...  # (P,) int32
