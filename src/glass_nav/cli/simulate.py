"""glass_nav simulate: drives a simulated robot through a building with glass and records a bag. No roscore."""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Dict, Optional

import numpy as np

from glass_nav.cli import out_file
from glass_nav.cli.progress import Progress
from glass_nav.recording.bag_writer import BagWriter
from glass_nav.simulation import (
    building_file,
    building_map,
    erased_glass,
    lidar,
    occupancy_mapper,
    path_follower,
    shipped_buildings,
)
from glass_nav.simulation.building import Building
from glass_nav.simulation.lidar import ECHOES, LidarModel
from glass_nav.simulation.odometry import JOINTS
from glass_nav.simulation.path_follower import FIRST, PathFollowerParams
from glass_nav.simulation.robot import KINDS, RobotParams
from glass_nav.simulation.simulation import Frame, Simulation
from glass_nav.vocabulary import CASES_IN_ORDER
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

COMPLETE, ERASING = MAPPERS = ("complete", "erasing")
_MAPPER_STREAM = 0x3A99E4  # of the seed, for the noise of the mapping drive

HELP = "drive a robot through a building of glass and record a bag"
DESCRIPTION = """Drives a simulated robot along a path through a building. Writes a bag (/scan, /odom, /tf, /clock) with the
ground truth (/ground_truth, /true_beams: the case of every beam), and the map of the building. Needs no roscore. The same
seed gives the same bag. --glass-erased and --mapper omit glass from the map, as real mappers do; the bag does not change."""
EXAMPLES = (
    "glass_nav simulate glass_office --seed 1 --out simulated",
    "glass_nav simulate glass_bridge --lidar coated --speed 0.4 --out bridge.bag",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "building",
        metavar="BUILDING",
        help="building.yaml, its folder, or the name of a building of the package: "
        f"{', '.join(shipped_buildings.shipped())}",
    )
    parser.add_argument(
        "--out",
        required=True,
        type=Path,
        metavar="DIR",
        help="folder for BUILDING.bag, or the bag, such as run.bag; the map goes beside it as run.map.yaml; where it lacks glass, the whole one as "
        "run.complete.map.yaml",
    )
    parser.add_argument(
        "--path",
        default=FIRST,
        metavar="NAME_OR_FILE",
        help="a path of the building, or a file of waypoints: yaml, a list of [x, y], or lines of x,y; "
        "default: the building's first path",
    )
    parser.add_argument(
        "--lidar", default="sensitive", metavar="PRESET", help=f"{', '.join(lidar.PRESETS)} (default sensitive)"
    )
    parser.add_argument("--robot", default="diff", choices=KINDS, help="its kind of base (default diff)")
    parser.add_argument("--seed", type=int, default=0, help="of everything random (default 0)")
    parser.add_argument(
        "--changed",
        type=float,
        default=0.0,
        metavar="SHARE",
        help="0 to 1 of the movable furniture stands elsewhere than on the map (default 0)",
    )
    parser.add_argument(
        "--mapper",
        choices=MAPPERS,
        default=COMPLETE,
        help="complete: the map shows every surface (default); erasing: it is made of scans along the path, and cells "
        "that most beams pass are free: of panes, specks remain",
    )
    parser.add_argument(
        "--glass-erased",
        type=float,
        default=0.0,
        metavar="SHARE",
        help="0 to 1 of the panes are missing from the map, whole ones, by the seed (default 0)",
    )
    parser.add_argument("--rate", type=float, default=10.0, metavar="HZ", help="scans a second (default 10)")
    parser.add_argument(
        "--turn-time",
        type=float,
        default=0.0,
        metavar="S",
        help="time from the first beam of a scan to the last one, while the robot moves; s, default 0",
    )
    parser.add_argument("--beams", type=int, metavar="N", help="of a scan; default: the preset's")
    parser.add_argument("--echo", choices=ECHOES, help="which echo the lidar reports; default: the preset's")
    parser.add_argument("--speed", type=float, default=0.6, metavar="M_S", help="m/s along the path (default 0.6)")
    parser.add_argument("--resolution", type=float, default=0.05, metavar="M", help="cell of the map, m (default 0.05)")


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    if arguments.seed < 0:
        return f"--seed must be >= 0, got {arguments.seed}"
    if not 0.0 <= arguments.changed <= 1.0:
        return f"--changed must be 0 to 1, got {arguments.changed}"
    if not 0.0 <= arguments.glass_erased <= 1.0:
        return f"--glass-erased must be 0 to 1, got {arguments.glass_erased}"
    if arguments.mapper == ERASING and arguments.glass_erased > 0.0:
        return f"--mapper {ERASING} erases what beams pass; it takes no --glass-erased, got {arguments.glass_erased}"
    if not 0.1 <= arguments.rate <= 1000.0:
        return f"--rate must be 0.1 to 1000 Hz, got {arguments.rate}"
    if not 0.0 <= arguments.turn_time * arguments.rate <= 1.0:
        return f"--turn-time must be >= 0 s and no longer than 1 / --rate, got {arguments.turn_time}"
    if not 0.0 < arguments.speed < math.inf:
        return f"--speed must be > 0 m/s, got {arguments.speed}"
    if not 0.01 <= arguments.resolution <= 1.0:
        return f"--resolution must be 0.01 to 1 m, got {arguments.resolution}"
    try:
        _lidar_model(arguments)
    except ValueError as err:
        return str(err)
    return None


