"""glass_nav map show: draws a map with its panes as a picture."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Optional

from glass_nav.evaluation.plots import panes_picture
from glass_nav.world import map_file, panes_file

HELP = "show a map with its panes"
DESCRIPTION = "Writes a PNG of the map with the panes of a file, by number and probability."
EXAMPLES = ("glass_nav map show floor.yaml --panes panes.yaml --out pictures",)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument("map", metavar="MAP", type=Path, help="map_server .yaml, or MRPT .gridmap[.gz]")
    parser.add_argument("--panes", type=Path, metavar="FILE", help="panes.yaml of this map")
    parser.add_argument(
        "--out", required=True, type=Path, metavar="DIR_OR_PNG", help="a folder, or a file that ends with .png"
    )


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """None: any combination of options is valid."""
    return None


def main(arguments: argparse.Namespace) -> None:
    """Load, draw.

    Raises:
        MapError, PanesFileError, OSError: bad input; one line.
    """
    grid_map = map_file.load(arguments.map)
    panes = () if arguments.panes is None else panes_file.load(arguments.panes, grid_map).panes
    name = map_file.name_of(arguments.map)
    path = arguments.out if arguments.out.suffix == ".png" else arguments.out / f"{name}.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    panes_picture.draw(path, grid_map, panes, name)
    print(f"drawn to {path}")
