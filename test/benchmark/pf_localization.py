#!/usr/bin/env python3
"""MRPT's pf-localization at the task `global` of global_localization.py: same tracks, same starts, same scans.

    python test/benchmark/pf_localization.py                                  10 seeds, every log and building
    python test/benchmark/pf_localization.py --tracks intel glass_office --seeds 3 --out figures.json

It has no state that reports when it is sure. Found: its mean is first within 0.7 m and 20 degrees of the truth and
stays so for 3 m (or to the end). This needs hindsight, which ours is not given: it must report when. Wrong at the end:
its last mean is not there. The seed chooses the start (and a building's drive); pf-localization seeds itself from the
clock, so its runs differ each time.

The settings are those of the localization_demo.ini that comes with it: 40000 particles in the free cells of the whole
map, KLD sampling from 150 to 40000 (bins of 0.1 m and 10 degrees, delta and epsilon 0.01), likelihood field (sigma
0.2 m, every 20th beam), 0.1 m and 2 degrees of noise a step; --set changes them. It uses every scan that it is
given, and is given those that Localizer uses: one after each 0.1 m or 0.1 rad. Needs apt's mrpt-apps, cmake and
libmrpt-maps-dev; a small program compiled into .build writes the map and the log.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple

import numpy as np

import tracks
from glass_nav.geometry import se2
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap
from global_localization import MAX_M, count, median

REPO = Path(__file__).resolve().parents[2]
WRITER = Path(__file__).resolve().with_name("mrpt_track_writer.cpp")
WRITER_BUILD = REPO / ".build" / "mrpt_track_writer"
WRITER_CMAKE = """cmake_minimum_required(VERSION 3.10)
project(mrpt_track_writer CXX)
find_package(mrpt-obs REQUIRED)
find_package(mrpt-maps REQUIRED)
add_executable(mrpt_track_writer {source})
target_link_libraries(mrpt_track_writer mrpt::obs mrpt::maps)
"""
KEPT_M = 3.0  # of way in the right place make it found
FREE, UNKNOWN, OCCUPIED = 0.99, 0.5, 0.01  # of a cell in MRPT's grids: how surely it is free
ESTIMATE = re.compile(r"PDF estimation: \(([^,]+),([^,]+),([^)]+)deg\)")

SETTINGS: Dict[str, Dict[str, str]] = {
    "KLD_options": {
        "KLD_binSize_PHI_deg": "10",
        "KLD_binSize_XY": "0.10",
        "KLD_delta": "0.01",
        "KLD_epsilon": "0.01",
        "KLD_minSampleSize": "150",
        "KLD_maxSampleSize": "40000",
        "KLD_minSamplesPerBin": "0",
    },
    "PF_options": {
        "PF_algorithm": "0",
        "resamplingMethod": "0",
        "adaptiveSampleSize": "1",
        "BETA": "0.5",
        "sampleSize": "1",
    },
    "DummyOdometryParams": {"minStdXY": "0.10", "minStdPHI": "2.0"},
    "LocalizationExperiment": {
        "use_3D_poses": "false",
        "particles_count": "40000",
        "init_PDF_mode": "0",
        "init_PDF_min_x": "0",
        "init_PDF_min_y": "0",
        "experimentRepetitions": "1",
        "3DSceneFrequency": "-1",
        "SHOW_PROGRESS_3D_REAL_TIME": "0",
    },
    "MetricMap": {
        "occupancyGrid_count": "1",
        "gasGrid_count": "0",
        "landmarksMap_count": "0",
        "pointsMap_count": "0",
        "beaconMap_count": "0",
        "likelihoodMapSelection": "-1",
    },
    "MetricMap_occupancyGrid_00_likelihoodOpts": {
        "likelihoodMethod": "4",
        "LF_decimation": "20",
        "LF_stdHit": "0.20",
        "LF_maxCorrsDistance": "0.30",
        "LF_zHit": "0.95",
        "LF_zRandom": "0.05",
        "LF_maxRange": "80",
        "LF_alternateAverageMethod": "0",
    },
}

Job = Tuple[str, int, Dict[str, str], float]


class Step(NamedTuple):
    """A scan that is given, and the distance driven so far."""

    way_m: float
    moment: tracks.Moment


class Answer(NamedTuple):
    """The results of one run of pf-localization."""

    grid_from_base: np.ndarray  # (U, 3) its mean after each scan, as many as it came to
    cpu_s: float
    out_of_time: bool


def settings_with(changes: Mapping[str, str]) -> Dict[str, Dict[str, str]]:
    """SETTINGS with some of the values changed.

    Raises:
        ValueError: no such setting.
    """
    known = {name for section in SETTINGS.values() for name in section}
    for name in changes:
        if name not in known:
            raise ValueError(f"pf-localization has no setting {name!r} here, it has {', '.join(sorted(known))}")
    return {
        section: {name: changes.get(name, value) for name, value in values.items()}
        for section, values in SETTINGS.items()
    }


def config_text(folder: Path, grid_map: GridMap, settings: Mapping[str, Mapping[str, str]]) -> str:
    """The .ini for the map and the log in that folder; particles anywhere on the grid, whose corner is the origin."""
    rows, columns = grid_map.occupancy.shape
    place = {
        "map_file": folder / "map.gridmap.gz",
        "rawlog_file": folder / "track.rawlog",
        "logOutput_dir": folder / "log",
        "init_PDF_max_x": columns * grid_map.resolution_m,
        "init_PDF_max_y": rows * grid_map.resolution_m,
    }
    lines: List[str] = []
    for section, values in settings.items():
        everything = {**values, **place} if section == "LocalizationExperiment" else values
        lines += [f"[{section}]", *(f"{name} = {value}" for name, value in everything.items()), ""]
    return "\n".join(lines)


def map_numbers(grid_map: GridMap) -> np.ndarray:
    """The contents of map.bin for the writer: resolution, columns, rows, cells."""
    rows, columns = grid_map.occupancy.shape
    cells = np.where(grid_map.occupied, OCCUPIED, np.where(grid_map.free, FREE, UNKNOWN))
    return np.concatenate([[grid_map.resolution_m, columns, rows], cells.reshape(-1)])


def scan_numbers(scan: Scan, odom_from_base: np.ndarray) -> np.ndarray:
    """The contents of track.bin for the writer, for one scan.

    Raises:
        ValueError: the beams are not evenly spaced, which MRPT's scans are.
    """
    bearings_rad = np.unwrap(scan.angles_rad)
    if not np.allclose(np.diff(bearings_rad, 2), 0.0, atol=1e-4):
        raise ValueError(f"scan at {scan.stamp_ns * 1e-9:.3f} s: MRPT wants evenly spaced beams")
    aperture_rad = bearings_rad[-1] - bearings_rad[0]
    middle_rad = 0.5 * (bearings_rad[0] + bearings_rad[-1])
    base_from_middle = se2.compose(scan.base_from_laser, np.array([0.0, 0.0, middle_rad]))
    ranges_m = np.where(scan.answered, scan.ranges_m, np.nan)
    return np.concatenate(
        [
            [scan.stamp_ns * 1e-9],
            odom_from_base,
            base_from_middle,
            [abs(aperture_rad), aperture_rad > 0.0, scan.range_max_m, len(scan)],
            ranges_m,
        ]
    )


def steps_of(track: tracks.Track, start: int) -> List[Step]:
    """The scans that Localizer would use, per lidar."""
    schedule = LocalizerParams().schedule
    steps: List[Step] = []
    taken: List[str] = []
    odom_from_last: Optional[np.ndarray] = None
    for way_m, moment in tracks.moments_of(track, start, MAX_M):
        if odom_from_last is not None:
            ahead = se2.compose(se2.inverse(odom_from_last), moment.odom_from_base)
            drove_m, turned_rad = se2.travelled(ahead)
            if drove_m >= schedule.update_min_d or turned_rad >= schedule.update_min_a:
                taken = []
        if moment.scan.lidar not in taken:
            taken.append(moment.scan.lidar)
            odom_from_last = moment.odom_from_base
            steps.append(Step(way_m, moment))
    return steps


def means_in(log: str) -> np.ndarray:
    """(U, 3) means after each scan, from what pf-localization prints; NaN where it has none."""
    found = [[float(x), float(y), np.radians(float(yaw_deg))] for x, y, yaw_deg in ESTIMATE.findall(log)]
    return np.array(found, float).reshape(-1, 3)


def found_after(way_m: np.ndarray, right: np.ndarray) -> Optional[float]:
    """Distance [m] after which the place is first right and stays so for KEPT_M, or to the end; None: never."""
    for index, here_m in enumerate(way_m):
        if np.all(right[index:][way_m[index:] <= here_m + KEPT_M]):
            return float(here_m)
    return None


def writer() -> Path:
    """The program of mrpt_track_writer.cpp, compiled if it is out of date."""
    program = WRITER_BUILD / "build" / "mrpt_track_writer"
    if not program.is_file() or program.stat().st_mtime < WRITER.stat().st_mtime:
        WRITER_BUILD.mkdir(parents=True, exist_ok=True)
        (WRITER_BUILD / "CMakeLists.txt").write_text(WRITER_CMAKE.format(source=WRITER.as_posix()))
        cmake = ["cmake", "-S", str(WRITER_BUILD), "-B", str(program.parent), "-DCMAKE_BUILD_TYPE=Release"]
        for command in (cmake, ["cmake", "--build", str(program.parent)]):
            done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            if done.returncode:
                raise RuntimeError(f"{WRITER.name} does not compile:\n{done.stdout}")
    return program


def write(folder: Path, grid_map: GridMap, steps: List[Step], settings: Mapping[str, Mapping[str, str]]) -> Path:
    """Map, log and config in that folder; the config."""
    config = folder / "config.ini"
    config.write_text(config_text(folder, grid_map, settings))
    map_numbers(grid_map).astype(np.float64).tofile(str(folder / "map.bin"))
    numbers = [scan_numbers(step.moment.scan, step.moment.odom_from_base) for step in steps]
    np.concatenate(numbers).astype(np.float64).tofile(str(folder / "track.bin"))
    subprocess.run([str(writer()), str(folder)], check=True)
    return config


def localize(config: Path, most_s: float) -> Answer:
    """Run pf-localization, without a window, for a limited time."""
    log = config.with_name("log.txt")
    began = resource.getrusage(resource.RUSAGE_CHILDREN)
    out_of_time = False
    with log.open("w") as out:
        try:
            done = subprocess.run(
                ["pf-localization", str(config)],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                timeout=most_s,
            )
            if done.returncode:
                raise RuntimeError(f"pf-localization: exit code {done.returncode}:\n{log.read_text()[-2000:]}")
        except subprocess.TimeoutExpired:
            out_of_time = True
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = ended.ru_utime + ended.ru_stime - began.ru_utime - began.ru_stime
    return Answer(means_in(log.read_text()), cpu_s, out_of_time)


def run(job: Job) -> Dict[str, Any]:
    """One track with one seed."""
    name, seed, changes, most_s = job
    track = tracks.load(name, seed if name not in tracks.LOGS else 0)
    start = tracks.start_of(track, np.random.default_rng(seed))
    steps = steps_of(track, start)
    with tempfile.TemporaryDirectory(prefix="pf_localization_") as folder:
        config = write(Path(folder), track.grid_map, steps, settings_with(changes))
        answer = localize(config, most_s)
    if len(answer.grid_from_base) != len(steps) and not answer.out_of_time:
        raise RuntimeError(
            f"{name}: pf-localization got {len(steps)} scans and reported {len(answer.grid_from_base)} poses"
        )
    map_from_base = se2.compose(track.grid_map.map_from_grid, answer.grid_from_base)
    way_m = np.array([step.way_m for step in steps[: len(map_from_base)]])
    right = np.array(
        [tracks.is_right(pose, step.moment.map_from_base) for pose, step in zip(map_from_base, steps)], bool
    )
    found_m = found_after(way_m, right)
    return {
        "track": name,
        "seed": seed,
        "start": start,
        "found": found_m is not None,
        "found_m": found_m,
        "wrong": not len(right) or not right[-1],
        "driven_m": float(way_m[-1]) if len(way_m) else 0.0,
        "scans": len(right),
        "out_of_time": answer.out_of_time,
        "cpu_s": answer.cpu_s,
    }


HEADER = (
    "| track | right place | found after m | wrong at the end | out of time | driven m | CPU s |\n"
    "|---|---|---|---|---|---|---|"
)


def row(name: str, runs: List[Dict[str, Any]]) -> str:
    """A line of the table."""
    return (
        f"| {name} | {count(runs, 'found')}/{len(runs)} | {median(runs, 'found_m')} | {count(runs, 'wrong')} | "
        f"{count(runs, 'out_of_time')} | {median(runs, 'driven_m')} | {median(runs, 'cpu_s')} |"
    )


def changes_from(assignments: List[str]) -> Dict[str, str]:
    """NAME=VALUE of each."""
    changes = {name: value for name, _, value in (assignment.partition("=") for assignment in assignments)}
    settings_with(changes)
    return changes


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", nargs="+", choices=tracks.names(), default=tracks.names(), metavar="NAME")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--most-s", type=float, default=300.0, help="time a run may take [s]")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="one setting")
    parser.add_argument("--out", type=Path, help="JSON with the figures of all runs")
    arguments = parser.parse_args()
    if shutil.which("pf-localization") is None:
        parser.error("there is no pf-localization here: apt-get install mrpt-apps")
    try:
        changes = changes_from(arguments.set)
    except ValueError as error:
        parser.error(str(error))
    writer()  # before there are several processes
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    jobs: List[Job] = [(name, seed, changes, arguments.most_s) for name in arguments.tracks for seed in seeds]
    runs: List[Dict[str, Any]] = []
    print(HEADER, flush=True)
    with multiprocessing.Pool(arguments.jobs) as pool:  # imap keeps the order: a row is printed when complete
        for figures in pool.imap(run, jobs):
            runs.append(figures)
            if len(runs) % arguments.seeds == 0:
                print(row(figures["track"], runs[-arguments.seeds :]), flush=True)
    print(f"\nfound {count(runs, 'found')} of {len(runs)}, wrong at the end {count(runs, 'wrong')}")
    if arguments.out is not None:
        arguments.out.write_text(json.dumps(runs, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
