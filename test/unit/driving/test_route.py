"""Ways along the edges of an atlas: worked by hand, and against Bellman and Ford in the shipped buildings."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_atlases import atlas_of, corridors, rotation_system
from scipy import ndimage

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.driving.route import RouteError, RoutePlanner
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

REPO = Path(__file__).resolve().parents[3]
LIMITS = BaseLimits()
# 0 --- 1 --- 2 in a row, 4 m each; 3 above 1; the long way 0 - 4 - 2 below
SQUARE = corridors([(0, 0), (4, 0), (8, 0), (4, 3), (4, -6)], [1.0] * 5, [(0, 1), (1, 2), (1, 3), (0, 4), (2, 4)])


def empty_map(width_m=10.0, height_m=6.0):
    """Free, around the square from x -1 and y -1, a wall from (2, 0.5) up, 4 cells thick."""
    cells = np.zeros((int(height_m / 0.05), int(width_m / 0.05)), np.int8)
    cells[30:, 60:64] = 100
    return GridMap(cells, 0.05, np.array([-1.0, -1.0, 0.0]))


def test_the_way_goes_by_the_nearest_edge_and_then_the_shortest_edges():
    route = RoutePlanner(SQUARE, LIMITS).to_node(np.array([1.0, 0.3]), 3)
    assert route.darts == (0, 4)
    np.testing.assert_allclose(route.polyline_m, [[1.0, 0.3], [1.0, 0.0], [4.0, 0.0], [4.0, 3.0]])
    assert route.length_m == pytest.approx(0.3 + 3.0 + 3.0)


def test_an_edge_is_driven_backwards_by_its_other_dart():
    route = RoutePlanner(SQUARE, LIMITS).to_node(np.array([4.0, 2.0]), 0)
    assert route.darts == (5, 1)
    np.testing.assert_allclose(route.polyline_m, [[4.0, 2.0], [4.0, 0.0], [0.0, 0.0]])


def test_an_edge_that_is_to_be_avoided_is_driven_round():
    route = RoutePlanner(SQUARE, LIMITS).to_node(np.array([0.0, 0.0]), 2, avoided={1})
    assert route.darts == (6, 9)
    with pytest.raises(RouteError, match=r"^no way along edges from x 0.00 m, y 0.00 m to node 2$"):
        RoutePlanner(SQUARE, LIMITS).to_node(np.array([0.0, 0.0]), 2, avoided={1, 4})


def test_an_edge_that_is_too_narrow_for_the_robot_is_none():
    narrow = replace(SQUARE, edges=replace(SQUARE.edges, clearance_m=np.array([0.3, 0.2, 0.3, 0.3, 0.3])))
    assert RoutePlanner(narrow, LIMITS).to_node(np.zeros(2), 2).darts == (6, 9)
    assert RoutePlanner(narrow, BaseLimits(robot_radius_m=0.15)).to_node(np.zeros(2), 2).darts == (0, 2)


def test_of_parallel_edges_the_shorter_is_taken():
    twice = atlas_of(
        np.array([[0.0, 0.0], [4.0, 0.0], [8.0, 0.0]]),
        np.ones(3),
        np.array([[0, 1], [0, 1], [1, 2]]),
        np.array([5.0, 4.0, 4.0]),
        np.array([0.6, np.pi - 0.6, 0.0, np.pi, 0.0, np.pi]),
    )
    bent = replace(
        twice,
        edges=replace(
            twice.edges,
            polyline_m=type(twice.edges.polyline_m).of(
                [np.array([[0.0, 0.0], [2.0, 1.5], [4.0, 0.0]]), np.zeros((0, 2)), np.zeros((0, 2))], 2
            ),
        ),
    )
    assert RoutePlanner(bent, LIMITS).to_node(np.array([0.0, -0.1]), 2).darts == (2, 4)


def test_a_point_beside_the_graph_is_reached_from_the_nearest_edge():
    route = RoutePlanner(SQUARE, LIMITS).to_point(np.array([1.0, 0.3]), np.array([4.5, 2.0]))
    np.testing.assert_allclose(route.polyline_m, [[1.0, 0.3], [1.0, 0.0], [4.0, 0.0], [4.0, 2.0], [4.5, 2.0]])


def test_on_one_edge_it_goes_straight_along_it():
    route = RoutePlanner(SQUARE, LIMITS).to_point(np.array([3.0, 0.1]), np.array([1.0, 0.1]))
    assert route.darts == (1,)
    assert route.length_m == pytest.approx(2.2)


def test_where_the_map_has_room_the_way_to_a_point_is_straight():
    planner = RoutePlanner(SQUARE, LIMITS, empty_map())
    route = planner.to_point(np.array([3.0, 1.0]), np.array([7.0, 2.0]))
    assert route.darts == ()
    np.testing.assert_allclose(route.polyline_m, [[3.0, 1.0], [7.0, 2.0]])


def test_a_wall_between_the_robot_and_the_nearest_edge_makes_it_take_another():
    atlas = corridors([(1.0, 3.0), (1.0, 0.0), (6.0, 0.0), (6.0, 3.0)], [1.0] * 4, [(0, 1), (1, 2), (2, 3)])
    there = np.array([3.0, 2.5])  # 2 m from the first edge, a wall at x 2 between; 2.5 m from the second
    assert RoutePlanner(atlas, LIMITS).to_node(there, 2).darts == (0, 2)
    assert RoutePlanner(atlas, LIMITS, empty_map()).to_node(there, 2).darts == (2,)


def test_a_robot_that_is_shut_in_is_told_so():
    with pytest.raises(RouteError, match=r"^the robot at x 30.00 m, y 0.00 m reaches no edge of the atlas made in a "):
        RoutePlanner(SQUARE, LIMITS, empty_map()).to_node(np.array([30.0, 0.0]), 2)
    with pytest.raises(RouteError, match="^node 9: the atlas made has nodes 0 to 4$"):
        RoutePlanner(SQUARE, LIMITS).to_node(np.zeros(2), 9)
    with pytest.raises(RouteError, match=r"^the goal at x 30.00 m"):
        RoutePlanner(SQUARE, LIMITS, empty_map()).to_point(np.array([3.0, 1.0]), np.array([30.0, 0.0]))
    apart = corridors([(0, 0), (4, 0), (20, 0), (24, 0)], [1.0] * 4, [(0, 1), (2, 3)])
    with pytest.raises(RouteError, match="to x 23.00 m, y 0.00 m$"):
        RoutePlanner(apart, LIMITS).to_point(np.zeros(2), np.array([23.0, 0.0]))


def test_at_the_goal_the_way_is_a_point():
    route = RoutePlanner(SQUARE, LIMITS).to_node(np.array([4.0, 0.0]), 1)
    assert route.length_m == 0.0 and len(route.polyline_m) == 1 and route.darts == ()


def bellman_ford(atlas, weights, start):
    away = np.full(len(atlas.nodes), math.inf)
    away[start] = 0.0
    for _ in range(len(atlas.nodes)):
        for edge, (first, last) in enumerate(atlas.darts.node.reshape(-1, 2)):
            away[last] = min(away[last], away[first] + weights[edge])
            away[first] = min(away[first], away[last] + weights[edge])
    return away


@pytest.mark.parametrize("seed", range(30))
def test_ways_are_the_shortest_in_any_graph(seed):
    """Against Bellman and Ford; edges of made atlases are straight."""
    rng = np.random.default_rng(seed)
    atlas = rotation_system(rng)
    chord = np.linalg.norm(np.diff(atlas.nodes.position_m[atlas.darts.node.reshape(-1, 2)], axis=1)[:, 0], axis=1)
    start = int(rng.integers(len(atlas.nodes)))
    planner, away = RoutePlanner(atlas, LIMITS), bellman_ford(atlas, chord, start)
    for node in range(len(atlas.nodes)):
        if math.isinf(away[node]):
            with pytest.raises(RouteError, match="^no way along edges"):
                planner.to_node(atlas.nodes.position_m[start], node)
        else:
            route = planner.to_node(atlas.nodes.position_m[start], node)
            assert route.length_m <= away[node] + 0.05 * len(route.darts)  # edges that cross: from the nearer one
            np.testing.assert_allclose(route.polyline_m[-1], atlas.nodes.position_m[node], atol=1e-9)


@pytest.mark.parametrize("name", ["glass_office", "opaque_office", "glass_wedge"])
def test_in_a_building_a_robot_fits_along_the_whole_way(name):
    atlas = atlas_file.load(shipped_atlases.find(name))
    grid_map = map_file.load(REPO / "maps" / name / "map.yaml")
    planner = RoutePlanner(atlas, LIMITS, grid_map)
    room_m = ndimage.distance_transform_edt(grid_map.free) * grid_map.resolution_m
    _, component = atlas.components()
    rng = np.random.default_rng(1)
    roomy = np.flatnonzero(atlas.nodes.r_m > 0.5)
    for first in rng.permutation(roomy)[:10]:
        for last in rng.permutation(np.flatnonzero(component == component[first]))[:3]:
            start = atlas.nodes.position_m[first] + rng.normal(0.0, 0.05, 2)
            route = planner.to_node(start, int(last))
            points = np.concatenate(
                [
                    route.polyline_m,
                    *(
                        begin + np.linspace(0, 1, 50)[:, None] * (end - begin)
                        for begin, end in zip(route.polyline_m[:-1], route.polyline_m[1:])
                    ),
                ]
            )
            assert room_m[grid_map.cells(points)].min() > LIMITS.robot_radius_m - grid_map.resolution_m
            assert [atlas.darts.node[dart ^ 1] for dart in route.darts[:-1]] == [
                atlas.darts.node[dart] for dart in route.darts[1:]
            ]


def test_a_dead_end_that_is_too_narrow_is_driven_into_as_far_as_the_robot_fits():
    cells = np.zeros((40, 200), np.int8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = 100, 100, 100, 100
    for column in range(100, 200):  # a wedge
        depth = (column - 100) // 5
        cells[:depth, column], cells[40 - depth :, column] = 100, 100
    grid_map = GridMap(cells, 0.05, np.zeros(3))
    atlas = corridors([(1.0, 1.0), (9.9, 1.0)], [0.9, 0.05], [(0, 1)])
    atlas = replace(atlas, edges=replace(atlas.edges, clearance_m=np.array([0.05])))
    end_m = RoutePlanner(atlas, LIMITS, grid_map).to_node(np.array([2.0, 1.0]), 1).polyline_m[-1]
    assert end_m[1] == 1.0
    room_m = ndimage.distance_transform_edt(grid_map.free) * grid_map.resolution_m
    assert room_m[grid_map.cells(end_m)] == pytest.approx(LIMITS.robot_radius_m + LIMITS.margin_m, abs=0.06)
    np.testing.assert_array_equal(
        RoutePlanner(atlas, LIMITS).to_node(np.array([2.0, 1.0]), 1).polyline_m[-1], [9.9, 1.0]
    )  # without a map it drives on until it is stopped
