#!/usr/bin/env python3
"""Does it help to compensate the robot's motion during a sweep?  Simulated buildings, with and without.

    python test/benchmark/deskew.py
    python test/benchmark/deskew.py --turn-time 0.05 --seeds 2 --speed 1.0

A robot drives the first path of each building; its lidar takes `--turn-time` from the first beam to the last one, and
the scan reports it. The same scans go through the filter deskewed by odometry (which slips as the simulator's wheels
do) and as they are, next to those of a lidar that takes all beams at once. Prints rmse of position and heading at
the stamps of the scans. Exit 1 if deskewing makes the position or the heading worse over all buildings.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Dict, List, Tuple

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np

sys.path.append(str(Path(__file__).resolve().parent))

import drives
from glass_nav.geometry import angles
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.sensing import deskew
from glass_nav.simulation import building_file, building_map, lidar
from glass_nav.simulation.path_follower import PathFollowerParams
from glass_nav.simulation.simulation import Frame, Simulation
from glass_nav.world.grid_map import GridMap

WAYS = ("all at once", "as measured", "deskewed")
START_COVARIANCE = np.diag([0.1, 0.1, 0.05]) ** 2


def drive(name: str, turn_time_s: float, seed: int, speed_m_s: float, max_scans: int) -> Tuple[GridMap, List[Frame]]:
    """Drive the robot once along the first path."""
    building = building_file.load(drives.MAPS / name / "building.yaml")
    simulation = Simulation(building, lidar.preset("sensitive"), seed=seed, scan_rate_hz=10.0, turn_time_s=turn_time_s)
    frames = simulation.drive(next(iter(building.paths)), PathFollowerParams(speed_m_s=speed_m_s))
    return building_map.draw(building), [frame for frame, _ in zip(frames, range(max_scans))]


def errors(grid_map: GridMap, frames: List[Frame], deskews: bool, seed: int) -> np.ndarray:
    """(S, 2) of position [m] and heading [rad]."""
    readings = {each.stamp_ns: each.odom_from_base for frame in frames for each in frame.odometry}
    odometry = Trajectory(np.array(sorted(readings)), np.array([readings[stamp_ns] for stamp_ns in sorted(readings)]))
    localizer = Localizer(LocalizerParams(), grid_map, np.random.default_rng(seed))
    localizer.set_pose(frames[0].map_from_base, START_COVARIANCE)
    off = []
    for frame in frames:
        turns = deskews and frame.scan.time_increment_s > 0.0
        scan = deskew.deskewed(frame.scan, odometry) if turns else frame.scan
        error = localizer.update(scan, frame.odom_from_base).map_from_base - frame.map_from_base
        off.append((np.hypot(error[0], error[1]), angles.wrap(error[2])))
    return np.array(off)


def rmse(off: np.ndarray) -> np.ndarray:
    """(2,) of position [m] and heading [deg]."""
    position_m, heading_rad = np.sqrt(np.mean(off**2, axis=0))
    return np.array([position_m, np.degrees(heading_rad)])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--turn-time", type=float, default=0.08, metavar="S", help="of the lidar (default 0.08)")
    parser.add_argument("--speed", type=float, default=0.9, metavar="M_S", help="of the robot (default 0.9)")
    parser.add_argument("--seeds", type=int, default=2, help="from --first-seed on (default 2)")
    parser.add_argument("--first-seed", type=int, default=240)
    parser.add_argument("--max-scans", type=int, default=400, help="of a drive (default 400)")
    parser.add_argument("--buildings", nargs="+", default=drives.buildings())
    arguments = parser.parse_args()
    print(f"{'rmse, position [m] / heading [deg]':36s}" + "".join(f"{way:>20s}" for way in WAYS))
    found: Dict[str, List[np.ndarray]] = {way: [] for way in WAYS}
    for name in arguments.buildings:
        of_name: Dict[str, List[np.ndarray]] = {way: [] for way in WAYS}
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            pace = (seed, arguments.speed, arguments.max_scans)
            of_name[WAYS[0]].append(errors(*drive(name, 0.0, *pace), deskews=False, seed=seed))
            grid_map, frames = drive(name, arguments.turn_time, *pace)
            for way, deskews in ((WAYS[1], False), (WAYS[2], True)):
                of_name[way].append(errors(grid_map, frames, deskews, seed))
        line = f"{name:36s}"
        for way in WAYS:
            found[way] += of_name[way]
            position_m, heading_deg = rmse(np.concatenate(of_name[way]))
            line += f"{position_m:>12.4f} /{heading_deg:6.3f}"
        print(line, flush=True)
    whole = {way: rmse(np.concatenate(found[way])) for way in WAYS}
    print(f"{'all':36s}" + "".join(f"{whole[way][0]:>12.4f} /{whole[way][1]:6.3f}" for way in WAYS))
    worse = bool(np.any(whole[WAYS[2]] > whole[WAYS[1]]))
    position, heading = whole[WAYS[2]] / whole[WAYS[1]]
    print(f"deskewed, the position is {position:.2f} times as far off as measured, the heading {heading:.2f} times")
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
