"""What the documents say is true: links, paths, parameters, and commands, which are run where no robot is needed.

The info string of a fence says what becomes of its commands:

    bash         run as they stand, in one folder for all pages, in the order of PAGES; a log is cut to its first scans
    bash robot   need a roscore, a robot or files of the reader: options, launch files and messages are checked
    bash bench   take minutes, or logs that do not ship: script and options are checked
    bash setup   install or build: the scripts of this repository that they name are checked
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple

import parameters_page
import pytest
import yaml

import glass_nav.params
from glass_nav.cli import atlas, compare, doctor, landmarks, locate, maps, params, replay, report, simulate
from glass_nav.cli.parser import CommandParser

REPO = Path(__file__).parents[2]
FIRST = [REPO / name for name in ("README.md", "doc/quickstart.md", "doc/replay.md")]  # their commands make the logs
PAGES = [
    *FIRST,
    *sorted(set((REPO / "doc").glob("*.md")) - set(FIRST)),
    *(REPO / name for name in ("maps/README.md", "atlas/README.md", "CONTRIBUTING.md")),
]
MAX_README_LINES = 150
MAX_PICTURE_BYTES = 150_000
MAX_SCANS = "30"  # of each log that a command replays
FIRST_COMMANDS = (  # of the quickstart: their files are there for every page
    "glass_nav simulate glass_office --path first --out run.bag",
    "glass_nav replay run.bag --map run.map.yaml --out results/",
    "glass_nav params --from-amcl my_robot.launch > mine.yaml",
)
SUBCOMMANDS = {
    "atlas": atlas,
    "compare": compare,
    "doctor": doctor,
    "landmarks": landmarks,
    "locate": locate,
    "map": maps,
    "params": params,
    "replay": replay,
    "report": report,
    "simulate": simulate,
}
SETUP_WORDS = {
    "catkin_make",
    "cd",
    "ln",
    "pip",
    "rosdep",
    "scripts/demo",
    "scripts/setup",
    "scripts/test",
    "sed",
    "source",
}
FOLDERS = sorted(path.name for path in REPO.iterdir() if path.is_dir() and path.name not in (".git", ".build"))
FILES = [str(path.relative_to(REPO)) for name in FOLDERS for path in (REPO / name).rglob("*") if path.is_file()]
ROOMS = sorted(path.parent.name for path in (REPO / "src" / "glass_nav").glob("*/__init__.py"))
_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
_PATH = re.compile(rf"(?<![\w/.~-])(?:{'|'.join(re.escape(name) for name in FOLDERS)})/[\w./*-]*[\w*]")
_MODULE = re.compile(r"`([\w/]+\.(?:py|cpp|hpp|launch|test))`")

pytestmark = pytest.mark.xdist_group("documents")  # the commands of a page find the files of the page before
every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPO)))


class Fence(NamedTuple):
    """A block of code in a page."""

    info: str
    text: str


def fences(page: Path) -> List[Fence]:
    found = re.findall(r"^```([^\n]*)\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    return [Fence(info.strip(), text) for info, text in found]


def prose(page: Path) -> str:
    return re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def commands(page: Path, info: str) -> Iterator[str]:
    for fence in fences(page):
        if fence.info == info:
            yield from (line.partition("  #")[0].strip() for line in fence.text.splitlines() if line.strip())


def anchors(page: Path) -> List[str]:
    headings = re.findall(r"^#+ (.+)$", prose(page), re.MULTILINE)
    return [re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings]


def test_the_readme_is_one_page() -> None:
    assert len((REPO / "README.md").read_text(encoding="utf-8").splitlines()) <= MAX_README_LINES


def test_the_parameters_page_is_what_the_structs_say() -> None:
    written = (REPO / "doc" / "parameters.md").read_text(encoding="utf-8")
    assert written == parameters_page.page(), "run python test/support/parameters_page.py"


def test_every_parameter_is_explained() -> None:
    rows = [row.split(" | ") for row in parameters_page.page().splitlines() if row.startswith("| `")]
    assert [row[0] for row in rows if not row[4].strip(" |")] == []


@every_page
def test_parameters_that_a_page_sets_exist_and_may_have_that_value(page: Path) -> None:
    structs = [struct for struct, _ in parameters_page.NODES.values()]
    for name, value in re.findall(r"`([a-z]+(?:_[a-z0-9]+)+): ([^`{}]+)`", prose(page)):
        takers = [struct for struct in structs if name in glass_nav.params.names(struct)]
        assert takers, f"{page.name}: no node has ~{name}"
        faults = [glass_nav.params.type_fault(struct, name, yaml.safe_load(value)) for struct in takers]
        choices = [glass_nav.params.choices(struct).get(name, (value,)) for struct in takers]
        assert "" in faults and any(value in each for each in choices), f"{page.name}: {name}: {value}: {faults}"


def test_the_readme_names_every_program() -> None:
    text = (REPO / "README.md").read_text(encoding="utf-8")
    nodes = [path.name for path in (REPO / "scripts").glob("*_node")]
    assert [node for node in nodes if f"`{node}`" not in text] == []
    modules = [atlas, compare, doctor, landmarks, locate, maps, params, replay, report, simulate]
    words = {"map" if module is maps else module.__name__.rpartition(".")[2] for module in modules}
    assert [word for word in sorted(words) if not re.search(rf"`(?:glass_nav )?{word}`", text)] == []


@every_page
def test_links_and_anchors_lead_somewhere(page: Path) -> None:
    links = [link for link in _LINK.findall(re.sub(r"`[^`]*`", "", prose(page))) if "://" not in link]
    for link in links:
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.exists(), f"{link} in {page.name}"
        assert not anchor or anchor in anchors(target), f"{link} in {page.name}: {anchors(target)}"


@every_page
def test_paths_of_the_repository_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    named = {path for path in _PATH.findall(re.sub(r"\]\([^)]*\)", "", text)) if not re.search(r"[A-Z]{3}", path)}
    missing = {path for path in named if not (any(REPO.glob(path)) or any(page.parent.glob(path)))}
    assert missing == set()
    assert {
        name for name in _MODULE.findall(text) if not any(f"/{file}".endswith(f"/{name}") for file in FILES)
    } == set()


@pytest.mark.parametrize("page", sorted((REPO / "doc").glob("*.md")), ids=lambda page: page.name)
def test_a_page_has_a_table_or_a_picture(page: Path) -> None:
    assert "|---" in page.read_text(encoding="utf-8") or "![" in page.read_text(encoding="utf-8")


def test_the_architecture_has_every_room() -> None:
    assert [room for room in ROOMS if f"`{room}`" not in (REPO / "doc" / "architecture.md").read_text("utf-8")] == []


def test_pictures_are_small_and_all_of_them_are_shown() -> None:
    shown = {(page.parent / link).resolve() for page in PAGES for link in _LINK.findall(prose(page)) if ".png" in link}
    pictures = set((REPO / "doc" / "pictures").iterdir())
    assert pictures <= shown
    assert {path.name: path.stat().st_size for path in pictures if path.stat().st_size > MAX_PICTURE_BYTES} == {}


@every_page
def test_fences_say_what_they_are(page: Path) -> None:
    known = {"bash", "bash robot", "bash bench", "bash setup", "math", "python", "text", "xml", "yaml"}
    assert {fence.info for fence in fences(page)} <= known
    for fence in fences(page):
        if fence.info == "yaml":
            yaml.safe_load(fence.text)
        elif fence.info == "xml":
            ElementTree.fromstring(f"<launch>{fence.text}</launch>")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the commands are run; the reader's launch file, which starts amcl, is there."""
    path = tmp_path_factory.mktemp("reader")
    shutil.copy(REPO / "test" / "rostest" / "amcl_launch" / "jackal.launch", path / "my_robot.launch")
    for command in FIRST_COMMANDS:
        run(path, command)
    return path


