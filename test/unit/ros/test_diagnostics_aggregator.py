"""config/diagnostics_aggregator.yaml: every node of our launch files that has diagnostics is in a group."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

REPO = Path(__file__).parents[3]
GROUP = yaml.safe_load((REPO / "config" / "diagnostics_aggregator.yaml").read_text())["analyzers"]["glass_nav"]


def test_every_node_with_diagnostics_is_in_a_group():
    prefixes = {prefix for each in GROUP["analyzers"].values() for prefix in each["startswith"]}
    rooms = {
        path.parent.name
        for path in (REPO / "src/glass_nav/ros").rglob("*_node.py")
        if "Diagnostics(" in path.read_text()
    }
    assert rooms == set(GROUP["analyzers"])
    for room in rooms:
        launch = (REPO / "launch" / f"{room}.launch").read_text()
        name = re.search('<arg name="name" default="([^"]+)"', launch)[1]
        assert f"{name}:" in prefixes
    assert "amcl:" in prefixes


def test_a_group_is_one_that_the_aggregator_knows():
    assert GROUP["type"] == "diagnostic_aggregator/AnalyzerGroup"
    for each in GROUP["analyzers"].values():
        assert each["type"] == "diagnostic_aggregator/GenericAnalyzer" and each["path"] and each["timeout"] > 2.0
        assert each["find_and_remove_prefix"] == each["startswith"]
