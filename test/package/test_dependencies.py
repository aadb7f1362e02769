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


def instructions() -> "list[tuple[str, str]]":
    text = (REPO / "doc" / "Dockerfile").read_text(encoding="utf-8")
    lines = re.sub(r"\\\n\s*", "", "\n".join(line for line in text.splitlines() if not line.startswith("#")))
    return [(line.split(" ", 1)[0], line.split(" ", 1)[1]) for line in lines.splitlines() if line.strip()]


def test_the_container_recipe_keeps_the_rules_of_dockerfile_linters() -> None:
    """A version for the image, absolute paths, pipes that fail, no lists of apt left behind, commands that exist."""
    found = instructions()
    assert [name for name, _ in found] == ["FROM", "SHELL", "COPY", "WORKDIR", "RUN", "CMD"]
    given = dict(found)
    assert re.fullmatch(r"debian:\d+", given["FROM"])
    assert "pipefail" in given["SHELL"]
    assert given["COPY"].split()[-1] == given["WORKDIR"] and given["WORKDIR"].startswith("/")
    assert "/var/lib/apt/lists" in given["RUN"] and "sudo" not in given["RUN"] and "cd " not in given["RUN"]
    for script in re.findall(r"scripts/\w+", given["RUN"] + given["CMD"]):
        assert (REPO / script).is_file()
