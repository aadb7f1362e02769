"""glass_nav doctor: finds faults of a bag or of the running robot. A bag needs no roscore."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import List, Optional

from glass_nav.checkup import doctor
from glass_nav.checkup.doctor import FrameNames
from glass_nav.cli import ros_process
from glass_nav.cli.progress import Progress
from glass_nav.recording import bag_observer
from glass_nav.world import map_file

HELP = "find faults of a bag or a running robot, with remedies"
DESCRIPTION = """Checks scans, frames, stamps and odometry of a bag (ROS 1 or ROS 2) or of the running robot, and with
--map how the scans fit the map. Lists each fault with its remedy. Exit code 0: no fault, 1: faults, 2: wrong usage, 3: bad
input."""
EXAMPLES = (
    "glass_nav doctor run.bag --map floor.yaml",
    "glass_nav doctor --live --seconds 20",
)
LIVE_MODULE = "glass_nav.ros.tools.doctor_live"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument("bag", metavar="BAG", type=Path, nargs="*", help="bag; several: the parts of one run")
    parser.add_argument(
        "--map",
        type=Path,
        help="map_server .yaml, or MRPT .gridmap[.gz]; with --live the default is "
        "what static_map or the topic map gives",
    )
    parser.add_argument("--live", action="store_true", help="listen to the running robot instead")
    parser.add_argument(
        "--seconds",
        type=float,
        default=10.0,
        metavar="S",
        help="with --live: how long to listen (default 10); drive meanwhile, with a turn",
    )
    parser.add_argument("--odom-frame", default="odom", metavar="FRAME", help="default: odom")
    parser.add_argument("--base-frame", metavar="FRAME", help="default: base_link, else base_footprint")


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    if bool(arguments.bag) == arguments.live:
        return "give a bag, or --live to listen to the robot" + (", not both" if arguments.live else "")
    if not 0.0 < arguments.seconds < float("inf"):
        return f"--seconds must be > 0, got {arguments.seconds}"
    return None


def main(arguments: argparse.Namespace) -> bool:
    """Observe, examine, print.

    Returns:
        whether nothing was found.

    Raises:
        RecordingError, MapError, OSError: bad input; one line.
    """
    if arguments.live:
        return _live(arguments)
    grid_map = None if arguments.map is None else map_file.load(arguments.map)
    progress = Progress("reading", bag_observer.message_count(arguments.bag), unit="messages")
    try:
        seen = bag_observer.observe(arguments.bag, progress.step)
    finally:
        progress.finish()
    report = doctor.examine(seen, grid_map, FrameNames(arguments.odom_frame.lstrip("/"), arguments.base_frame))
    print(report.text)
    return not report.findings


def _live(arguments: argparse.Namespace) -> bool:
    command: List[str] = ["--seconds", str(arguments.seconds), "--odom-frame", arguments.odom_frame]
    for option, value in (("--map", arguments.map), ("--base-frame", arguments.base_frame)):
        command += [] if value is None else [option, str(value)]
    print(f"glass_nav doctor: listening for {arguments.seconds:g} s; let the robot drive, with a turn", file=sys.stderr)
    return ros_process.run(LIVE_MODULE, command, "glass_nav doctor", codes=(0, 1)) == 0
