"""The command glass_nav: finds the subcommand, and turns errors into one line and an exit code."""

from __future__ import annotations

import argparse
import sys
from typing import Any, Dict, List, Optional

DONE, FAILED, USAGE, BAD_INPUT, INTERRUPTED = 0, 1, 2, 3, 130


def main(argv: Optional[List[str]] = None) -> int:
    """Run a subcommand.

    Args:
        argv: arguments without the program's name; those of the process when not given.

    Returns:
        0 done, 1 done and found wanting (a limit missed, a fault found), 2 wrong usage, 3 bad input (a line on stderr
        says what), 130 interrupted.
    """
    try:
        from glass_nav.cli import atlas, compare, doctor, landmarks, locate, params, replay, report, simulate
    except ImportError as err:
        if not str(err.name).startswith("glass_nav"):
            raise
        print(
            f"glass_nav: {err.name or err} is not there: build the package and source its setup.bash", file=sys.stderr
        )
        return BAD_INPUT
    modules: Dict[str, Any] = {
        "atlas": atlas,
        "compare": compare,
        "doctor": doctor,
        "landmarks": landmarks,
        "locate": locate,
        "params": params,
        "replay": replay,
        "report": report,
        "simulate": simulate,
    }  # each: see replay.py
    parser = argparse.ArgumentParser(prog="glass_nav", description="Localization in buildings of glass: offline tools.")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    commands.required = True  # as an attribute: the argument came with Python 3.7 only for some callers
    for name, module in modules.items():
        module.add_arguments(commands.add_parser(name, help=module.HELP, description=module.DESCRIPTION))
    try:
        arguments = parser.parse_args(argv)
    except SystemExit as err:  # argparse has written what is wrong
        return int(err.code or 0)
    return _run(f"glass_nav {arguments.command}", modules[arguments.command], arguments)


def _run(program: str, module: Any, arguments: argparse.Namespace) -> int:
    """One subcommand, its errors as a line and an exit code."""
    wrong = module.usage_error(arguments)
    if wrong is not None:
        print(f"{program}: {wrong}", file=sys.stderr)
        return USAGE
    try:
        return DONE if module.main(arguments) is not False else FAILED
    except (ValueError, OSError) as err:  # RecordingError, MapError, ParamError and others are ValueErrors
        print(f"{program}: {_one_line(err)}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(f"{program}: interrupted, nothing written", file=sys.stderr)
        return INTERRUPTED


def _one_line(err: Exception) -> str:
    if isinstance(err, OSError) and err.strerror:
        return f"{err.filename}: {err.strerror}" if err.filename else str(err.strerror)
    return " ".join(str(err).split()) or type(err).__name__
