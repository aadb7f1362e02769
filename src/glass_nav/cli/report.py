"""glass_nav report: writes one run as an HTML file with its pictures inside."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Dict, Optional

import numpy as np

from glass_nav.cli import log_arguments, replay
from glass_nav.cli.progress import Progress
from glass_nav.evaluation.metrics import replay_result, run_story
from glass_nav.evaluation.pages import report_page
from glass_nav.evaluation.plots import report_pictures
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.replay.replay_files import Outputs
from glass_nav.replay.replay_options import ReplayOptions
from glass_nav.world import map_file

HELP = "write a report of one run as an HTML file"
DESCRIPTION = """Writes report.html, one file that needs no network, and its pictures as PNG files: the path over the map by
state, beam cases over time, the probability of glass, errors, reliability against the ground truth, the number of candidates
in a search, update times, and the ten worst scans. Its input is the folder written by `glass_nav replay --out`, or a log,
which is replayed first (all options but --map and --out are for that)."""
EXAMPLES = (
    "glass_nav report results --out report",
    "glass_nav report run.bag --map floor.yaml --out report",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "run", metavar="RESULTS|LOG", type=Path, help="folder of results of a replay; or a ROS bag or MRPT .rawlog"
    )
    parser.add_argument(
        "--map",
        type=Path,
        help="map_server .yaml, or MRPT .gridmap[.gz]; default for RESULTS: the map that the replay had",
    )
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for the report")
    log_arguments.add_run_arguments(parser)
    log_arguments.add_log_arguments(parser)


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    if arguments.map is None and arguments.run.exists() and not _is_results(arguments.run):
        return "a log needs --map"
    try:
        _options(arguments)
    except ValueError as err:
        return str(err)
    return None


def main(arguments: argparse.Namespace) -> None:
    """Replay if it is a log, read, draw, write.

    Raises:
        ValueError, OSError: bad input; one line.
    """
    folder = arguments.run
    if not folder.exists():
        raise ValueError(f"{folder}: does not exist")
    if not _is_results(folder):
        replay.run(_options(arguments), Outputs(arguments.out, pictures=False))
        folder = arguments.out
    result, metrics = replay_result.read(folder)
    path_map = Path(metrics["map"]) if arguments.map is None else arguments.map
    if arguments.map is None and not path_map.exists():
        raise ValueError(f"{folder}: the map of that replay, {path_map}, is not there from here: give --map")
    grid_map = map_file.load(path_map)
    ground = Ground(grid_map, _glass(folder, grid_map.occupancy.shape))
    arguments.out.mkdir(parents=True, exist_ok=True)
    scores: Optional[Dict[str, Any]] = metrics.get("cases")
    confusion = None if scores is None else np.array(scores["confusion"])
    progress = Progress("report", 7 + len(result.worst) + (confusion is not None), unit="pictures")
    try:
        drawn, worst = report_pictures.draw_all(arguments.out, result, ground, confusion, progress.step)
    finally:
        progress.finish()
    story = run_story.of(result)
    title = f"{Path(metrics['log']).name} on {path_map.parent.name}/{path_map.name}, seed {result.seed}"
    report_page.write(arguments.out / "report.html", title, story, drawn, worst, metrics)
    print(f"{story.headline}. {' '.join(story.sentences)}")
    print(f"written to {arguments.out / 'report.html'}")


def _is_results(path: Path) -> bool:
    """Whether the path is a folder of results; a ROS 2 bag is a folder too, with other files."""
    return path.is_dir() and not (path / "metadata.yaml").exists()


def _options(arguments: argparse.Namespace) -> ReplayOptions:
    return ReplayOptions(
        (arguments.run,),
        Path() if arguments.map is None else arguments.map,  # results know their map
        arguments.params,
        arguments.seed,
        log_arguments.log_use(arguments),
    )


def _glass(folder: Path, shape: "tuple[int, ...]") -> Optional[np.ndarray]:
    """(H, W) probability of glass of each wall cell after that run; None if unknown, or of another map."""
    if not (folder / "glass_map.yaml").exists():
        return None
    glass = map_file.load(folder / "glass_map.yaml").occupancy
    if glass.shape != shape:
        raise ValueError(
            f"{folder}: its glass map has {glass.shape[1]} x {glass.shape[0]} cells, the map {shape[1]} x "
            f"{shape[0]}: it is of another map"
        )
    return glass
