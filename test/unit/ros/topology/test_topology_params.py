"""Parameters of the topology node that only earlier versions had."""

from __future__ import annotations

from glass_nav import params
from glass_nav.ros.topology import topology_params
from glass_nav.ros.topology.topology_params import TopologyParams


def test_a_file_of_an_earlier_version_starts_the_node_and_each_parameter_that_is_gone_is_named():
    kept, lines = topology_params.without_gone({"search_at_start": False, "searches": 6, "follow_lead": 0.15})
    assert params.load(TopologyParams, kept, "topology").session.search_at_start is False
    assert [line.split(" is ignored")[0] for line in lines] == ["~searches", "~follow_lead"]


def test_no_parameter_of_today_is_taken_for_one_that_is_gone():
    given = params.as_mapping(TopologyParams())
    assert topology_params.without_gone(given) == (given, [])
