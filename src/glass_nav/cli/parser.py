"""The parser of glass_nav: examples at the end of each --help, and suggestions for mistyped subcommands."""

from __future__ import annotations

import argparse
import difflib
from typing import Any, Dict, Iterable, Optional, Sequence


class CommandParser(argparse.ArgumentParser):
    """An argparse parser with examples; the parsers of its subcommands are of this class too."""

    examples: Sequence[str] = ()

    def format_help(self) -> str:
        """argparse's help, and the examples."""
        text = super().format_help()
        return text + ("\nexamples:\n" + "".join(f"  {each}\n" for each in self.examples) if self.examples else "")


def add_commands(parser: argparse.ArgumentParser, dest: str, metavar: str, modules: Dict[str, Any]) -> None:
    """A subcommand for each module: its HELP, DESCRIPTION, EXAMPLES and add_arguments()."""
    commands = parser.add_subparsers(dest=dest, metavar=metavar)
    commands.required = True  # as an attribute: the argument came with Python 3.7 only for some callers
    for name, module in modules.items():
        command = commands.add_parser(name, help=module.HELP, description=module.DESCRIPTION)
        give_examples(command, module.EXAMPLES)
        module.add_arguments(command)


class CommandGroup:
    """A command with subcommands, a module for each; its functions are those that such a module has."""

    def __init__(self, dest: str, modules: Dict[str, Any]) -> None:
        """
        Args:
            dest: attribute of the arguments for the name of the subcommand.
            modules: of the subcommands, by name.
        """
        self._dest, self._modules = dest, modules

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """The options of all subcommands."""
        add_commands(parser, self._dest, "COMMAND", self._modules)

    def usage_error(self, arguments: argparse.Namespace) -> Optional[str]:
        """What is wrong with the options of the subcommand, with its name."""
        name = getattr(arguments, self._dest)
        wrong: Optional[str] = self._modules[name].usage_error(arguments)
        return wrong and f"{name}: {wrong}"

    def main(self, arguments: argparse.Namespace) -> None:
        """Run the subcommand."""
        self._modules[getattr(arguments, self._dest)].main(arguments)


def give_examples(parser: argparse.ArgumentParser, examples: Sequence[str]) -> None:
    """Adds examples at the end of the help of a CommandParser."""
    assert isinstance(parser, CommandParser)
    parser.examples = examples


def unknown(given: str, known: Iterable[str], program: str, what: str = "command") -> Optional[str]:
    """The line about a subcommand that does not exist, None if it does; options are argparse's."""
    names = list(known)
    if given.startswith("-") or given in names:
        return None
    near = difflib.get_close_matches(given, names, n=1)
    hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(names)}"
    return f"{program}: unknown {what} {given!r}; {hint}"
