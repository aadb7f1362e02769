"""glass_nav params: translates the parameters of a launch file written for amcl. No roscore."""

from __future__ import annotations

import argparse
from typing import Optional

from glass_nav.cli import ros_process

HELP = "translate the parameters of a launch file that starts amcl"
DESCRIPTION = """Reads a launch file that starts amcl, as roslaunch does (includes, args, groups, rosparam files), and
prints the parameters of localization_node as yaml, for rosparam and for glass_nav replay --params. Comments list the parameters
that have no effect here, and why. Needs the Python of ROS, but no roscore."""
EXAMPLES = (
    "glass_nav params --from-amcl amcl.launch > mine.yaml",
    "glass_nav params --from-amcl robot.launch --node amcl map_file:=floor.yaml",
)
READER = "glass_nav.ros.tools.amcl_launch"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument("--from-amcl", required=True, metavar="FILE.launch", help="launch file that starts amcl")
    parser.add_argument("--node", metavar="NAME", help="of the node, where the file starts several")
    parser.add_argument("arguments", nargs="*", metavar="ARG:=VALUE", help="args of the launch file")


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    wrong = [argument for argument in arguments.arguments if ":=" not in argument]
    return f"args of the launch file are given as ARG:=VALUE, got {wrong[0]!r}" if wrong else None


def main(arguments: argparse.Namespace) -> None:
    """Print the parameters.

    Raises:
        ValueError: the file cannot be used; one line.
    """
    node = [] if arguments.node is None else ["--node", arguments.node]
    ros_process.run(READER, [arguments.from_amcl, *arguments.arguments, *node], "glass_nav params")
