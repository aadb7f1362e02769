"""The packages of glass_nav: which may import which, that ros/ decides nothing, that every file parses on Python 3.8."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Iterator

import pytest

from glass_nav.vocabulary import DriverPhase, Outcome, SearchState

REPO = Path(__file__).parents[2]
PACKAGE = REPO / "src" / "glass_nav"

MAY_IMPORT = {  # a package, or a subpackage of one where the subpackage may import more or less than the package
    "geometry": "",
    "world": "geometry",
    "sensing": "geometry world",
    "panes": "geometry world sensing",
    "hypotheses": "geometry world sensing",
    "localization": "geometry world sensing hypotheses panes",
    "localization/beam_classification": "geometry world sensing panes",
    "localization/particle_filter": "geometry world sensing hypotheses localization/beam_classification",
    "localization/integrity": "geometry world sensing hypotheses localization/particle_filter",
    "localization/segments": "geometry world sensing localization/beam_classification localization/particle_filter",
    "localization/bearings": "geometry world sensing",
    "topology": "geometry world sensing hypotheses",
    "topology/atlas": "geometry world sensing",
    "topology/atlas/voronoi": "geometry world topology/atlas/components",
    "topology/search": "geometry world sensing hypotheses topology/atlas topology/observations",
    "driving": "geometry world sensing hypotheses localization topology",
    "recording": "geometry world sensing",
    "simulation": "geometry world sensing",
    "interop": "geometry world sensing",
    "checkup": "geometry world sensing panes hypotheses localization recording",
    "evaluation": "geometry world",
    "evaluation/metrics": "geometry",
    "evaluation/plots": "geometry world evaluation/metrics",
    "evaluation/pages": "geometry evaluation/metrics evaluation/plots",
    "replay": "geometry world sensing panes hypotheses localization topology driving recording evaluation",
    "compare": "geometry world sensing panes hypotheses localization topology driving recording evaluation replay",
    "demo": "geometry world sensing hypotheses localization topology driving recording simulation evaluation",
    "cli": "geometry world sensing panes hypotheses localization topology driving recording simulation evaluation checkup "
    "replay compare",
    "ros": "geometry world sensing panes hypotheses localization topology driving recording simulation evaluation checkup "
    "demo",
}
# modules of no package
FOR_ALL = {
    "amcl_parameters",
    "health",
    "log_line",
    "machine",
    "package_files",
    "params",
    "rate_limiter",
    "shapes",
    "vocabulary",
}
ONLY_BY = {  # compiled modules, each behind its face; and what is heavy, where it is needed
    "glass_nav._beam_vote": "localization",
    "glass_nav._integrity": "localization",
    "glass_nav._particles": "localization",
    "glass_nav._poses": "geometry",
    "glass_nav._distance_field": "hypotheses sensing",
    "glass_nav._grid": "hypotheses sensing",
    "glass_nav._mrpt_io": "recording world",
    "glass_nav._mrpt_rays": "sensing",
    "dask": "compare",
    "distributed": "compare",
    "jinja2": "evaluation",
    "matplotlib": "evaluation",
    "rosbags": "recording",
}
MIDDLEWARE = {
    "actionlib",
    "diagnostic_updater",
    "dynamic_reconfigure",
    "genpy",
    "message_filters",
    "rosbag",
    "rosgraph",
    "roslib",
    "rosparam",
    "rospy",
    "rostopic",
    "std_srvs",
    "tf",
    "tf2_geometry_msgs",
    "tf2_py",
    "tf2_ros",
}
STATES = {member.name for words in (SearchState, DriverPhase, Outcome) for member in words}
STATE_OWNERS = {  # the enums, and the messages that have constants of the same names
    "SearchState",
    "DriverPhase",
    "Outcome",
    "GoalOutcome",
    "TopologyStatus",
    "DriverStatus",
    "GotoNodeResult",
    "TraverseEdgeResult",
}


def imported(source: str) -> Iterator[str]:
    """Dotted names of everything a file imports, `from a.b import c` as a.b.c."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "write the whole name: from glass_nav.package import module"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def package_of(module: str) -> str:
    """The narrowest package of MAY_IMPORT that holds a module, as "topology/search"; "" if none does."""
    parts = module.split("/")
    places = ["/".join(parts[:count]) for count in range(len(parts), 0, -1)]
    return next((place for place in places if place in MAY_IMPORT), "")


def may_import(package: str, module: str) -> bool:
    """Whether files of a package may import a module: a package calls its subpackages, a subpackage not its package."""
    return any((module + "/").startswith(place + "/") for place in [package, *MAY_IMPORT[package].split()])


def breaches(package: str, source: str) -> Iterator[str]:
    """Names that a file of this package imports and may not."""
    top_package = package.split("/")[0]
    for name in imported(source):
        top, below = (name + ".").split(".")[:2]
        if (top in MIDDLEWARE or top.endswith("_msgs") or name.startswith("glass_nav.msg")) and top_package != "ros":
            yield name
        module = name[len("glass_nav.") :].replace(".", "/")
        if top == "glass_nav" and below in MAY_IMPORT and not may_import(package, module):
            yield name
        for guarded, packages in ONLY_BY.items():
            if (name + ".").startswith(guarded + ".") and top_package not in packages.split():
                yield name


