"""glass_nav map draw: panes of a file, or given by their ends, drawn into a copy of a map."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import List, Optional

import numpy as np

from glass_nav.cli import pane_files
from glass_nav.world import map_file, panes_file
from glass_nav.world.pane import Pane

HELP = "draw panes into a copy of a map"
DESCRIPTION = """Writes map.yaml with its image (the map with the panes drawn in, everything else unchanged), panes.yaml
and panes.png. Panes are given by a file, by their ends, or both."""
EXAMPLES = (
    "glass_nav map draw floor.yaml --pane 1.2 0.5 4.8 0.5 --pane 4.8 0.5 4.8 3 --out with_glass",
    "glass_nav map draw floor.yaml --panes panes.yaml --out with_glass",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument("map", metavar="MAP", type=Path, help="map_server .yaml, or MRPT .gridmap[.gz]")
    parser.add_argument("--panes", type=Path, metavar="FILE", help="panes.yaml of this map")
    parser.add_argument(
        "--pane",
        type=float,
        nargs=4,
        action="append",
        default=[],
        metavar=("X0", "Y0", "X1", "Y1"),
        help="the two ends of a pane in the map, m; may be repeated",
    )
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for the results")


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    if arguments.panes is None and not arguments.pane:
        return "give --panes FILE or --pane X0 Y0 X1 Y1"
    try:
        _by_hand(arguments)
    except ValueError as err:
        return str(err)
    return None


def main(arguments: argparse.Namespace) -> None:
    """Load, draw, write.

    Raises:
        MapError, PanesFileError, PaneError, OSError: bad input; one line, and nothing is written.
    """
    grid_map = map_file.load(arguments.map)
    panes: List[Pane] = [] if arguments.panes is None else list(panes_file.load(arguments.panes, grid_map).panes)
    panes += _by_hand(arguments)
    written = pane_files.write(arguments.out, arguments.map, grid_map, panes, "panes drawn in")
    length_m = sum(pane.length_m for pane in panes)
    print(f"{pane_files.counted(len(panes))}, {length_m:.1f} m; written: {', '.join(str(path) for path in written)}")


def _by_hand(arguments: argparse.Namespace) -> List[Pane]:
    panes = []
    for x0, y0, x1, y1 in arguments.pane:
        try:
            panes.append(Pane(np.array([x0, y0]), np.array([x1, y1])))
        except ValueError as err:
            raise ValueError(f"--pane {x0:g} {y0:g} {x1:g} {y1:g}: {err}") from err
    return panes
