"""glass_nav map: commands for glass that a map lacks, a module for each."""

from __future__ import annotations

import argparse
from typing import Any, Dict, Optional

from glass_nav.cli import map_draw, map_panes, map_show
from glass_nav.cli.parser import add_commands

HELP = "find the glass that a map lacks, and draw it in"
DESCRIPTION = """Mappers erase panes because beams pass them. These commands find the missing panes in recorded
drives, draw them into a copy of the map, and show the result. Needs no roscore."""
EXAMPLES = (
    "glass_nav map panes run.bag --map floor.yaml --out with_glass",
    "glass_nav map draw floor.yaml --pane 1.2 0.5 4.8 0.5 --out with_glass",
)

MODULES: Dict[str, Any] = {"panes": map_panes, "draw": map_draw, "show": map_show}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A subcommand for each module."""
    add_commands(parser, "map_command", "COMMAND", MODULES)


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options of the subcommand."""
    wrong: Optional[str] = MODULES[arguments.map_command].usage_error(arguments)
    return wrong and f"{arguments.map_command}: {wrong}"


def main(arguments: argparse.Namespace) -> None:
    """Run the subcommand."""
    MODULES[arguments.map_command].main(arguments)
