"""`catkin_make install` gives a package that works without the checkout: every file, every program."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import Set

import pytest

REPO = Path(__file__).parents[2]
WORKSPACE = REPO / ".build" / "ws"
SHELL = {"setup", "demo", "test"}  # programs of the checkout
PROGRAMS = sorted(path.name for path in (REPO / "scripts").iterdir() if path.is_file() and path.name not in SHELL)

pytestmark = [
    pytest.mark.xdist_group("one_at_a_time"),  # not while a rostest's nodes start from this workspace
    pytest.mark.skipif(not (WORKSPACE / "build").exists(), reason="no catkin workspace: run by scripts/test"),
]


@pytest.fixture(scope="module")
def install() -> Path:
    """The install space, made anew; `make install` is what catkin_make install calls."""
    shutil.rmtree(WORKSPACE / "install", ignore_errors=True)
    done = subprocess.run(
        ["make", "-C", str(WORKSPACE / "build"), "install"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert done.returncode == 0, done.stdout
    return WORKSPACE / "install"


def in_install_space(install: Path, command: str, cwd: Path) -> "subprocess.CompletedProcess[str]":
    """A command of a shell that knows the install space only."""
    ros = next(Path("/opt/ros").glob("*/share/catkin"), None)  # ROS 1
    before = "" if ros is None else f"source {ros.parents[1]}/setup.bash; "
    return subprocess.run(
        ["/bin/bash", "-c", f"{before}source '{install}/setup.bash'; {command}"],
        cwd=cwd,
        env={"PATH": "/usr/bin:/bin", "HOME": str(cwd), "ROS_HOME": str(cwd / "ros")},
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


def python_folder(install: Path) -> Path:
    (folder,) = (install / "lib").glob("python3*/*-packages/glass_nav")
    return folder


def files(folder: Path, pattern: str = "*") -> Set[str]:
    return {
        str(path.relative_to(folder))
        for path in folder.rglob(pattern)
        if path.is_file() and "__pycache__" not in path.parts
    }


def test_rospack_finds_the_package(install: Path, tmp_path: Path) -> None:
    found = in_install_space(install, "rospack find glass_nav", tmp_path)
    assert found.stdout.strip() == str(install / "share" / "glass_nav")


@pytest.mark.parametrize("folder", ["atlas", "config", "launch", "maps", "msg", "rviz"])
def test_data_files_are_installed(install: Path, folder: str) -> None:
    assert files(REPO / folder) <= files(install / "share" / "glass_nav" / folder)


def test_every_python_module_is_installed(install: Path) -> None:
    assert files(REPO / "src" / "glass_nav", "*.py") <= files(python_folder(install), "*.py")


def test_the_templates_of_the_pages_are_installed(install: Path) -> None:
    pages = Path("evaluation") / "pages" / "templates"
    assert files(REPO / "src" / "glass_nav" / pages) == files(python_folder(install) / pages) != set()


def test_nothing_of_the_tests_or_the_build_is_installed(install: Path) -> None:
    assert not [path for path in files(install) if path.startswith("test") or ".build" in path or "_rostest" in path]


@pytest.mark.parametrize(
    "module",
    [
        "glass_nav._beam_vote",
        "glass_nav._distance_field",
        "glass_nav._grid",
        "glass_nav._integrity",
        "glass_nav._mrpt_io",
        "glass_nav._mrpt_rays",
        "glass_nav._particles",
        "glass_nav._poses",
        "glass_nav.msg",
        "glass_nav.srv",
    ],
)
def test_compiled_modules_and_messages_come_from_the_install_space(install: Path, tmp_path: Path, module: str) -> None:
    done = in_install_space(install, f"/usr/bin/python3 -c 'import {module} as m; print(m.__file__)'", tmp_path)
    assert done.stdout.startswith(str(python_folder(install))), done.stdout


@pytest.mark.parametrize("program", PROGRAMS)
def test_programs_start_with_the_python_that_has_rospy(install: Path, program: str) -> None:
    installed = install / "lib" / "glass_nav" / program
    assert os.access(installed, os.X_OK)
    assert installed.read_text().splitlines()[0] == "#!/usr/bin/python3"


def test_rosrun_starts_the_command_line_tool(install: Path, tmp_path: Path) -> None:
    done = in_install_space(install, "rosrun glass_nav glass_nav --help", tmp_path)
    assert done.returncode == 0, done.stdout
    assert "replay" in done.stdout


def test_the_installed_buildings_are_found_by_name(install: Path, tmp_path: Path) -> None:
    code = 'from glass_nav.simulation import shipped_buildings as s; print(s.shipped()["glass_office"])'
    done = in_install_space(install, f"/usr/bin/python3 -c '{code}'", tmp_path)
    assert done.stdout.strip() == str(install / "share" / "glass_nav" / "maps" / "glass_office" / "building.yaml")
