"""The graphs of floors whose graph is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drawn_floors import floor

from glass_nav.driving.edge_tracking.local_graph import LocalGraph, direction_at_end
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams

W = 2.0
CELL_M = 0.05
T = floor(12, 8, [(1, 5, 11, 5 + W), (5, 1, 5 + W, 6)])
CROSS = floor(14, 13, [(1, 5, 13, 5 + W), (6, 1, 6 + W, 12)])
RING = floor(14, 12, [(2, 2, 12, 10)], [(2 + W, 2 + W, 12 - W, 10 - W)])
LOLLIPOP = floor(20, 12, [(2, 2, 12, 10), (12, 5, 18, 5 + W)], [(2 + W, 2 + W, 12 - W, 10 - W)])
EAST, NORTH = np.array([1.0, 0.0]), np.array([0.0, 1.0])


def graph_of(grid):
    return LocalGraph(grid, VoronoiParams())


def junction(graph):
    return int(np.argmax(graph.degree))


def test_a_t_has_one_meetpoint_where_it_belongs_with_three_branches_clockwise():
    graph = graph_of(T)
    assert sorted(graph.degree.tolist()) == [1, 1, 1, 3] and len(graph) == 3
    node = junction(graph)
    assert graph.graph.r_m[node] == pytest.approx(0.625 * W, abs=CELL_M)
    branches = graph.branches(node)
    leaves_rad = [branch.bearing_rad for branch in branches]
    assert leaves_rad == sorted(leaves_rad, reverse=True)  # clockwise
    ends = [branch.way_m[-1] for branch in branches]
    west, east, south = (
        min(range(3), key=lambda k: np.hypot(*(ends[k] - there))) for there in ([2, 6], [10, 6], [6, 2])
    )
    assert [(west + k) % 3 for k in range(3)] == [west, east, south]  # west, north of it east, then south
    for branch in branches:
        np.testing.assert_allclose(branch.way_m[0], graph.graph.position_m[node], atol=1e-9)


def test_branches_of_a_loop_are_there_twice():
    graph = graph_of(LOLLIPOP)
    branches = graph.branches(junction(graph))
    assert len(branches) == 3 == int(graph.degree.max())
    assert len({len(branch.way_m) for branch in branches}) == 2  # a loop in either direction, and the stem


def test_the_foot_is_the_nearest_point_that_can_be_reached_straight_on():
    graph = graph_of(T)
    foot = graph.foot(np.array([2.5, 6.4]), 1.0)
    assert foot is not None
    point = graph.ahead(foot, EAST).way_m[0]
    assert np.hypot(*(point - [2.5, 6.0])) < 0.25
    assert graph.foot(np.array([2.5, 6.4]), 0.2) is None
    beside = np.array([6.0, 4.5])  # above the foot of the T, edges run north here
    assert graph.foot(beside, 0.3, along=NORTH) is not None and graph.foot(beside, 0.3, along=EAST) is None
    behind_a_wall = np.array([4.6, 3.0])
    assert graph.foot(behind_a_wall, 5.0) is None  # in the wall: it sees nothing
    assert graph.sees(np.array([2.0, 6.0]), np.array([10.0, 6.0]))
    assert not graph.sees(np.array([2.0, 6.0]), np.array([6.0, 2.0]))
    assert not graph.sees(np.array([2.0, 6.0]), np.array([40.0, 6.0]))  # leaves the map


@pytest.mark.parametrize("along", [EAST, -EAST])
def test_what_lies_ahead_and_behind_are_the_two_parts_of_the_edge(along):
    graph = graph_of(T)
    foot = graph.foot(np.array([3.0, 6.0]), 0.5)
    ahead = graph.ahead(foot, along)
    np.testing.assert_array_equal(ahead.way_m[0], ahead.back_m[0])
    assert (ahead.way_m[-1] - ahead.way_m[0]) @ along > 0.0 > (ahead.back_m[-1] - ahead.back_m[0]) @ along
    position = graph.graph.position_m
    np.testing.assert_allclose(ahead.way_m[-1], position[ahead.node], atol=1e-9)
    np.testing.assert_allclose(ahead.back_m[-1], position[ahead.back_node], atol=1e-9)
    assert (ahead.node == junction(graph)) == (along is EAST)
    line = graph.graph.lines_m[ahead.edge]
    assert len(ahead.way_m) + len(ahead.back_m) == len(line) + 1
    np.testing.assert_array_equal(line[-1] if ahead.end else line[0], ahead.way_m[-1])


def test_a_walk_goes_straight_on_at_nodes_that_are_not_wanted():
    graph = graph_of(CROSS)
    start = graph.ahead(graph.foot(np.array([3.0, 6.0]), 0.5), EAST)
    middle = junction(graph)
    way, node = graph.walk(start, graph.degree != 2)
    assert node == middle
    way, node = graph.walk(start, np.zeros(len(graph.degree), bool))
    assert graph.degree[node] == 1 and way[-1, 0] > 11.0 and np.abs(way[:, 1] - 6.0).max() < 0.2
    assert (np.hypot(*np.diff(way, axis=0).T) < 0.2).all()
    assert direction_at_end(way) == pytest.approx(EAST, abs=0.1)


def test_a_walk_around_a_ring_ends():
    graph = graph_of(RING)
    assert graph.node_near(graph.graph.position_m[0], 1.0) is None  # its only node is none that counts
    foot = graph.foot(np.array([7.0, 3.0]), 0.5)
    way, node = graph.walk(graph.ahead(foot, EAST), np.zeros(len(graph.degree), bool))
    assert node == 0 and len(way) > 10


def test_the_nearest_node_is_one_that_is_near():
    graph = graph_of(T)
    there = graph.graph.position_m[junction(graph)]
    assert graph.node_near(there + 0.2, 0.3) == junction(graph)
    assert graph.node_near(there + 0.3, 0.3) is None


def test_where_there_is_no_graph_nothing_is_found():
    graph = graph_of(floor(5, 5, []))
    assert len(graph) == 0
    assert graph.foot(np.array([2.0, 2.0]), 9.0) is None and graph.node_near(np.array([2.0, 2.0]), 9.0) is None


def test_a_way_arrives_as_its_last_half_metre_runs():
    quarter = np.linspace(0.0, math.pi / 2, 50)
    bend = np.concatenate([3.0 * np.column_stack([np.sin(quarter), 1.0 - np.cos(quarter)]), [[3.0, 5.0]]])
    assert direction_at_end(bend) == pytest.approx(NORTH, abs=1e-9)
