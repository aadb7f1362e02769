"""The core on Python 3.8 with the numpy and scipy of ROS Noetic, which robots still run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPO = Path(__file__).parents[2]
OLD = REPO / ".build" / "python38"  # made by scripts/setup --dev where the machine has a Python 3.8
PYTHON = OLD / "venv" / "bin" / "python"


@pytest.mark.skipif(sys.version_info[:2] == (3, 8), reason="the whole suite runs on Python 3.8 here")
@pytest.mark.timeout(2400)  # a suite of its own
@pytest.mark.skipif(not PYTHON.exists(), reason="no Python 3.8 on this machine (pyenv, /usr/bin/python3.8)")
def test_unit_tests_pass_on_python_38(tmp_path: Path) -> None:
    # Long runs tell of figures and not of the interpreter; nor do the faults of checkup, and the tests of the command
    # run the same code. The simulator and what compares runs serve on a developer's machine.
    command = [
        str(PYTHON),
        "-m",
        "pytest",
        "test/unit",
        "--ignore=test/unit/ros",
        "--ignore=test/unit/checkup",
        "--ignore=test/unit/compare",
        "--ignore=test/unit/simulation",
        "-q",
        "-m",
        "not long_run",
        "-p",
        "no:cacheprovider",
        f"--basetemp={tmp_path / 'py38'}",
    ]
    environment = {
        name: value for name, value in os.environ.items() if name != "PYTHONPATH" and not name.startswith("COV_CORE")
    }
    environment["PYTHONPATH"] = str(OLD / "site")
    done = subprocess.run(
        command,
        cwd=REPO,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    print(done.stdout[-20000:])
    closing_line = done.stdout.strip().splitlines()[-1]
    if done.returncode or "passed" not in closing_line:
        pytest.fail(f"on Python 3.8: {closing_line}", pytrace=False)
