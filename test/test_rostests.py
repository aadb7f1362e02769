"""Every test/rostest/*.test with a ROS master of its own: rostest starts each on a free port.

What they test, and how, is in test/rostest; this file starts them and counts what ran.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

REPO = Path(__file__).parents[1]
ROSTESTS = sorted((REPO / "test" / "rostest").glob("*.test"))
TIMEOUT_S = 600.0  # of one file; the tests in it have shorter ones, and tell more when they fail

pytestmark = [
    pytest.mark.xdist_group("one_at_a_time"),  # each keeps up with a clock
    pytest.mark.skipif("ROS_PACKAGE_PATH" not in os.environ, reason="no ROS environment: run by scripts/test"),
]


@pytest.mark.parametrize("path", ROSTESTS, ids=[path.stem for path in ROSTESTS])
def test_rostest(path: Path, tmp_path: Path) -> None:
    rostest = shutil.which("rostest")
    assert rostest, "rostest is not installed: run by scripts/test"
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(("COV_CORE", "ROS_IP"))}
    environment = {
        **inherited,
        "ROS_HOME": str(tmp_path / "ros"),
        "ROS_LOG_DIR": str(tmp_path / "log"),
        "ROS_HOSTNAME": "localhost",
        "ROS_MASTER_URI": "http://localhost:0",
    }
    done = subprocess.run(
        [
            rostest,
            f"--results-base-dir={tmp_path / 'results'}",
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
    suites = [ElementTree.parse(result).getroot() for result in (tmp_path / "results").rglob("rosunit-*.xml")]
    ran = sum(int(suite.get("tests", 0)) for suite in suites)
    bad = sum(int(suite.get(kind, 0)) for suite in suites for kind in ("failures", "errors"))
    if done.returncode or bad or not ran:
        print("\n".join(text for suite in suites for text in suite.itertext() if text.strip())[-10000:])
        print(done.stdout[-10000:])
        pytest.fail(f"{path.name}: {ran} tests ran, {bad} failed, exit code {done.returncode}", pytrace=False)
    print(f"{path.name}: {ran} tests")


def test_there_are_rostests() -> None:
    assert ROSTESTS
