"""glass_nav locate: corrects a rough pose so that one scan lies on the walls of the map. No roscore."""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path
from typing import Optional

import numpy as np

from glass_nav.cli import out_file
from glass_nav.evaluation.plots import location_picture
from glass_nav.evaluation.plots.location_picture import LocatedScan
from glass_nav.geometry import angles
from glass_nav.localization.segments import segment_locator
from glass_nav.localization.segments.segment_correction import METHODS, SegmentCorrectionParams, SegmentQuality
from glass_nav.localization.segments.segment_locator import Located, SegmentLocator
from glass_nav.recording import scan_file
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, RecordingError, Refusal
from glass_nav.sensing.scan import Scan
from glass_nav.world import map_file

HELP = "correct a rough pose by one scan"
DESCRIPTION = """Corrects a rough pose so that the beams of a scan end at the wall segments of the map. Prints the pose, how
well the scan fits there, and which directions the walls do not constrain. Draws the scan before and after. The rough pose may
be off by about 0.5 m and 10 degrees. Exit code 3 if the scan fits nowhere near it."""
EXAMPLES = (
    "glass_nav locate --map floor.yaml --scan scan.yaml --pose 4.3 4.0 0.0",
    "glass_nav locate --map floor.yaml --scan run.bag --index 120 --pose 4.3 4.0 0.0 --out pictures",
)

PICTURE = "located.png"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument("--map", required=True, type=Path, help="map_server .yaml, or MRPT .gridmap[.gz]")
    parser.add_argument(
        "--scan",
        required=True,
        type=Path,
        metavar="FILE",
        help="ROS bag or MRPT .rawlog (see --index), .yaml as rostopic echo -n 1 writes a LaserScan, "
        "or .csv: a line for each beam, angle [rad], range [m]",
    )
    parser.add_argument(
        "--pose",
        required=True,
        type=float,
        nargs=3,
        metavar=("X", "Y", "YAW"),
        help="rough pose of the robot in the map; m, m, rad",
    )
    parser.add_argument("--index", type=int, metavar="N", help="which scan of a log, from 0 (default 0)")
    parser.add_argument(
        "--method",
        choices=METHODS,
        default=METHODS[0],
        help="least_squares: x, y and yaw at once; document: the mean of all displacements, "
        "which converges more slowly (default least_squares)",
    )
    parser.add_argument(
        "--iterations",
        type=int,
        metavar="T",
        help=f"steps of a correction (default {SegmentCorrectionParams().iterations}; document 40)",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("."), metavar="DIR", help=f"folder for {PICTURE}, or the file (default .)"
    )
    parser.add_argument("--scan-topic", metavar="TOPIC", help="of a log; default: the only one, or /scan")
    parser.add_argument("--base-frame", metavar="FRAME", help="of a bag; default: base_link, else base_footprint")
    parser.add_argument("--odom-frame", metavar="FRAME", help="of a bag; default: odom")
    parser.add_argument(
        "--laser-pose",
        type=float,
        nargs=3,
        metavar=("X", "Y", "YAW"),
        help="of the laser on the robot; m, m, rad; default: tf of a bag, else 0 0 0",
    )


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    for name in ("pose", "laser_pose"):
        values = getattr(arguments, name)
        if values is not None and not np.all(np.isfinite(values)):
            return f"--{name.replace('_', '-')} must be finite, got {' '.join(f'{value:g}' for value in values)}"
    if arguments.index is not None and arguments.index < 0:
        return f"--index must be >= 0, got {arguments.index}"
    if arguments.index is not None and arguments.scan.suffix in scan_file.SUFFIXES:
        return f"--index is for logs, {arguments.scan} holds one scan"
    if arguments.iterations is not None and arguments.iterations < 1:
        return f"--iterations must be >= 1, got {arguments.iterations}"
    return None


def main(arguments: argparse.Namespace) -> None:
    """Load, correct, draw, print.

    Raises:
        RecordingError, MapError, ValueError, OSError: bad input, or a scan that fits nowhere near; one line.
    """
    grid_map = map_file.load(arguments.map)
    scan = _scan(arguments)
    locator = SegmentLocator(grid_map, _params(arguments))
    if not len(locator.segments_m):
        raise ValueError(f"{arguments.map}: no wall of the map is long enough for a segment")
    if not scan.answered.any():
        raise ValueError(f"{arguments.scan}: no beam of the scan returned")
    rough = np.array(arguments.pose)
    located = locator.locate(scan, rough)
    found = located.correction
    for line in _lines(scan, located, rough, len(locator.segments_m)):
        print(line)
    drawn = LocatedScan(scan.points_in_base(), located.case, locator.segments_m, rough, found.map_from_base)
    out = out_file.in_folder(arguments.out, PICTURE)
    location_picture.draw(
        out,
        grid_map,
        drawn,
        f"{arguments.scan.name} on {arguments.map.name}",
        f"before: {_measures(found.before)}",
        f"after: {_measures(found.after)}",
    )
    print(f"drawn to {out}")
    refusal = segment_locator.refusal(scan, located, rough)
    if refusal is not None:
        raise ValueError(refusal)


def _params(arguments: argparse.Namespace) -> SegmentCorrectionParams:
    if arguments.iterations is not None:
        return SegmentCorrectionParams(method=arguments.method, iterations=arguments.iterations)
    if arguments.method == "document":  # walls across a move make it shorter
        return SegmentCorrectionParams(method=arguments.method, iterations=40)
    return SegmentCorrectionParams(method=arguments.method)


def _scan(arguments: argparse.Namespace) -> Scan:
    pose = arguments.laser_pose
    if arguments.scan.suffix in scan_file.SUFFIXES:
        return scan_file.load(arguments.scan, (0.0, 0.0, 0.0) if pose is None else pose)
    laser_pose = None if pose is None else (pose[0], pose[1], pose[2])
    recording = open_log(
        arguments.scan,
        LogOptions(arguments.scan_topic, None, arguments.base_frame, arguments.odom_frame, laser_pose, "none", "none"),
    )
    index = arguments.index or 0
    entry = next(itertools.islice(recording, index, None), None)
    if entry is None:
        raise RecordingError(
            f"{arguments.scan}: --index must be below {len(recording)}, the number of its scans, got {index}"
        )
    if isinstance(entry, Refusal):
        raise RecordingError(f"{arguments.scan}: scan {index} cannot be used: {entry.reason}")
    return entry.scan


def _lines(scan: Scan, located: Located, rough: np.ndarray, segments: int) -> "list[str]":
    found = located.correction
    x, y, yaw = found.map_from_base
    moved = found.map_from_base - rough
    return [
        f"scan      {len(scan)} beams, {np.count_nonzero(scan.answered)} returned, "
        f"{np.count_nonzero(located.used)} used; {segments} wall segments",
        f"pose      x {x:.3f} m  y {y:.3f} m  yaw {yaw:.4f} rad ({np.degrees(yaw):.2f} deg)",
        f"moved     {np.hypot(moved[0], moved[1]):.3f} m, {np.degrees(angles.wrap(moved[2])):+.2f} deg",
        f"free      {segment_locator.free_in_words(found)}",
        f"quality   {_measures(found.after)}; {found.after.inlier_share:.0%} of the used ones within "
        f"{SegmentCorrectionParams().outlier_m:g} m of walls",
        f"before    {_measures(found.before)}",
    ]


def _measures(quality: SegmentQuality) -> str:
    return f"Emse {quality.mse_m2:.5f} m^2, Ecf {quality.classification_factor:.3f}, combined {quality.combined:.3f}"
