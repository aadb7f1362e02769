# cpp/mrpt; its face is sensing/raycast.py. H x W cells.
import numpy as np

from glass_nav._grid import FreeRanges

class SimulatedRays(FreeRanges):
    def __init__(self, occupancy: np.ndarray, resolution_m: float, occupied_percent: int) -> None: ...  # (H, W) int8
