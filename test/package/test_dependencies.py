"""What package.xml names can be installed: by rosdep, by scripts/setup, and in the container of doc/Dockerfile."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

REPO = Path(__file__).parents[2]

# Looked up in rosdep/base.yaml, rosdep/python.yaml and noetic/distribution.yaml of ros/rosdistro at 8468e88ccd
# (2026-08-22). Look up a new key there before you add it here.
ROSDEP_KEYS = {
    "mrpt": "libmrpt-dev",  # of Debian and Ubuntu
    "pybind11-dev": "pybind11-dev",
    **{
        f"python3-{name}": f"python3-{name}"
        for name in (
            "argcomplete jinja2 jsonschema matplotlib numpy pil pytest rospkg-modules scipy setuptools yaml".split()
        )
    },
}
NOETIC_PACKAGES = set(
    "actionlib actionlib_msgs catkin diagnostic_msgs diagnostic_updater dynamic_reconfigure geometry_msgs "
    "message_generation message_runtime move_base_msgs mrpt_libmaps nav_msgs rosbag rosgraph_msgs rospy rostest rostopic "
    "rviz sensor_msgs std_msgs std_srvs tf2_msgs tf2_ros visualization_msgs".split()
)


def keys() -> "set[str]":
    return {entry.text or "" for entry in ElementTree.parse(REPO / "package.xml").getroot() if "depend" in entry.tag}


def test_rosdep_knows_every_key() -> None:
    assert keys() <= NOETIC_PACKAGES | set(ROSDEP_KEYS)


def test_setup_installs_what_rosdep_would() -> None:
    script = (REPO / "scripts" / "setup").read_text(encoding="utf-8")
    needed = {package for key, package in ROSDEP_KEYS.items() if key in keys() and key.startswith("python3-")}
    assert {package for package in needed if not re.search(rf"\b{package}\b", script)} == {"python3-rospkg-modules"}


def test_the_container_recipe_runs_scripts_that_exist() -> None:
    """What hadolint (test/lint) cannot see; test/platforms/cases runs the recipe's commands."""
    scripts = re.findall(r"scripts/\w+", (REPO / "doc" / "Dockerfile").read_text(encoding="utf-8"))
    assert len(scripts) >= 2 and all((REPO / script).is_file() for script in scripts)
