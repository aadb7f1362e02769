# cpp/field; its faces are sensing/distance_field.py, known_area.py and wall_backs.py there, and hypotheses/scan_alignment.py
# and global_search.py. K poses, B beams, H x W cells.
import numpy as np

class DistanceField:
    def __init__(
        self,
        distance_m: np.ndarray,  # (H, W) float32
        resolution_m: float,
        map_from_grid: np.ndarray,  # (3,) float64
        max_distance_m: float,
    ) -> None: ...
    def distance(self, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray: ...  # (...) float64
    def at(self, x_m: np.ndarray, y_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...  # (...) float64

class KnownArea:
    def __init__(
        self,
        flags: np.ndarray,  # (H, W) uint8, with a border
        border: int,
        resolution_m: float,
        map_from_grid: np.ndarray,  # (3,) float64
    ) -> None: ...
    def has(self, flag: np.uint8, points_m: np.ndarray) -> np.ndarray: ...  # (..., 2) float64 -> (...) bool

def slid(
    field: DistanceField,
    points_m: np.ndarray,  # (B, 2) float64
    poses: np.ndarray,  # (K, 3) float64
    held: np.ndarray,  # (3, 3) float64
    damping: float,
    iterations: int,
    first_scale_m: float,
    last_scale_m: float,
) -> np.ndarray: ...  # (K, 3) float64
def information(
    field: DistanceField, points_m: np.ndarray, poses: np.ndarray, scale_m: float
) -> np.ndarray: ...  # (K, 3, 3) float64
def fit(
    field: DistanceField, points_m: np.ndarray, poses: np.ndarray, scale_m: float
) -> np.ndarray: ...  # (K,) float64
def known_fit(
    field: DistanceField,
    area: KnownArea,
    points_m: np.ndarray,
    poses: np.ndarray,
    scale_m: float,
    unknown_fit: float,
) -> np.ndarray: ...  # (K,) float64
def end_at_backs(
    field: DistanceField,
    area: KnownArea,
    points_m: np.ndarray,
    bearings_rad: np.ndarray,  # (B,) float64
    map_from_base: np.ndarray,  # (3,) float64
    before_m: float,
    thickest_m: float,
    side_m: float,
) -> np.ndarray: ...  # (B,) bool
def log_weights(
    field: DistanceField, points_m: np.ndarray, poses: np.ndarray, sigma_m: float, z_hit: float, z_rand: float
) -> np.ndarray: ...  # (K,) float64
