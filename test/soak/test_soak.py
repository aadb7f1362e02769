"""The short form of the soak: three simulated minutes of faults. The age of tf is the machine's and is not judged, and
memory is still being filled for the first time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPO = Path(__file__).parents[2]
TIMEOUT_S = 300.0


@pytest.mark.xdist_group("one_at_a_time")
@pytest.mark.skipif("ROS_PACKAGE_PATH" not in os.environ, reason="no ROS environment: run by scripts/test")
def test_the_node_lasts_through_three_minutes_of_faults() -> None:
    done = subprocess.run(
        [
            sys.executable,
            str(REPO / "test" / "benchmark" / "soak.py"),
            "--minutes",
            "3",
            "--memory-bar",
            "1.25",
            "--any-age",
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=TIMEOUT_S,
    )
    print(done.stdout[-3000:])
    assert done.returncode == 0, "a bar is missed, see above"
