"""The graph of floors whose graph is known: closed forms, rough walls, unknown space, many kinds of places."""

from __future__ import annotations

import drawn_floors
import numpy as np
import pytest
from drawn_floors import floor
from scipy import ndimage

from glass_nav.geometry import se2
from glass_nav.topology.atlas import voronoi_graph
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams
from glass_nav.world.grid_map import GridMap

W = 2.0  # width of corridors [m]
T = [(1, 5, 11, 5 + W), (5, 1, 5 + W, 6)]
CROSS = [(1, 5, 13, 5 + W), (6, 1, 6 + W, 12)]
L = [(1, 5, 9, 5 + W), (7, 1, 7 + W, 6)]
STRAIGHT = [(1, 5, 11, 5 + W)]
RING = [(2, 2, 12, 10)], [(2 + W, 2 + W, 12 - W, 10 - W)]  # free, occupied
ROOMS = [(1, 5, 21, 5 + W)] + [
    box for k in range(4) for box in ((1 + 5 * k, 7.2, 5 + 5 * k, 11), (2.5 + 5 * k, 7, 3.5 + 5 * k, 7.2))
]


def degrees(graph):
    return np.bincount(graph.degree, minlength=5).tolist()


def way_m(line):
    return np.hypot(*np.diff(line, axis=0).T).sum()


@pytest.mark.parametrize("resolution_m", [0.025, 0.05, 0.1])
@pytest.mark.parametrize("rough, seeds", [(0.0, 1), (0.1, 4), (0.3, 4)])
@pytest.mark.parametrize(
    "free, expected, r_of_w",
    [
        pytest.param(T, [0, 3, 0, 1, 0], 0.625, id="T"),
        pytest.param(CROSS, [0, 4, 0, 0, 1], 1.0 / np.sqrt(2.0), id="cross"),
        pytest.param(L, [0, 2, 0, 0, 0], None, id="L"),
        pytest.param(STRAIGHT, [0, 2, 0, 0, 0], None, id="corridor"),
        pytest.param(ROOMS, [0, 6, 0, 4, 0], None, id="rooms with doors"),
    ],
)
def test_the_graph_is_exact_however_rough_the_walls(resolution_m, rough, seeds, free, expected, r_of_w):
    """Walls lie in the middle of their cells, so corridors are a cell wider than their free cells."""
    for seed in range(100, 100 + seeds):
        graph = voronoi_graph.build(floor(22, 13, free, rough=rough, seed=seed, resolution_m=resolution_m))
        assert degrees(graph) == expected, f"seed {seed}"
        assert graph.components()[0] == 1
        assert (graph.doubt_m == 0.0).all()
        if r_of_w is not None:
            np.testing.assert_allclose(graph.r_m[graph.degree > 2], r_of_w * (W + resolution_m), atol=resolution_m)


@pytest.mark.long_run
@pytest.mark.parametrize("rough", [0.0, 0.1, 0.3])
def test_a_floor_of_corridors_and_rooms_has_exactly_their_graph(rough):
    """4 corridors cross 3: bends at the 4 corners, 6 T around, 2 crosses inside; a room in each of the 6 blocks."""
    along = [(1, y, 29, y + W) for y in (1, 11, 21)] + [(x, 1, x + W, 23) for x in (1, 9, 18, 27)]
    rooms = [
        box
        for y in (3.2, 13.2)
        for left, right in ((3, 9), (11, 18), (20, 27))
        for box in ((left + 0.2, y + 1, right - 0.2, y + 6), (left + 2, y - 0.2, left + 3, y + 1))
    ]
    for seed in range(3):
        graph = voronoi_graph.build(floor(30, 24, along + rooms, rough=rough, seed=seed))
        assert degrees(graph) == [0, 6, 0, 6 + 6, 2], f"seed {seed}"
        assert len(graph.lines_m) == (6 * 1 + 12 * 3 + 2 * 4) / 2 and graph.components()[0] == 1


@pytest.mark.parametrize("turn_deg", [7, 20, 33, 45])
@pytest.mark.parametrize(
    "free, expected",
    [(T, [0, 3, 0, 1, 0]), (CROSS, [0, 4, 0, 0, 1]), (L, [0, 2, 0, 0, 0]), (ROOMS, [0, 6, 0, 4, 0])],
    ids=["T", "cross", "L", "rooms"],
)
def test_the_steps_of_slanted_walls_change_nothing(turn_deg, free, expected):
    straight = (floor(22, 13, free).occupancy == 0).astype(float)
    slanted = np.where(ndimage.rotate(straight, turn_deg, order=1) > 0.5, 0, 100).astype(np.int8)
    assert degrees(voronoi_graph.build(GridMap(slanted, 0.05, np.zeros(3)))) == expected


