# cpp/integrity; its faces are in localization/integrity: fit_information.py, pose_covariance.py, dead_reckoning.py and
# integrity_monitor.py. B beams.
import numpy as np

from glass_nav._distance_field import DistanceField

class ScanFit:
    def __init__(self, resolution_m: float, square: bool) -> None: ...
    def of(
        self,
        field: DistanceField,
        points_m: np.ndarray,  # (B, 2) float64
        laser_m: np.ndarray,  # (2,) float64
        map_from_base: np.ndarray,  # (3,) float64
        beam_share: float,
        worth: float,
    ) -> tuple[np.ndarray, np.ndarray, float]: ...  # (3, 3), (3,) float64

def share_of_second(first: np.ndarray, second: np.ndarray) -> np.ndarray: ...  # (3, 3) float64
def better_of(first: np.ndarray, second: np.ndarray) -> np.ndarray: ...  # (3, 3) float64
def widened_by(covariance: np.ndarray, spread: np.ndarray) -> np.ndarray: ...  # (3, 3) float64
def carried(
    yaw_rad: float,
    covariance: np.ndarray,  # (3, 3) float64
    step: np.ndarray,  # (3,) float64
    noise: np.ndarray,  # (3, 3) float64
    noise_scale: np.ndarray,  # (3,) float64
) -> np.ndarray: ...  # (3, 3) float64
def mahalanobis(offset: np.ndarray, covariance: np.ndarray) -> float: ...
