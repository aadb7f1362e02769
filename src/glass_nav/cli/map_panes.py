"""glass_nav map panes: finds the panes that a map lacks in recorded drives, and draws them in."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import List, Optional

from glass_nav.cli import log_arguments, pane_files
from glass_nav.cli.progress import Progress
from glass_nav.replay import prepared_replay, replay_params
from glass_nav.replay.replay_options import ReplayOptions
from glass_nav.replay.replay_panes import PaneSearch
from glass_nav.replay.replay_params import ReplayParams
from glass_nav.world import map_file
from glass_nav.world.pane import Pane

HELP = "find the panes that a map lacks in recorded drives"
DESCRIPTION = """Runs the localization on recorded logs and finds panes of glass that the map lacks: beams return from them
only near their normal, and pass at other angles. Writes map.yaml with its image (the map with the panes drawn in, everything
else unchanged), panes.yaml and panes.png, and prints a table of all candidates."""
EXAMPLES = (
    "glass_nav map panes run.bag --map floor.yaml --out with_glass",
    "glass_nav map panes monday.bag tuesday.bag --map floor.yaml --drop 2 --out with_glass",
)
_LISTED = 0.05  # less probable candidates are not worth a line


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "log",
        metavar="LOG",
        type=Path,
        nargs="+",
        help="bag of ROS 1 or ROS 2, or MRPT .rawlog; several: drives on the same map, each with its own start",
    )
    parser.add_argument("--map", required=True, type=Path, help="map_server .yaml, or MRPT .gridmap[.gz]")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for the results")
    parser.add_argument(
        "--least-probability",
        type=float,
        default=0.9,
        metavar="P",
        help="panes that are less probable are not drawn (default 0.9)",
    )
    chosen = parser.add_mutually_exclusive_group()
    chosen.add_argument("--keep", metavar="N,N", help="draw only these panes, by number in the table")
    chosen.add_argument("--drop", metavar="N,N", help="do not draw these panes")
    log_arguments.add_run_arguments(parser)
    log_arguments.add_log_arguments(parser)


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    if not 0.0 <= arguments.least_probability <= 1.0:
        return f"--least-probability must be in [0, 1], got {arguments.least_probability}"
    try:
        _options(arguments)
        _numbers("--keep", arguments.keep)
        _numbers("--drop", arguments.drop)
    except ValueError as err:
        return str(err)
    return None


def main(arguments: argparse.Namespace) -> None:
    """Replay, find, draw, write.

    Raises:
        RecordingError, MapError, ParamError, NoUsablePose, ValueError, OSError: bad input; one line, and nothing is
            written.
    """
    grid_map = map_file.load(arguments.map)
    pane_files.check_folder(arguments.out)
    settings = ReplayParams() if arguments.params is None else replay_params.load(arguments.params)[0]
    search = PaneSearch(grid_map, settings.localizer.panes)
    for options in _options(arguments):
        _replay(options, search)
    candidates = [pane for pane in search.panes() if pane.probability >= _LISTED]
    drawn = _chosen(arguments, candidates)
    print("\n".join(pane_files.table(candidates, drawn)))
    chosen = [candidates[number - 1] for number in drawn]
    written = pane_files.write(arguments.out, arguments.map, grid_map, chosen, "panes that the map lacks", candidates)
    print(f"written: {', '.join(str(path) for path in written)}")


def _options(arguments: argparse.Namespace) -> List[ReplayOptions]:
    first = ReplayOptions(
        (arguments.log[0],), arguments.map, arguments.params, arguments.seed, log_arguments.log_use(arguments)
    )
    return [replace(first, log=(log,)) for log in arguments.log]


def _replay(options: ReplayOptions, search: PaneSearch) -> None:
    ready = prepared_replay.prepare(options)
    for note in ready.notes:
        print(f"glass_nav map panes: {note}", file=sys.stderr)
    progress = Progress(ready.recording.name, ready.expected_scans)
    try:
        search.add(ready, progress.step)
    finally:
        progress.finish()


def _chosen(arguments: argparse.Namespace, candidates: List[Pane]) -> List[int]:
    """Numbers, from 1, of the panes to draw."""
    keep, drop = _numbers("--keep", arguments.keep), _numbers("--drop", arguments.drop)
    for number in keep + drop:
        if number > len(candidates):
            raise ValueError(f"there is no pane {number}: {len(candidates)} were found")
    probable = [
        number
        for number, pane in enumerate(candidates, start=1)
        if pane.probability >= arguments.least_probability and number not in drop
    ]
    return keep or probable


def _numbers(option: str, text: Optional[str]) -> List[int]:
    """1,3 -> [1, 3].

    Raises:
        ValueError: no list of whole numbers from 1 on.
    """
    if text is None:
        return []
    words = text.split(",")
    if not all(word.strip().isdigit() and int(word) > 0 for word in words):
        raise ValueError(f"{option} must be whole numbers from 1 on, such as 1,3, got {text!r}")
    return [int(word) for word in words]
