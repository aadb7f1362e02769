"""Converts maps, scans and poses to and from those of MRPT's official Python bindings (`mrpt.pymrpt`).

The bindings are packaged for Debian 13 (python3-pymrpt) and Noetic (ros-noetic-python-mrpt); nothing else in this package
needs them. doc/mrpt.md is a tutorial. B beams.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import UNKNOWN, GridMap

_SURE = 0.02  # from 0.5: nearer to it a cell of MRPT says nothing
_EVEN_RAD = 1e-4


def bindings() -> Any:
    """The module with `maps`, `obs` and `poses`.

    Raises:
        ImportError: they are not installed; what to install.
    """
    try:
        from mrpt.pymrpt import mrpt
    except ImportError as err:
        raise ImportError(
            "mrpt.pymrpt is not installed: apt install python3-pymrpt (Debian 13) or ros-noetic-python-mrpt"
        ) from err
    return mrpt


def grid_to_mrpt(grid_map: GridMap) -> Any:
    """A COccupancyGridMap2D with the same cells at the same place.

    Raises:
        ValueError: the map is turned, which MRPT's cannot be.
    """
    x, y, yaw = (float(value) for value in grid_map.map_from_grid)
    if yaw != 0.0:
        raise ValueError(f"a map of MRPT cannot be turned, got an origin with yaw {yaw:g} rad")
    rows, columns = grid_map.occupancy.shape
    cell_m = grid_map.resolution_m
    grid = bindings().maps.COccupancyGridMap2D(x, x + columns * cell_m, y, y + rows * cell_m, cell_m)
    free = np.where(grid_map.occupancy == UNKNOWN, 0.5, 1.0 - grid_map.occupancy / 100.0)
    for (row, column), chance in np.ndenumerate(free):
        grid.setCell(column, row, float(chance))
    return grid


def grid_from_mrpt(grid: Any) -> GridMap:
    """The cells of a COccupancyGridMap2D; those about 0.5 are unknown."""
    free = np.array([[grid.getCell(x, y) for x in range(grid.getSizeX())] for y in range(grid.getSizeY())], float)
    percent = np.where(np.abs(free - 0.5) < _SURE, UNKNOWN, np.round(100.0 * (1.0 - free))).astype(np.int8)
    return GridMap(percent, float(grid.getResolution()), np.array([grid.getXMin(), grid.getYMin(), 0.0]))


def scan_to_mrpt(scan: Scan) -> Any:
    """A CObservation2DRangeScan with the same beams from the same place; MRPT's beams are symmetric about its sensor.

    Raises:
        ValueError: the beams are not evenly spaced.
    """
    count, angles_rad = len(scan), scan.angles_rad
    if count < 2 or np.ptp(np.diff(angles_rad)) > _EVEN_RAD:
        raise ValueError("a scan of MRPT needs two or more evenly spaced beams")
    mrpt = bindings()
    observation = mrpt.obs.CObservation2DRangeScan()
    observation.resizeScan(count)
    observation.aperture = abs(float(angles_rad[-1] - angles_rad[0]))
    observation.rightToLeft = bool(angles_rad[-1] > angles_rad[0])
    observation.maxRange = float(scan.range_max_m)
    x, y, yaw = (float(value) for value in scan.base_from_laser)
    observation.sensorPose = mrpt.poses.CPose3D(x, y, 0.0, yaw + 0.5 * float(angles_rad[0] + angles_rad[-1]), 0.0, 0.0)
    for index, (range_m, answered) in enumerate(zip(scan.ranges_m, scan.answered)):
        observation.setScanRange(index, float(range_m) if answered else 0.0)
        observation.setScanRangeValidity(index, bool(answered))
    return observation


def scan_from_mrpt(observation: Any, stamp_ns: int, range_min_m: float = 0.0) -> Scan:
    """A scan of a level sensor; ranges that are not valid are of beams that met nothing (inf)."""
    count = int(observation.getScanSize())
    half_rad = 0.5 * float(observation.aperture) * (1.0 if observation.rightToLeft else -1.0)
    ranges_m = np.array(
        [
            observation.getScanRange(index) if observation.getScanRangeValidity(index) else np.inf
            for index in range(count)
        ],
        float,
    )
    place = observation.sensorPose
    base_from_laser = np.array([_value(place.x), _value(place.y), _value(place.yaw)], float)
    return Scan(
        stamp_ns,
        ranges_m,
        np.linspace(-half_rad, half_rad, count),
        range_min_m,
        float(observation.maxRange),
        base_from_laser,
    )


def pose_to_mrpt(pose: np.ndarray) -> Any:
    """A CPose2D of (3,) x [m], y [m], yaw [rad]."""
    x, y, yaw = (float(value) for value in pose)
    return bindings().poses.CPose2D(x, y, yaw)


def pose_from_mrpt(pose: Any) -> np.ndarray:
    """(3,) x [m], y [m], yaw [rad] of a CPose2D."""
    return np.array([_value(pose.x), _value(pose.y), _value(pose.phi)], float)


def _value(member: Any) -> float:
    """Value of a coordinate: a method in MRPT 2, a property in later versions."""
    return float(member() if callable(member) else member)