def test_a_meetpoint_lies_where_the_closed_form_says():
    """T: the far wall at y = 7, corners at (5, 5) and (7, 5); equidistant at 3/8 W above them."""
    graph = voronoi_graph.build(floor(12, 8, T))
    node = int(np.argmax(graph.degree))
    np.testing.assert_allclose(graph.position_m[node], [6.0, 5.0 + 0.375 * W], atol=0.05)
    away = np.hypot(*(graph.obstacles_m[node] - graph.position_m[node]).T)
    np.testing.assert_allclose(away, graph.r_m[node], atol=0.05)
    assert len(np.unique(np.round(np.arctan2(*(graph.obstacles_m[node] - graph.position_m[node]).T), 1))) == 3


@pytest.mark.parametrize("rough", [0.0, 0.1, 0.3])
def test_a_dead_end_lies_in_the_middle_of_its_end_not_in_a_corner(rough):
    for seed in range(6):
        graph = voronoi_graph.build(floor(12, 8, STRAIGHT, rough=rough, seed=seed))
        ends = graph.position_m[np.argsort(graph.position_m[:, 0])]
        np.testing.assert_allclose(ends, [[2.0, 6.0], [10.0, 6.0]], atol=0.1)  # W / 2 from three walls
        np.testing.assert_allclose(graph.r_m, W / 2.0, atol=0.1)


def test_a_ring_without_a_meetpoint_has_one_node_and_one_edge_back_to_it():
    graph = voronoi_graph.build(floor(14, 12, *RING))
    assert degrees(graph) == [0, 0, 1, 0, 0] and graph.edge_node.tolist() == [[0, 0]]
    np.testing.assert_allclose(graph.lines_m[0][[0, -1]], np.repeat(graph.position_m, 2, axis=0), atol=1e-9)
    assert way_m(graph.lines_m[0]) == pytest.approx(2 * (8 + 6), rel=0.05)  # the centre line, its corners cut a little


def test_a_way_is_as_long_as_the_corridor_however_rough_its_walls():
    for seed in range(4):
        graph = voronoi_graph.build(floor(12, 8, STRAIGHT, rough=0.3, seed=seed))
        assert way_m(graph.lines_m[0]) == pytest.approx(8.0, abs=0.15)
        np.testing.assert_allclose(graph.line_clearance_m[0], W / 2.0, atol=0.12)


def test_doors_are_passed_if_the_robot_fits():
    door = ROOMS[:1] + [(1, 7.2, 7, 11), (3.6, 7, 4.4, 7.2)]
    assert degrees(voronoi_graph.build(floor(22, 13, door), VoronoiParams(robot_radius_m=0.3)))[3] == 1
    closed = voronoi_graph.build(floor(22, 13, door), VoronoiParams(robot_radius_m=0.5))
    assert degrees(closed) == [0, 4, 0, 0, 0] and closed.components()[0] == 2


@pytest.mark.parametrize("margin_m, parts", [(0.0, 1), (0.06, 1), (0.12, 2)])
def test_a_door_is_passed_if_the_margin_is_there_on_both_sides(margin_m, parts):
    """0.8 m of free cells, 0.85 m between the middles of its jambs: 0.125 m on either side of a robot of 0.3 m."""
    door = ROOMS[:1] + [(1, 7.2, 7, 11), (3.6, 7, 4.4, 7.2)]
    room_m = 0.5 * 0.85 - 0.3
    for off_m in (-0.02, 0.02):
        graph = voronoi_graph.build(
            floor(22, 13, door), VoronoiParams(robot_radius_m=0.3, passage_margin_m=room_m + off_m)
        )
        assert graph.components()[0] == (1 if off_m < 0.0 else 2)
    graph = voronoi_graph.build(
        floor(22, 13, door), VoronoiParams(robot_radius_m=0.3 + room_m - 0.1, passage_margin_m=margin_m)
    )
    assert graph.components()[0] == parts


