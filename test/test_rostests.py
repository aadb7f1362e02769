"""Every test/rostest/*.test with a ROS master of its own: rostest starts each on a free port.

What they test, and how, is in test/rostest; this file starts them and counts what ran.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import rostest_file

REPO = Path(__file__).parents[1]
ROSTESTS = sorted((REPO / "test" / "rostest").glob("*.test"))

pytestmark = [
    pytest.mark.xdist_group("one_at_a_time"),  # each keeps up with a clock
    pytest.mark.skipif("ROS_PACKAGE_PATH" not in os.environ, reason="no ROS environment: run by scripts/test"),
]


@pytest.mark.parametrize("path", ROSTESTS, ids=[path.stem for path in ROSTESTS])
def test_rostest(path: Path, tmp_path: Path) -> None:
    rostest_file.run(path, tmp_path)


def test_there_are_rostests() -> None:
    assert ROSTESTS
