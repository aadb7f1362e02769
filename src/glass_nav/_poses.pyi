# cpp/poses; its face is geometry/se2.py.
import numpy as np

def compose(a_from_b: np.ndarray, b_from_c: np.ndarray) -> np.ndarray: ...  # (..., 3) float64
def inverse(a_from_b: np.ndarray) -> np.ndarray: ...  # (..., 3) float64
def transform_points(a_from_b: np.ndarray, points_b: np.ndarray) -> np.ndarray: ...  # (..., 2) float64
