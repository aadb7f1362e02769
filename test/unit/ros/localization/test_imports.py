"""What the node loads: a robot has little memory, and much of what the offline tools need is large."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

pytest.importorskip("rospy")

PROGRAM = """
import json, sys
import glass_nav.ros.localization.localization_node
print(json.dumps([name for name in sys.modules]))
"""
HEAVY = {
    "PIL",
    "dask",
    "glass_nav._mrpt_io",
    "glass_nav._mrpt_rays",
    "jinja2",
    "matplotlib",
    "rosbag",
    "rosbags",
    "scipy.interpolate",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
}


def test_the_node_loads_nothing_of_the_offline_tools():
    done = subprocess.run([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True, timeout=60.0, check=True)
    loaded = set(json.loads(done.stdout))
    assert "glass_nav.localization.localizer" in loaded
    assert not HEAVY & loaded
