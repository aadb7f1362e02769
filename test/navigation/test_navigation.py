"""Stock move_base drives the simulated robot, localized by this package and sent by the driver.

They are skipped where move_base is not installed: it is not part of Debian, and on Noetic it is ros-noetic-move-base. Built
from its public source, its workspace goes into ROS_PACKAGE_PATH, CMAKE_PREFIX_PATH and LD_LIBRARY_PATH.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
from pathlib import Path
from types import ModuleType

import pytest
import rostest_file

REPO = Path(__file__).resolve().parents[2]


def _benchmark() -> ModuleType:
    spec = importlib.util.spec_from_file_location("navigation", REPO / "test" / "benchmark" / "navigation.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


NAVIGATION = _benchmark()
MISSING = (
    NAVIGATION.missing_packages(["move_base", "navfn", "dwa_local_planner"]) if shutil.which("rospack") else ["ROS"]
)
pytestmark = [
    pytest.mark.xdist_group("one_at_a_time"),  # it keeps up with a clock
    pytest.mark.long_run,
    pytest.mark.skipif("ROS_PACKAGE_PATH" not in os.environ, reason="no ROS environment: run by scripts/test"),
    pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}"),
]


def test_move_base_reaches_its_goals_and_has_the_glass_in_its_costmap(tmp_path):
    row = NAVIGATION.run(NAVIGATION.STACKS["glass_nav"], "glass_bridge", "weak", 0, 3, 1.0, tmp_path)
    assert row is not None, (tmp_path / "launch.log").read_text()[-5000:]
    assert (row["reached"], row["said"], row["said_wrongly"], row["contacts"]) == (3, 3, 0, 0), row
    assert row["error_mean_m"] < 0.05 and row["glass_near"] >= 0.98, row
    assert row["recoveries"] == 0, row


def test_the_driver_has_move_base_drive_and_notices_what_hangs_or_was_killed(tmp_path):
    rostest_file.run(REPO / "test" / "navigation" / "driver_with_move_base.test", tmp_path)
