"""The command glass_nav: finds the subcommand, and turns errors into one line and an exit code."""

from __future__ import annotations

import argparse
import importlib
import sys
import xml.etree.ElementTree as ElementTree
from typing import Any, Dict, List, Optional

from glass_nav import package_files
from glass_nav.cli.parser import CommandParser, add_commands, unknown

EXAMPLES = (
    "glass_nav replay run.bag --map floor.yaml --out results",
    "glass_nav doctor run.bag --map floor.yaml",
)
COMMANDS = {  # and their modules
    "atlas": "atlas",
    "compare": "compare",
    "doctor": "doctor",
    "landmarks": "landmarks",
    "locate": "locate",
    "map": "maps",
    "params": "params",
    "replay": "replay",
    "report": "report",
    "simulate": "simulate",
}
DONE, FAILED, USAGE, BAD_INPUT, INTERRUPTED = 0, 1, 2, 3, 130


def main(argv: Optional[List[str]] = None) -> int:
    """Run a subcommand.

    Args:
        argv: arguments without the program's name; those of the process when not given.

    Returns:
        0 done, 1 done and found wanting (a limit missed, a fault found), 2 wrong usage, 3 bad input (a line on stderr
        says what), 130 interrupted.
    """
    words = sys.argv[1:] if argv is None else argv
    try:
        modules = _modules(words)
    except ImportError as err:
        if not str(err.name).startswith("glass_nav"):
            raise
        print(f"glass_nav: {err.name or err} is missing: build the package and source its setup.bash", file=sys.stderr)
        return BAD_INPUT
    parser = _parser(modules)
    complete(parser)
    if not words:
        parser.print_help()
        return USAGE
    wrong = unknown(words[0], modules, "glass_nav")
    if wrong is None and words[0] in modules and len(words) > 1:
        below = getattr(modules[words[0]], "MODULES", None)
        wrong = below and unknown(words[1], below, f"glass_nav {words[0]}")
    if wrong:
        print(wrong, file=sys.stderr)
        return USAGE
    try:
        arguments = parser.parse_args(words)
    except SystemExit as err:  # argparse has written what is wrong
        return int(err.code or 0)
    return _run(f"glass_nav {arguments.command}", modules[arguments.command], arguments)


def _modules(words: List[str]) -> Dict[str, Any]:
    """The subcommands by name: the one that is called, or all, whose imports take half a second. Each: see replay.py."""
    called = [name for name in words[:1] if name in COMMANDS]
    return {name: importlib.import_module(f"glass_nav.cli.{COMMANDS[name]}") for name in called or COMMANDS}


def complete(parser: argparse.ArgumentParser) -> None:
    """Answer the shell if it asks for completions by tab, and end; argcomplete is optional."""
    try:
        import argcomplete
    except ImportError:
        return
    argcomplete.autocomplete(parser)


def _parser(modules: Dict[str, Any]) -> CommandParser:
    parser = CommandParser(prog="glass_nav", description="Offline tools for localization in buildings with glass.")
    parser.examples = EXAMPLES
    parser.add_argument("--version", action=_Version)
    add_commands(parser, "command", "COMMAND", modules)
    return parser


class _Version(argparse.Action):
    """Prints the version of the package: that of package.xml, which is read only if it is asked for."""

    def __init__(self, option_strings: Any, dest: str, **_: Any) -> None:
        super().__init__(option_strings, dest, nargs=0, help="print the version and exit")

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        version = ElementTree.parse(package_files.package_xml()).findtext("version")
        print(f"{parser.prog} {version}")
        parser.exit()


def _run(program: str, module: Any, arguments: argparse.Namespace) -> int:
    """Runs a subcommand; errors become a line and an exit code."""
    wrong = module.usage_error(arguments)
    if wrong is not None:
        print(f"{program}: {wrong}", file=sys.stderr)
        return USAGE
    try:
        return DONE if module.main(arguments) is not False else FAILED
    except (ValueError, OSError) as err:  # RecordingError, MapError, ParamError and others are ValueErrors
        print(f"{program}: {_one_line(err)}", file=sys.stderr)
        return BAD_INPUT
    except MemoryError:
        print(f"{program}: there is not enough memory for this input", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(f"{program}: interrupted, nothing written", file=sys.stderr)
        return INTERRUPTED


def _one_line(err: Exception) -> str:
    if isinstance(err, OSError) and err.strerror:
        return f"{err.filename}: {err.strerror}" if err.filename else str(err.strerror)
    return " ".join(str(err).split()) or type(err).__name__