_done: Dict[str, str] = {}  # command -> its output: two pages may begin with the same one


def run(folder: Path, command: str) -> None:
    if command in _done:
        return
    cut = f" --max-scans {MAX_SCANS}" if re.match(r"glass_nav (replay|map panes|compare .*--log)", command) else ""
    done = subprocess.run(
        ["bash", "-c", command.replace(" > ", f"{cut} > ") if " > " in command else command + cut],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}"
    _done[command] = done.stdout


@every_page
def test_commands_that_need_no_robot_run(page: Path, folder: Path) -> None:
    for command in commands(page, "bash"):
        run(folder, command)


@every_page
def test_commands_for_the_robot_are_known_as_written(page: Path) -> None:
    for command in commands(page, "bash robot"):
        check_robot_command(shlex.split(command.replace("$(rospack find glass_nav)", str(REPO))))


@every_page
def test_benchmarks_have_the_options_that_are_given(page: Path) -> None:
    for command in commands(page, "bash bench"):
        program, *words = shlex.split(command)
        if program == "glass_nav":
            check_options(words)
        else:
            source = (REPO / program).read_text(encoding="utf-8")
            assert [word for word in words if word.startswith("--") and f'"{word}"' not in source] == [], command


@every_page
def test_setup_commands_name_programs_that_exist(page: Path) -> None:
    for command in commands(page, "bash setup"):
        for part in command.split("&&"):
            program = part.split()[0]
            assert program in SETUP_WORDS, command
            assert (REPO / program).exists() or "/" not in program, command


def check_robot_command(words: List[str]) -> None:
    program, *rest = words
    if program == "roslaunch":
        check_launch(rest)
    elif program == "rosrun":
        package, node, *arguments = rest
        assert package == "glass_nav" and (REPO / "scripts" / node).exists(), words
        if node == "glass_nav":
            check_options(arguments)
    elif program == "glass_nav":
        check_options(rest)
    elif program == "rostopic":
        check_message(rest)
    else:
        assert words[:2] in (["rosservice", "call"], ["rosbag", "play"], ["python", "test/support/parameters_page.py"])


def check_options(words: List[str]) -> None:
    """The command line is one that the subcommand takes."""
    module = SUBCOMMANDS[words[0]]
    parser = CommandParser(prog=f"glass_nav {words[0]}")
    module.add_arguments(parser)
    assert module.usage_error(parser.parse_args(words[1:])) is None


def check_launch(words: List[str]) -> None:
    """The file loads with these arguments, and has all of them."""
    import roslaunch.arg_dump
    import roslaunch.config
    import roslaunch.xmlloader

    package, name, *arguments = words
    assert package == "glass_nav", words
    path = str(REPO / "launch" / name)
    declared = roslaunch.arg_dump.get_args([path])
    assert {argument.partition(":=")[0] for argument in arguments} <= set(declared), words
    config = roslaunch.config.ROSLaunchConfig()
    roslaunch.xmlloader.XmlLoader(resolve_anon=False).load(path, config, argv=arguments, verbose=False)
    assert config.nodes, words


def check_message(words: List[str]) -> None:
    """A message of that type can be made of the text."""
    import genpy.message
    import roslib.message

    assert words[:2] == ["pub", "-1"], words
    message = roslib.message.get_message_class(words[3])()
    genpy.message.fill_message_args(message, [yaml.safe_load(words[4])])
