"""rviz/glass_nav.rviz and launch/rviz.launch: native displays, on topics that exist, all of which can be remapped."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any, Iterator

import yaml

from glass_nav.evaluation.plots import legend
from glass_nav.localization.place_shapes import PLACES_NAMESPACE
from glass_nav.localization.status_text import STATUS_NAMESPACE
from glass_nav.ros import legend as legend_topic
from glass_nav.ros.driver import driver_displays, driver_node
from glass_nav.ros.landmarks import landmarks_node
from glass_nav.ros.localization import localization_node
from glass_nav.ros.topology import topology_displays
from glass_nav.vocabulary import PARTICLE_RGB, POSE_RGB, UNMAPPED_GLASS, BeamCase, WallKind

REPO = Path(__file__).parents[3]
CONFIG = yaml.safe_load((REPO / "rviz" / "glass_nav.rviz").read_text(encoding="utf-8"))
TOPIC_KEYS = ("Topic", "Marker Topic", "Image Topic")


def displays(part: Any = None) -> Iterator[Any]:
    """Every display, those in groups too."""
    for display in CONFIG["Visualization Manager"]["Displays"] if part is None else part:
        yield display
        yield from displays(display.get("Displays", []))


def named(name: str) -> Any:
    (display,) = [display for display in displays() if display["Name"] == name]
    return display


def topics() -> "dict[str, str]":
    """Topic -> display."""
    return {display[key]: display["Name"] for display in displays() for key in TOPIC_KEYS if key in display}


def test_all_displays_and_panels_are_rviz_own():
    for part in [*displays(), *CONFIG["Panels"], *CONFIG["Visualization Manager"]["Tools"]]:
        assert part["Class"].startswith("rviz/"), part


def test_what_is_called_value_is_what_is_enabled():
    for display in displays():
        assert display.get("Value", display["Enabled"]) == display["Enabled"], display["Name"]


def test_every_case_and_the_status_have_a_checkbox():
    names = [*(case.label for case in BeamCase), PLACES_NAMESPACE, STATUS_NAMESPACE]
    assert named("Beams by case")["Namespaces"] == dict.fromkeys(names, True)
    assert named("Glass map")["Namespaces"] == dict.fromkeys([*map(str, WallKind), UNMAPPED_GLASS], True)


def test_the_topology_is_switched_on_and_has_a_checkbox_for_each_thing():
    group = named("Topology")
    assert group["Class"] == "rviz/Group" and group["Enabled"] is True
    assert named("Atlas and search")["Namespaces"] == dict.fromkeys(topology_displays.NAMESPACES, True)


def test_the_driver_is_switched_off_and_has_a_checkbox_for_each_thing():
    assert named("Driver")["Enabled"] is False
    assert named("Local graph and way")["Namespaces"] == dict.fromkeys(driver_displays.NAMESPACES, True)
    assert "/glass_driver/markers" in topics() and "~markers" in driver_node.__doc__


def test_the_displays_of_the_wake_up_are_the_same_and_the_view_is_on_the_map():
    wakeup = yaml.safe_load((REPO / "rviz" / "wakeup.rviz").read_text(encoding="utf-8"))
    view = wakeup["Visualization Manager"]["Views"]["Current"]
    assert view["Target Frame"] == "map"
    view["Target Frame"] = CONFIG["Visualization Manager"]["Views"]["Current"]["Target Frame"]
    assert wakeup == CONFIG


def test_the_topics_of_the_node_are_those_it_tells_of():
    told = localization_node.__doc__
    for topic in topics():
        match = re.fullmatch(r"/glass_localization/(\w+)", topic)
        if match:
            assert f"~{match[1]}" in told, topic
    assert topics()[f"/{legend_topic.TOPIC}"] == "Legend"
    assert "/landmarks/markers" in topics() and "~markers" in landmarks_node.__doc__


def test_every_topic_below_a_node_can_be_remapped_to_another_name():
    launch = ElementTree.parse(REPO / "launch" / "rviz.launch").getroot()
    remaps = {remap.get("from"): remap.get("to") for remap in launch.iter("remap")}
    below = {topic for topic in topics() if topic.count("/") == 2 and not topic.startswith("/move_base")}
    assert {topic for topic in remaps if topic.count("/") == 2} == below
    for origin in below:
        _, node, topic = origin.split("/")
        argument = {
            "glass_localization": "name",
            "glass_topology": "topology_name",
            "glass_driver": "driver_name",
            "landmarks": "landmarks_name",
        }[node]
        assert remaps[origin] == f"/$(arg {argument})/{topic}"
    defaults = {arg.get("name"): arg.get("default") for arg in launch.iter("arg")}
    assert (defaults["name"], defaults["topology_name"]) == ("glass_localization", "glass_topology")
    assert (defaults["landmarks_name"], defaults["driver_name"]) == ("landmarks", "glass_driver")


def test_pose_and_particles_have_the_colours_of_the_legend():
    assert named("Pose")["Color"] == "; ".join(map(str, POSE_RGB))
    assert named("Particles")["Color"] == "; ".join(map(str, PARTICLE_RGB))


def test_the_panel_of_the_legend_has_the_size_of_the_picture():
    """QMainWindow's state: the left column is 0x15e wide; the panel is the picture and its title bar high."""
    state = CONFIG["Window Geometry"]["QMainWindow State"]
    name = "Legend".encode("utf-16-be").hex()
    start = state.index(name) + len(name) + 2  # visible
    height = int(state[start + 8 : start + 16], 16)
    assert "0000015e" in state and int("15e", 16) == legend.WIDTH
    assert legend.HEIGHT <= height <= legend.HEIGHT + 40