def test_posts_that_the_robot_can_pass_make_no_meetpoints_but_narrow_the_way():
    post = [(5.9, 6.0, 6.0, 6.1)]
    graph = voronoi_graph.build(floor(12, 8, STRAIGHT, post))
    assert degrees(graph) == [0, 2, 0, 0, 0]
    assert graph.line_clearance_m[0].min() < 0.1
    seen = voronoi_graph.build(floor(12, 8, STRAIGHT, post), VoronoiParams(smallest_obstacle_m=0.05))
    assert degrees(seen) == [0, 2, 0, 2, 0] and len(seen.lines_m) == 4
    pillar = voronoi_graph.build(floor(12, 8, STRAIGHT, [(5.8, 5.8, 6.2, 6.2)]))
    assert degrees(pillar) == [0, 2, 0, 2, 0]


def test_posts_with_gaps_too_narrow_for_the_robot_are_one_thing():
    row = [(5.9, 5.6 + 0.25 * k, 6.0, 5.7 + 0.25 * k) for k in range(4)]
    assert degrees(voronoi_graph.build(floor(12, 8, STRAIGHT, row))) == [0, 2, 0, 2, 0]


def test_unknown_specks_are_free_also_in_swarms():
    swarm = [(5 + 0.2 * k, 5.3 + 0.2 * j, 5.1 + 0.2 * k, 5.4 + 0.2 * j) for k in range(5) for j in range(7)]
    graph = voronoi_graph.build(floor(12, 8, STRAIGHT, unknown=swarm))
    assert degrees(graph) == [0, 2, 0, 0, 0] and graph.line_clearance_m[0].min() > 0.9


def test_no_way_leads_through_unknown_space_and_what_borders_on_it_is_in_doubt():
    graph = voronoi_graph.build(floor(12, 8, STRAIGHT, unknown=[(7.5, 4, 12, 8)]))
    assert degrees(graph) == [0, 2, 0, 0, 0]
    left, right = np.argsort(graph.position_m[:, 0])
    assert graph.doubt_m[left] == 0.0
    assert graph.doubt_m[right] == pytest.approx(graph.r_m[right], abs=0.1)  # the walls are r away, to its sides
    assert max(line[:, 0].max() for line in graph.lines_m) < 7.5


def test_a_gap_in_a_wall_is_a_small_doubt():
    """0.2 m of the wall opposite of the T's branch are unknown: the real wall may be there or a little further."""
    graph = voronoi_graph.build(floor(12, 8, T, unknown=[(5.9, 7, 6.1, 8)]))
    node = int(np.argmax(graph.degree))
    assert degrees(graph) == [0, 3, 0, 1, 0] and 0.0 < graph.doubt_m[node] <= 0.15


def test_free_space_at_the_edge_of_the_map_ends_there():
    whole = GridMap(np.zeros((100, 300), np.int8), 0.05, np.zeros(3))
    graph = voronoi_graph.build(whole)
    assert degrees(graph) == [0, 2, 0, 0, 0]
    np.testing.assert_allclose(graph.doubt_m, graph.r_m)  # there is no wall at all


def test_corridors_that_meet_almost_in_one_point_are_a_cross():
    """Branches 0.2 m apart: to the robot all four corners are equally far; 1.2 m apart they are two T."""
    for offset, expected in ((0.2, [0, 4, 0, 0, 1]), (1.2, [0, 4, 0, 2, 0])):
        free = [(1, 5, 13, 5 + W), (6, 1, 6 + W, 6), (6 + offset, 6, 6 + offset + W, 12)]
        assert degrees(voronoi_graph.build(floor(15, 13, free))) == expected


def test_a_branch_that_is_shorter_than_what_counts_as_one_point_is_none():
    """The branch of the T is 3.75 m, its other arms are 4 m."""
    graph = voronoi_graph.build(floor(12, 8, T), VoronoiParams(merge_m=3.9))
    assert degrees(graph) == [0, 2, 0, 0, 0] and way_m(graph.lines_m[0]) == pytest.approx(8.0, abs=0.3)


def test_parallel_ways_and_loops_are_edges_like_any():
    """A pillar in a corridor: two ways from one side of it to the other. A ring with a stem: an edge from T to T."""
    pillar = voronoi_graph.build(floor(12, 8, STRAIGHT, [(5.5, 5.6, 6.5, 6.4)]))
    assert sorted(map(tuple, np.sort(pillar.edge_node, axis=1).tolist()))[1:3] == [(1, 2), (1, 2)]
    stem = voronoi_graph.build(floor(18, 12, [*RING[0], (12, 5.5, 17, 6.5)], RING[1]))
    assert degrees(stem) == [0, 1, 0, 1, 0]
    assert sorted(first == second for first, second in stem.edge_node) == [False, True]


