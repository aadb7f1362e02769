"""glass_nav atlas: commands for atlases, a module for each. Need no robot."""

from __future__ import annotations

import argparse
from typing import Any, Dict, Optional

from glass_nav.cli import atlas_build, atlas_check, atlas_explain, atlas_show, atlas_wake_up
from glass_nav.cli.parser import add_commands

HELP = "build, check and test an atlas"
DESCRIPTION = """Builds the atlas of a floor from its map, checks it, and tests how well a robot that wakes up there finds
out where it is. Needs no roscore."""
EXAMPLES = (
    "glass_nav atlas build floor.yaml --out atlas/floor",
    "glass_nav atlas show glass_office --out pictures",
)

MODULES: Dict[str, Any] = {
    "build": atlas_build,
    "show": atlas_show,
    "check": atlas_check,
    "explain": atlas_explain,
    "wake-up": atlas_wake_up,
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A subcommand for each module."""
    add_commands(parser, "atlas_command", "COMMAND", MODULES)


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options of the subcommand."""
    wrong: Optional[str] = MODULES[arguments.atlas_command].usage_error(arguments)
    return wrong and f"{arguments.atlas_command}: {wrong}"


def main(arguments: argparse.Namespace) -> None:
    """Run the subcommand."""
    MODULES[arguments.atlas_command].main(arguments)
