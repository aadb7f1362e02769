"""Options of a replay that several subcommands share, and what they ask of replay/."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import List, Optional

from glass_nav.recording.recording import LogOptions
from glass_nav.replay.replay_options import LogUse, StartOptions, Triple
from glass_nav.replay.window import Window


def add_run_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of a single run over a log."""
    parser.add_argument(
        "--params",
        type=Path,
        metavar="FILE",
        help="yaml of parameters, names as for the node; default: the node's defaults",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the filter's random numbers (default 0)")


def add_log_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the log and of the start, common to all runs over it."""
    parser.add_argument(
        "--ground-truth",
        metavar="TOPIC_OR_FILE",
        help="poses in the map: a PoseStamped, PoseWithCovarianceStamped or Odometry topic, tf:FRAME "
        "for a tf frame of a bag, a TUM file, or MRPT's _GT.txt; default: /ground_truth of a "
        "bag, LOG_GT.txt beside a rawlog; none: no ground truth",
    )
    parser.add_argument(
        "--true-beams",
        metavar="TOPIC",
        help="true cases: glass_nav/TrueBeams, or a glass_nav/BeamCases; default: the only topic of "
        "the first, or true_cases of the second; none: do not score the cases",
    )
    start = parser.add_argument_group("start")
    start.add_argument(
        "--initial-pose",
        type=float,
        nargs=3,
        metavar=("X", "Y", "YAW"),
        help="m, m, rad; default: the ground truth's pose at the first scan, else initial_pose_* of the parameters",
    )
    start.add_argument(
        "--initial-cov",
        type=float,
        nargs=3,
        metavar=("XX", "YY", "AA"),
        help="m^2, m^2, rad^2; default: initial_cov_* of the parameters",
    )
    start.add_argument(
        "--global", dest="everywhere", action="store_true", help="start anywhere in the map instead of at a pose"
    )
    source = parser.add_argument_group("topics and frames of the log")
    source.add_argument(
        "--scan-topic",
        metavar="TOPIC",
        help="LaserScan (of a rawlog: the sensor's label); default: the only one, or /scan",
    )
    source.add_argument("--odom-topic", metavar="TOPIC", help="Odometry; default: tf odom <- base, else the only one")
    source.add_argument("--odom-frame", metavar="FRAME", help="default: odom")
    source.add_argument("--base-frame", metavar="FRAME", help="default: base_link, else base_footprint")
    source.add_argument(
        "--laser-pose",
        type=float,
        nargs=3,
        metavar=("X", "Y", "YAW"),
        help="pose of the laser on the robot, for logs without its tf; m, m, rad",
    )
    part = parser.add_argument_group("part of the log")
    part.add_argument("--start", type=float, default=0.0, metavar="S", help="seconds after the first scan")
    part.add_argument("--duration", type=float, metavar="S", help="seconds to replay")
    part.add_argument("--every", type=int, default=1, metavar="N", help="only every N-th scan")
    part.add_argument("--max-scans", type=int, metavar="N", help="at most this number of scans")


def log_use(arguments: argparse.Namespace) -> LogUse:
    """The values of the options of add_log_arguments().

    Raises:
        ValueError: what cannot be; one line.
    """
    if arguments.everywhere and arguments.initial_pose is not None:
        raise ValueError("--global and --initial-pose exclude each other")
    return LogUse(
        LogOptions(
            arguments.scan_topic,
            arguments.odom_topic,
            arguments.base_frame,
            arguments.odom_frame,
            _triple(arguments.laser_pose),
            arguments.ground_truth,
            arguments.true_beams,
        ),
        StartOptions(_triple(arguments.initial_pose), _triple(arguments.initial_cov), arguments.everywhere),
        Window(arguments.start, arguments.duration, arguments.every, arguments.max_scans),
    )


def _triple(values: Optional[List[float]]) -> Optional[Triple]:
    return None if values is None else (values[0], values[1], values[2])
