"""The .pyi files name what the compiled modules have: nothing more, nothing less, and the same arguments."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path
from typing import Any, Dict, List

import pytest

PACKAGE = Path(__file__).parents[2] / "src" / "glass_nav"
STUBS = sorted(PACKAGE.glob("*.pyi"))
MODULES = sorted(PACKAGE.glob("cpp/*/bindings.cpp"))

Names = Dict[str, Any]  # a function: names of its arguments; a class: Names of its methods


def in_stub(body: List[ast.stmt]) -> Names:
    """What a stub declares; a TypedDict is a plain dict at run time, and no name of the module."""
    found: Names = {}
    for node in body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = [argument.arg for argument in node.args.args]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            found[node.target.id] = ["self"]  # an attribute
        elif isinstance(node, ast.ClassDef) and "TypedDict" not in [getattr(base, "id", "") for base in node.bases]:
            found[node.name] = in_stub(node.body)
    return found


def in_module(owner: Any) -> Names:
    """What a module or class has; pybind11 writes the arguments into the first line of the docstring."""
    found: Names = {}
    for name in dir(owner):
        value = getattr(owner, name)
        if name.startswith("_") and not (name == "__init__" and isinstance(owner, type)):
            continue  # Python's and pybind11's own
        if isinstance(value, type):
            found[name] = in_module(value)
        elif isinstance(value, property):
            found[name] = ["self"]
        else:
            signature = value.__doc__.strip().splitlines()[0]
            arguments = re.findall(r"(\w+): ", signature)
            if arguments or name != "__init__":  # without: the class has no constructor
                found[name] = arguments
    return found


def test_every_compiled_module_has_a_stub() -> None:
    declared = [re.search(r"PYBIND11_MODULE\((\w+),", path.read_text()) for path in MODULES]
    assert sorted(match.group(1) for match in declared) == [path.stem for path in STUBS]


@pytest.mark.parametrize("path", STUBS, ids=lambda path: path.stem)
def test_a_stub_has_the_names_of_its_module(path: Path) -> None:
    module = importlib.import_module(f"glass_nav.{path.stem}")
    assert in_stub(ast.parse(path.read_text()).body) == in_module(module)