def test_every_part_of_the_floor_counts_if_it_is_large_enough():
    free = [(1, 1, 9, 3), (1, 5, 9, 7), (11, 1, 12, 2)]
    graph = voronoi_graph.build(floor(14, 8, free))
    assert graph.components()[0] == 2 and graph.left_out == 1
    assert voronoi_graph.build(floor(14, 8, free), VoronoiParams(smallest_component_m=7.0)).left_out == 3


def test_where_everything_is_too_small_to_count_there_is_no_graph():
    assert len(voronoi_graph.build(floor(12, 8, T), VoronoiParams(smallest_obstacle_m=50.0)).r_m) == 0


@pytest.mark.parametrize(
    "grid_map",
    [
        pytest.param(floor(4, 4, []), id="walls only"),
        pytest.param(floor(4, 4, [(0, 0, 4, 4)], unknown=[(0, 0, 4, 4)]), id="nothing known"),
        pytest.param(floor(4, 4, [(1, 1, 1.3, 3)]), id="too narrow"),
        pytest.param(floor(4, 4, [(1, 1, 3, 3)]), id="a square room: only a point is left"),
        pytest.param(floor(4, 4, [(1, 1, 3, 2.8)]), id="nearly square"),
        pytest.param(GridMap(np.zeros((1, 1), np.int8), 0.05, np.zeros(3)), id="one cell"),
    ],
)
def test_without_a_way_the_graph_is_empty(grid_map):
    graph = voronoi_graph.build(grid_map, VoronoiParams(smallest_component_m=0.0))
    assert len(graph.r_m) == len(graph.lines_m) == len(graph.edge_node) == 0
    assert graph.position_m.shape == (0, 2) and graph.components()[0] == 0


def test_the_graph_is_where_the_map_is():
    pose = np.array([7.0, -2.0, 2.1])
    here, there = (voronoi_graph.build(floor(14, 13, CROSS, map_from_grid=where)) for where in (np.zeros(3), pose))
    np.testing.assert_allclose(there.position_m, se2.transform_points(pose, here.position_m), atol=1e-9)
    np.testing.assert_allclose(there.lines_m[0], se2.transform_points(pose, here.lines_m[0]), atol=1e-9)


@pytest.mark.parametrize("turn", range(1, 4))
def test_the_graph_turns_with_the_floor(turn):
    """Property: nothing depends on rows and columns."""
    grid_map = floor(22, 13, ROOMS, rough=0.1, seed=7)
    turned = GridMap(np.ascontiguousarray(np.rot90(grid_map.occupancy, turn)), 0.05, np.zeros(3))
    first, second = voronoi_graph.build(grid_map), voronoi_graph.build(turned)
    assert degrees(first) == degrees(second)
    np.testing.assert_allclose(np.sort(first.r_m), np.sort(second.r_m), atol=0.02)


def test_the_small_map_around_a_robot_has_the_meetpoint_of_the_floor():
    """8 x 8 m cut out around the cross, the rest never seen."""
    whole = floor(15, 13, CROSS, rough=0.1, seed=3)
    part = GridMap(np.ascontiguousarray(whole.occupancy[40:200, 60:220]), 0.05, np.array([3.0, 2.0, 0.0]))
    nodes = [graph.position_m[graph.degree == 4] for graph in map(voronoi_graph.build, (whole, part))]
    assert len(nodes[0]) == len(nodes[1]) == 1
    np.testing.assert_allclose(nodes[0], nodes[1], atol=0.02)


def test_progress_is_told_as_often_as_announced():
    steps = []
    voronoi_graph.build(floor(12, 8, T), step=lambda: steps.append(1))
    assert len(steps) == voronoi_graph.STEPS


@pytest.mark.parametrize(
    "values, text",
    [
        ({"robot_radius_m": 0.0}, "robot_radius_m must be > 0 m, got 0.0"),
        ({"leaf_m": -0.1}, "leaf_m must be finite and >= 0, got -0.1"),
        ({"merge_m": np.nan}, "merge_m must be finite and >= 0, got nan"),
    ],
)
def test_bad_parameters_are_refused(values, text):
    with pytest.raises(ValueError, match=f"^{text}$"):
        VoronoiParams(**values)


def test_rough_floors_are_rough():
    """The tests above rest on it."""
    smooth, rough = (drawn_floors.floor(12, 8, T, rough=share, seed=1).occupancy for share in (0.0, 0.3))
    assert 100 < (smooth != rough).sum() < 400
