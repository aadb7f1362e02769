"""The linters, each as a test: one command runs what CI runs."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest

REPO = Path(__file__).parents[2]
WORKSPACE_PACKAGE = REPO / ".build" / "ws" / "src" / "glass_nav"  # catkin_lint wants the folder named like the package


def run(command: List[str]) -> None:
    done = subprocess.run(
        command,
        cwd=REPO,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "NO_COLOR": "1"},
    )
    if done.returncode:
        print(done.stdout)
        pytest.fail(f"exit code {done.returncode}: {' '.join(command)}", pytrace=False)


def test_ruff() -> None:
    run([sys.executable, "-m", "ruff", "check", "--no-fix", "."])


def test_ruff_format() -> None:
    run([sys.executable, "-m", "ruff", "format", "--check", "."])


def test_mypy() -> None:
    """The types of all but ros/: ROS has none."""
    run(
        [
            sys.executable,
            "-m",
            "mypy",
            "--package",
            "glass_nav",
            "--exclude",
            "/ros/",
            "--cache-dir",
            str(REPO / ".build" / "mypy"),
        ]
    )


@pytest.mark.skipif(not WORKSPACE_PACKAGE.exists(), reason="no catkin workspace: run by scripts/test")
def test_catkin_lint() -> None:
    linter = shutil.which("catkin_lint")
    assert linter, "catkin_lint is not installed: run by scripts/test"
    run(
        [
            linter,
            "-W2",
            "--strict",
            "--ignore",
            "subproject",  # cpp/ is also built alone, for Python 3.8
            str(WORKSPACE_PACKAGE),
        ]
    )


@pytest.mark.parametrize("script", ["scripts/setup", "scripts/demo", "scripts/test", ".ci/run"])
def test_shell_scripts_parse_and_may_be_executed(script: str) -> None:
    assert os.access(REPO / script, os.X_OK)
    run(["/bin/bash", "-n", script])
