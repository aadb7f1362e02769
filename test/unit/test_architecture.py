"""The rooms of the package: who may import whom, and that every file parses on Python 3.8."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Iterator

import pytest

REPO = Path(__file__).parents[2]
PACKAGE = REPO / "src" / "glass_nav"

MAY_IMPORT = {
    "geometry": "",
    "world": "geometry",
    "sensing": "geometry world",
    "localization": "geometry world sensing",
    "topology": "geometry world sensing",
    "driving": "geometry world sensing localization topology",
    "recording": "geometry world sensing",
    "simulation": "geometry world sensing",
    "checkup": "geometry world sensing localization recording",
    "evaluation": "geometry",
    "cli": "geometry world sensing localization topology driving recording simulation evaluation checkup",
    "ros": "geometry world sensing localization topology driving recording simulation evaluation checkup",
}
FOR_ALL = {"amcl_parameters", "params"}  # modules of no room
ONLY_BY = {  # compiled modules, each behind its face; and what is heavy, where it is needed
    "glass_nav._beam_vote": "localization",
    "glass_nav._mrpt_grid": "sensing",
    "glass_nav._mrpt_io": "recording world",
    "distributed": "cli",
    "joblib": "cli",
    "matplotlib": "evaluation",
    "rosbags": "recording",
}
MIDDLEWARE = {"actionlib", "diagnostic_updater", "dynamic_reconfigure", "genpy", "message_filters", "rosbag",
              "rosgraph", "roslib", "rosparam", "rospy", "rostopic", "std_srvs", "tf", "tf2_geometry_msgs",
              "tf2_py", "tf2_ros"}


def imported(source: str) -> Iterator[str]:
    """Dotted names of everything a file imports, `from a.b import c` as a.b.c."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "write the whole name: from glass_nav.room import module"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def breaches(room: str, source: str) -> Iterator[str]:
    """Names that a file of this room imports and may not."""
    for name in imported(source):
        top, below = (name + ".").split(".")[:2]
        if (top in MIDDLEWARE or top.endswith("_msgs") or name.startswith("glass_nav.msg")) and room != "ros":
            yield name
        if top == "glass_nav" and below in MAY_IMPORT and below not in [room, *MAY_IMPORT[room].split()]:
            yield name
        for guarded, rooms in ONLY_BY.items():
            if (name + ".").startswith(guarded + ".") and room not in rooms.split():
                yield name


def is_python(path: Path) -> bool:
    if path.suffix:
        return path.suffix == ".py"
    return path.is_file() and path.read_bytes().partition(b"\n")[0].endswith(b"python3")


MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path.parent != PACKAGE)
PYTHON_FILES = sorted(path for folder in ("src", "test", "scripts") for path in (REPO / folder).rglob("*")
                      if is_python(path))


@pytest.mark.parametrize("path", [pytest.param(path, id=str(path.relative_to(PACKAGE))) for path in MODULES])
def test_a_room_imports_only_the_rooms_before_it(path: Path) -> None:
    room = path.relative_to(PACKAGE).parts[0]
    assert room in MAY_IMPORT, f"{room} is no room; add it to MAY_IMPORT and say why in the commit"
    assert not list(breaches(room, path.read_text()))


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("*.py")), ids=lambda path: path.name)
def test_what_has_no_room_imports_no_room(path: Path) -> None:
    assert path.stem in FOR_ALL | {"__init__"}
    ours = [name.split(".")[1] for name in imported(path.read_text()) if name.startswith("glass_nav.")]
    assert set(ours) <= FOR_ALL


@pytest.mark.parametrize("room, source", [
    pytest.param("geometry", "import glass_nav.world.grid_map", id="a later room"),
    pytest.param("world", "from glass_nav import sensing", id="a later room, by from"),
    pytest.param("localization", "def f():\n    import rospy", id="ROS, inside a function"),
    pytest.param("cli", "from sensor_msgs.msg import LaserScan", id="messages"),
    pytest.param("recording", "from glass_nav.msg import BeamCases", id="our messages"),
    pytest.param("localization", "from glass_nav import _mrpt_grid", id="a compiled module, past its face"),
    pytest.param("cli", "from rosbags.rosbag1 import Reader", id="rosbags outside recording"),
])
def test_the_rule_sees_a_breach(room: str, source: str) -> None:
    assert list(breaches(room, source))


@pytest.mark.parametrize("path", [pytest.param(path, id=str(path.relative_to(REPO))) for path in PYTHON_FILES])
def test_every_file_parses_on_python_38(path: Path) -> None:
    ast.parse(path.read_text(), feature_version=(3, 8))
