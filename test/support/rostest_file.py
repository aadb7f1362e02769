"""A rostest file with a ROS master of its own: rostest starts it on a free port."""

from __future__ import annotations

import os
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parents[2]
TIMEOUT_S = 600.0  # of one file; the tests in it have shorter ones, and tell more when they fail


def run(path: Path, scratch: Path) -> None:
    """Fail the running test, with what was printed, unless all tests of the file ran and passed."""
    rostest = shutil.which("rostest")
    assert rostest, "rostest is not installed: run by scripts/test"
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(("COV_CORE", "ROS_IP"))}
    environment = {
        **inherited,
        "ROS_HOME": str(scratch / "ros"),
        "ROS_LOG_DIR": str(scratch / "log"),
        "ROS_HOSTNAME": "localhost",
        "ROS_MASTER_URI": "http://localhost:0",
    }
    done = subprocess.run(
        [
            rostest,
            f"--results-base-dir={scratch / 'results'}",
            "--pkgdir",
            str(REPO),
            "--package",
            "glass_nav",
            str(path),
        ],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=TIMEOUT_S,
    )
    suites = [ElementTree.parse(result).getroot() for result in (scratch / "results").rglob("rosunit-*.xml")]
    ran = sum(int(suite.get("tests", 0)) for suite in suites)
    bad = sum(int(suite.get(kind, 0)) for suite in suites for kind in ("failures", "errors"))
    if done.returncode or bad or not ran:
        print("\n".join(text for suite in suites for text in suite.itertext() if text.strip())[-10000:])
        print(done.stdout[-10000:])
        pytest.fail(f"{path.name}: {ran} tests ran, {bad} failed, exit code {done.returncode}", pytrace=False)
    print(f"{path.name}: {ran} tests")
