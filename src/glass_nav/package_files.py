"""Finds files that come with the package by name: maps/NAME/..., atlas/NAME/..., in a checkout or installed."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Dict, Iterable, Optional


def folder(name: str, module: Path = Path(__file__)) -> Optional[Path]:
    """A folder of the checkout that a module is part of, or of the share folder beside the lib folder it is in."""
    for above in module.resolve().parents:
        if (above / "package.xml").is_file() and (above / name).is_dir():
            return above / name
        if (above / "share" / "glass_nav" / name).is_dir():
            return above / "share" / "glass_nav" / name
    return None


def package_xml(module: Path = Path(__file__)) -> Path:
    """The manifest of the checkout that a module is part of, or of where it is installed.

    Raises:
        FileNotFoundError: there is none.
    """
    for above in module.resolve().parents:
        for path in (above / "package.xml", above / "share" / "glass_nav" / "package.xml"):
            if path.is_file():
                return path
    raise FileNotFoundError(f"no package.xml belongs to {module}")


def by_name(folder_name: str, *file_names: str) -> Dict[str, Path]:
    """Name of each folder in that folder -> the last of these files that it holds; empty if there is none."""
    above = folder(folder_name)
    if above is None:
        return {}
    return {path.parent.name: path for file in file_names for path in sorted(above.glob(f"*/{file}"))}


def not_found(given: str, what: str, known: Iterable[str]) -> str:
    """The line on something that is neither a file nor one of the known names.

    Args:
        given: what was asked for.
        what: it should be, with its article: "an atlas".
        known: names that come with the package.
    """
    near = difflib.get_close_matches(given, list(known), n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    return f"{given}: no such file, nor {what} of the package, which are {', '.join(known) or 'none'}{hint}"