def state_names(node: ast.AST) -> Iterator[str]:
    """Members of the state enums, constants of their messages, and strings of those names, anywhere below a node."""
    for part in ast.walk(node):
        if isinstance(part, ast.Attribute) and isinstance(part.value, (ast.Attribute, ast.Name)):
            owner = part.value.attr if isinstance(part.value, ast.Attribute) else part.value.id
            if owner in STATE_OWNERS and part.attr in STATES:
                yield f"{owner}.{part.attr}"
        elif isinstance(part, ast.Constant) and part.value in STATES:
            yield repr(part.value)


def state_branches(source: str) -> Iterator[str]:
    """Comparisons with a state, or with a name that holds some: `==`, `in` and `is`, wherever they branch."""
    tree = ast.parse(source)
    held = {"SEARCH_IS_OVER"}
    for node in ast.walk(tree):
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value is not None and list(state_names(node.value)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            held |= {target.id for target in targets if isinstance(target, ast.Name)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            names = {name.id for name in ast.walk(node) if isinstance(name, ast.Name)} & held
            yield from (f"line {node.lineno}: {name}" for name in [*state_names(node), *sorted(names)])


def is_python(path: Path) -> bool:
    if path.suffix:
        return path.suffix == ".py"
    return path.is_file() and path.read_bytes().partition(b"\n")[0].endswith(b"python3")


MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path.parent != PACKAGE)
PYTHON_FILES = sorted(
    path for folder in ("src", "test", "scripts") for path in (REPO / folder).rglob("*") if is_python(path)
)


@pytest.mark.parametrize("path", [pytest.param(path, id=str(path.relative_to(PACKAGE))) for path in MODULES])
def test_a_room_imports_only_the_rooms_before_it(path: Path) -> None:
    package = package_of(str(path.relative_to(PACKAGE).parent))
    assert package, f"{path.parent} is no package; add it to MAY_IMPORT and say why in the commit"
    assert not list(breaches(package, path.read_text()))


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("*.py")), ids=lambda path: path.name)
def test_what_has_no_room_imports_no_room(path: Path) -> None:
    assert path.stem in FOR_ALL | {"__init__"}
    ours = [name.split(".")[1] for name in imported(path.read_text()) if name.startswith("glass_nav.")]
    assert set(ours) <= FOR_ALL


@pytest.mark.parametrize(
    "package, source",
    [
        pytest.param("geometry", "import glass_nav.world.grid_map", id="a later package"),
        pytest.param("world", "from glass_nav import sensing", id="a later package, by from"),
        pytest.param(
            "localization/particle_filter",
            "from glass_nav.localization.integrity import kidnap_detector",
            id="a later subpackage",
        ),
        pytest.param(
            "topology/search", "from glass_nav.topology import search_session", id="what calls the subpackage"
        ),
        pytest.param("localization", "def f():\n    import rospy", id="ROS, inside a function"),
        pytest.param("cli", "from sensor_msgs.msg import LaserScan", id="messages"),
        pytest.param("recording", "from glass_nav.msg import BeamCases", id="our messages"),
        pytest.param("localization", "from glass_nav import _grid", id="a compiled module, past its face"),
        pytest.param("cli", "from rosbags.rosbag1 import Reader", id="rosbags outside recording"),
    ],
)
def test_the_rule_sees_a_breach(package: str, source: str) -> None:
    assert list(breaches(package, source))


@pytest.mark.parametrize(
    "path", [pytest.param(path, id=str(path.relative_to(PACKAGE))) for path in sorted((PACKAGE / "ros").rglob("*.py"))]
)
def test_ros_holds_no_state_machine(path: Path) -> None:
    """Search states, driver phases and outcomes are converted there; what follows from them is decided elsewhere."""
    assert not list(state_branches(path.read_text()))


@pytest.mark.parametrize(
    "source",
    [
        pytest.param("if state == SearchState.LOST: stop()", id="equal"),
        pytest.param("x = 1 if phase is vocabulary.DriverPhase.HALTED else 2", id="is, in an expression"),
        pytest.param("while outcome not in (Outcome.BLOCKED, Outcome.NO_WAY): wait()", id="in a tuple"),
        pytest.param("if msg.state != TopologyStatus.WAITING: stop()", id="a constant of the message"),
        pytest.param("if msg.state_name == 'AMBIGUOUS': stop()", id="a string"),
        pytest.param("DONE = (SearchState.LOST,)\nif state in DONE: stop()", id="through a name"),
        pytest.param("if state in SEARCH_IS_OVER: stop()", id="through a name of the vocabulary"),
    ],
)
def test_the_rule_sees_a_state_machine(source: str) -> None:
    assert list(state_branches(source))


@pytest.mark.parametrize(
    "source",
    [
        pytest.param("code = getattr(GotoNodeResult, outcome.name)", id="to the message"),
        pytest.param("state = SearchState(msg.state_name)", id="from the message"),
        pytest.param(
            "end = {Outcome.SUCCEEDED: server.set_succeeded}.get(outcome, server.set_aborted)", id="by a table"
        ),
        pytest.param("if state == LocalizationState.LOST: stop()", id="another enum"),
    ],
)
def test_the_rule_lets_states_be_converted(source: str) -> None:
    assert not list(state_branches(source))


@pytest.mark.parametrize("path", [pytest.param(path, id=str(path.relative_to(REPO))) for path in PYTHON_FILES])
def test_every_file_parses_on_python_38(path: Path) -> None:
    ast.parse(path.read_text(), feature_version=(3, 8))