def main(arguments: argparse.Namespace) -> None:
    """Load, drive, write.

    Raises:
        BuildingError, PathError, SimulationError, RecordingError, OSError: bad input; one line.
    """
    building = building_file.load(shipped_buildings.find(arguments.building))
    simulation = Simulation(
        building,
        _lidar_model(arguments),
        RobotParams(arguments.robot),
        seed=arguments.seed,
        scan_rate_hz=arguments.rate,
        changed_share=arguments.changed,
        turn_time_s=arguments.turn_time,
    )
    pace = PathFollowerParams(speed_m_s=arguments.speed)
    way_m = simulation.follower(arguments.path, pace).length_m
    maps = _maps(arguments, building)
    out = out_file.in_folder(arguments.out, f"{Path(arguments.building).stem}.bag")
    tally, shown_m = _Tally(), 0
    progress = Progress("simulate", math.ceil(way_m), unit="m")
    try:
        with BagWriter(out) as bag:
            bag.mounting(simulation.stamp_ns, simulation.base_from_laser)
            for frame in simulation.drive(arguments.path, pace):
                write_frame(bag, frame, simulation.scan_period_s)
                tally.add(frame)
                while shown_m + 1 <= tally.way_m:
                    shown_m += 1
                    progress.step()
    finally:
        progress.finish()
    for suffix, grid_map in maps.items():
        map_file.save(grid_map, out.with_suffix(suffix), ".png")
    files = [out, *(out.with_suffix(suffix) for suffix in maps)]
    print(f"{tally.line()}; written to {', '.join(map(str, files[:-1]))} and {files[-1]}")


def _maps(arguments: argparse.Namespace, building: Building) -> Dict[str, GridMap]:
    """The maps to write, by the end of the bag's name: the robot's, and the complete one if that differs."""
    complete = building_map.draw(building, arguments.resolution)
    if arguments.mapper == ERASING:
        rng = np.random.default_rng([arguments.seed, _MAPPER_STREAM])
        path_m = path_follower.find(arguments.path, building)
        drawn = occupancy_mapper.draw(building, _lidar_model(arguments), path_m, arguments.resolution, rng)
    elif arguments.glass_erased > 0.0:
        erased = erased_glass.choose(building, arguments.glass_erased, arguments.seed)
        drawn = building_map.draw(building, arguments.resolution, erased)
    else:
        return {".map.yaml": complete}
    return {".map.yaml": drawn, ".complete.map.yaml": complete}


def write_frame(bag: BagWriter, frame: Frame, period_s: float) -> None:
    """Writes everything recorded since the last frame, and the ground truth of this one."""
    for reading in frame.odometry:
        bag.odometry(reading.stamp_ns, reading.odom_from_base, reading.velocity)
        if reading.wheels_rad is not None:
            bag.wheels(reading.stamp_ns, JOINTS, reading.wheels_rad)
    bag.scan(frame.scan, period_s)
    bag.truth(frame.stamp_ns, frame.map_from_base, frame.truth.case, frame.truth.exact_m, frame.truth.crossing_m)


class _Tally:
    """Summary of a run in one line."""

    def __init__(self) -> None:
        self._began_s = time.perf_counter()
        self._scans = 0
        self._cases: "Counter[int]" = Counter()
        self._first_ns = self._last_ns = 0
        self._last_m: Optional[np.ndarray] = None
        self.way_m = 0.0

    def add(self, frame: Frame) -> None:
        position_m = frame.map_from_base[:2]
        if self._last_m is None:
            self._first_ns = frame.stamp_ns
        else:
            self.way_m += float(np.hypot(*(position_m - self._last_m)))
        self._last_m, self._last_ns = position_m, frame.stamp_ns
        self._scans += 1
        self._cases.update(frame.truth.case.tolist())

    def line(self) -> str:
        seconds = (self._last_ns - self._first_ns) * 1e-9
        times = seconds / max(time.perf_counter() - self._began_s, 1e-9)
        total = sum(self._cases.values())
        shares = ", ".join(f"{case.words} {100.0 * self._cases[case] / total:.1f} %" for case in CASES_IN_ORDER)
        return (
            f"{self._scans} scans, {self.way_m:.1f} m, {seconds:.1f} s ({times:.0f} times real time); beams: {shares}"
        )


def _lidar_model(arguments: argparse.Namespace) -> LidarModel:
    changes = {name: getattr(arguments, name) for name in ("beams", "echo") if getattr(arguments, name) is not None}
    return replace(lidar.preset(arguments.lidar), **changes)
