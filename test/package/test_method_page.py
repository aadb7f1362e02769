"""doc/method.md names the function of each equation and table of the four documents: they are all there."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any, List

import pytest

PAGE = (Path(__file__).parents[2] / "doc" / "method.md").read_text(encoding="utf-8")
SECTION = PAGE[PAGE.index("## Each equation and table") :]
NAMES = sorted(set(re.findall(r"`(glass_nav(?:\.\w+)+)`", SECTION)))
NUMBERED = {"Glass": range(1, 6), "Bearings": range(1, 10)}


def rows(document: str) -> List[str]:
    """What is said of a document, row by row."""
    found: List[str] = []
    current = ""
    for line in SECTION.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("|") and len(cells) == 3:
            current = cells[0] or current
            if current == document:
                found.append(line)
    return found


def named(path: str) -> Any:
    """The object of a dotted name: the longest module of it, then its attributes."""
    parts = path.split(".")
    for length in range(len(parts), 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[length:]:
            found = getattr(found, attribute)
        return found
    raise ModuleNotFoundError(path)


@pytest.mark.parametrize("name", NAMES)
def test_each_function_is_there_and_explains_itself(name: str) -> None:
    assert named(name).__doc__


@pytest.mark.parametrize("document", NUMBERED)
def test_every_numbered_equation_has_a_function(document: str) -> None:
    told = {int(number) for row in rows(document) for number in re.findall(r"\((\d)\)", row)}
    assert told >= set(NUMBERED[document])
    assert all("`glass_nav." in row for row in rows(document))


def test_both_tables_and_every_document_have_rows() -> None:
    assert any("Table 1, Table 2" in row for row in rows("Bearings"))
    assert min(len(rows(document)) for document in ("Glass", "Search forest", "Segments", "Bearings")) >= 4


def test_a_name_that_is_not_there_is_not_found() -> None:
    with pytest.raises(AttributeError):
        named("glass_nav.geometry.wheel_steps.nobody")
