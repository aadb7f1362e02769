"""glass_nav params: the parameters of a launch file written for amcl, as this package takes them. No roscore."""

from __future__ import annotations

import argparse
import subprocess
import sys
from typing import Optional

HELP = "translate the parameters of a launch file that starts amcl"
DESCRIPTION = """Reads a launch file that starts amcl, as roslaunch does (includes, args, groups, rosparam files), and
prints the parameters of localization_node as yaml, for rosparam and for glass_nav replay --params. Comments say what
has no meaning here, and why. Needs the Python of ROS, but no roscore."""
READER = "glass_nav.ros.amcl_launch"  # a process of its own: nothing outside of ros/ knows ROS


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
    done = subprocess.run([sys.executable, "-m", READER, arguments.from_amcl, *arguments.arguments, *node],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True, check=False)
    if done.returncode:
        raise ValueError(last_line(done.stderr))
    print(done.stdout, end="")


def last_line(errors: str) -> str:
    """What a process said last, without the name of the command, which is said again."""
    lines = [line for line in errors.splitlines() if line.strip()] or ["the reader of launch files failed"]
    if "No module named" in lines[-1]:
        return f"reading launch files needs ROS: {lines[-1]}; source its setup.bash"
    return lines[-1].replace("glass_nav params: ", "", 1)
