"""glass_nav replay: runs the filter over a recorded log, and scores it. No roscore."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any, Dict, List, Optional

from glass_nav.cli import log_arguments
from glass_nav.cli.progress import Progress
from glass_nav.evaluation.metrics import thresholds
from glass_nav.evaluation.metrics.thresholds import Threshold
from glass_nav.evaluation.pages import replay_table
from glass_nav.replay import prepared_replay, replay_topology
from glass_nav.replay.replay_files import FiledReplay, Outputs
from glass_nav.replay.replay_options import ReplayOptions

HELP = "run the localization on a recorded log"
DESCRIPTION = """Runs the localization on every scan of a recorded log. Writes metrics.json, trajectory.tum,
per_scan.csv, beam_cases.npz, worst_scans.npz, glass_map.yaml (probability of glass of each wall cell) and trajectory.png. If
the log has the true cases of its beams, as simulated ones do, they are scored too (cases.png). Needs no roscore."""
EXAMPLES = (
    "glass_nav replay run.bag --map floor.yaml --out results",
    "glass_nav replay run.bag --map floor.yaml --global --duration 60 --out results --bag results/shown.bag",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "log",
        metavar="LOG",
        type=Path,
        nargs="+",
        help="bag of ROS 1 or ROS 2, or MRPT .rawlog; several bags: the parts of one run",
    )
    parser.add_argument("--map", required=True, type=Path, help="map_server .yaml, or MRPT .gridmap[.gz]")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for the results")
    parser.add_argument(
        "--bag",
        type=Path,
        metavar="BAG",
        help="also write a bag for rviz and PlotJuggler: map, tf, scans, poses, particles, status, "
        "cases, cloud and glass map, on the topics of the node",
    )
    parser.add_argument(
        "--topology",
        nargs="?",
        const=replay_topology.FROM_MAP,
        metavar="ATLAS",
        help="also list the nodes of an atlas that the robot passed, and which of them are detected with lidar "
        "and odometry alone, as by the driver: a table, topology.csv and topology.png. ATLAS is a file, its folder, "
        f"the name of a shipped one, or {replay_topology.FROM_MAP} (default): made from the map",
    )
    parser.add_argument(
        "--smooth",
        action="store_true",
        help="also smooth the trajectory over the whole log and compare the filter with it (smoothed.tum), for logs "
        "without a good ground truth",
    )
    parser.add_argument(
        "--fail-if",
        action="append",
        default=[],
        metavar="METRIC>LIMIT",
        help="exit with 1 if a figure of metrics.json is beyond a limit, such as 'position_p95_m>0.3'; may be repeated",
    )
    log_arguments.add_run_arguments(parser)
    log_arguments.add_log_arguments(parser)
    parser.add_argument("--no-picture", action="store_true", help="do not draw trajectory.png and cases.png")


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    try:
        _options(arguments)
        _thresholds(arguments)
    except ValueError as err:
        return str(err)
    return None


def main(arguments: argparse.Namespace) -> bool:
    """Open, run, write.

    Returns:
        whether the run keeps to the limits of --fail-if.

    Raises:
        RecordingError, MapError, AtlasError, ParamError, ValueError, OSError: bad input; one line.
    """
    outputs = Outputs(arguments.out, arguments.bag, arguments.topology, not arguments.no_picture, arguments.smooth)
    metrics = run(_options(arguments), outputs)
    failures = [failure for failure in (each.failure(metrics) for each in _thresholds(arguments)) if failure]
    for failure in failures:
        _say(failure)
    return not failures


def run(options: ReplayOptions, outputs: Outputs) -> Dict[str, Any]:
    """Runs one replay, and prints its progress and figures.

    Raises:
        RecordingError, MapError, AtlasError, ParamError, ValueError, OSError: bad input; one line.
    """
    ready = prepared_replay.prepare(options)
    replay = FiledReplay(ready, outputs)
    for note in ready.notes:
        _say(note)
    progress = Progress("replay", ready.expected_scans)
    try:
        result = replay.run(progress.step)
    finally:
        progress.finish()
    topology = replay.write(result)
    for reason, count in result.refusals.most_common():
        _say(f"{count} scans rejected: {reason}")
    passed = None if topology is None else topology.metrics()
    smoothed = None if replay.smoothed is None else replay.smoothed.metrics()
    lines = replay_table.run_lines(result) + replay_table.smoothed_lines(smoothed) + replay_table.topology_lines(passed)
    print("\n".join(lines))
    print(f"written to {outputs.folder}" + ("" if outputs.bag is None else f" and {outputs.bag}"))
    return {
        **result.metrics(),
        **({} if passed is None else {"topology": passed}),
        **({} if smoothed is None else {"smoothed": smoothed}),
    }


def _options(arguments: argparse.Namespace) -> ReplayOptions:
    return ReplayOptions(
        tuple(arguments.log), arguments.map, arguments.params, arguments.seed, log_arguments.log_use(arguments)
    )


def _thresholds(arguments: argparse.Namespace) -> List[Threshold]:
    return [thresholds.parse(text) for text in arguments.fail_if]


def _say(text: str) -> None:
    print(f"glass_nav replay: {text}", file=sys.stderr)
