# cpp/io; its faces are recording/rawlog_file.py and world/map_file.py. S scans, O odometry readings, H x W cells.
from typing import TypedDict

import numpy as np

class Rawlog(TypedDict):  # what read_rawlog() returns; a plain dict at run time
    stamps_ns: np.ndarray  # (S,) int64; -1: no time
    beams: np.ndarray  # (S,) int64
    ranges_m: np.ndarray  # float32 of all scans, one after the other
    valid: np.ndarray  # uint8, likewise
    first_angle_rad: np.ndarray  # (S,) float64
    angle_step_rad: np.ndarray  # (S,) float64
    range_max_m: np.ndarray  # (S,) float64
    sensor_pose: np.ndarray  # (S, 6) float64
    labels: list[str]  # S
    odometry_index: np.ndarray  # (S,) int64; -1: none yet
    odometry_stamps_ns: np.ndarray  # (O,) int64; -1: no time
    odometry: np.ndarray  # (O, 3) float64
    objects: dict[str, int]
    paired: bool
    broken: str

class GridFile(TypedDict):  # what read_grid_map() returns
    occupancy: np.ndarray  # (H, W) int8
    resolution_m: float
    x_min_m: float
    y_min_m: float

def read_rawlog(path: str) -> Rawlog: ...
def read_grid_map(path: str) -> GridFile: ...
