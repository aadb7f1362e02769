"""What is reported of made ways and nodes, worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drawn_floors import floor

from glass_nav.driving.edge_tracking import edge_report
from glass_nav.driving.edge_tracking.edge_report import Node, Trace
from glass_nav.driving.edge_tracking.local_graph import Branch
from glass_nav.geometry import se2
from glass_nav.topology.atlas import atlas_builder
from glass_nav.world.grid_map import GridMap

ARM_M = np.array([[0.0, 0.0], [1.0, 0.0]])
# An L of corridors of 2 m, its ways in the middle of them: 5 m east, then 4 m north. Free cells end half a cell early.
L_FLOOR = floor(10, 9, [(1, 1, 8, 3), (6, 1, 8, 8)])
L_WAY = np.array([[2.0, 2.0], [7.0, 2.0], [7.0, 6.0]])


def branches(*bearings_rad):
    return [
        Branch(
            bearing, ARM_M @ np.array([[math.cos(bearing), math.sin(bearing)], [-math.sin(bearing), math.cos(bearing)]])
        )
        for bearing in bearings_rad
    ]


def points(*xy):
    trace = Trace(np.zeros(2))
    for point in xy:
        trace.add(np.array(point, float))
    return trace


def test_a_trace_is_as_long_as_the_way():
    trace = points((0.5, 0.0), (1.0, 0.0), (1.0, 0.7))
    assert trace.length_m == pytest.approx(1.7) and trace.way_m.tolist()[0] == [0.0, 0.0]
    assert Trace(np.zeros(2)).length_m == 0.0
    trace.add(np.array([1.0, 0.72]))  # a small step
    assert len(trace.way_m) == 4
    np.testing.assert_allclose(trace.line_m(np.array([1.0, 1.5])), [[0, 0], [1, 0], [1, 1.5]], atol=1e-9)


def test_a_robot_that_backed_off_did_not_make_the_edge_longer():
    there = [(0.1 * k, 0.0) for k in range(1, 21)]
    trace = points(*there, *there[-2:9:-1], *there[11:], (2.1, 0.0))
    assert trace.length_m == pytest.approx(2.1, abs=0.11)
    np.testing.assert_allclose(trace.line_m(np.array([2.5, 0.0])), [[0, 0], [2.5, 0]], atol=1e-9)


def test_beyond_a_node_that_lay_behind_the_edge_is_cut():
    trace = points(*[(0.1 * k, 0.0) for k in range(1, 21)])
    trace.cut_back(np.array([1.2, 0.05]))
    assert trace.length_m == pytest.approx(1.1, abs=0.02)
    trace.cut_back(np.array([-3.0, 0.0]))  # not before its beginning
    assert trace.way_m.tolist() == [[0.0, 0.0]]
    np.testing.assert_allclose(trace.line_m(np.array([0.4, 0.3])), [[0, 0], [0.4, 0.3]])


def test_wobbles_are_no_way_but_bends_are():
    wobbly = points(*[(0.1 * k, 0.03 * (-1) ** k) for k in range(1, 31)])
    line = wobbly.line_m(np.array([3.1, 0.0]))
    assert np.hypot(*np.diff(line, axis=0).T).sum() == pytest.approx(3.1, abs=0.02)


def test_ranks_begin_with_the_way_back_and_run_clockwise():
    clockwise = branches(math.pi / 2, 0.0, -math.pi / 2)
    assert [each.bearing_rad for each in edge_report.ranked(clockwise, 0.2)] == [0.0, -math.pi / 2, math.pi / 2]
    assert edge_report.ranked(clockwise, -1.5)[0] is clockwise[2]
    around = branches(3.0, 0.0)
    assert edge_report.ranked(around, -3.1)[0] is around[0]  # across the seam


def test_a_meetpoint_is_reported_in_the_frame_of_the_robot():
    node = Node(np.array([3.0, 1.0]), 1.2, 0.03, edge_report.ranked(branches(math.pi / 2, 0.0, -math.pi / 2), 3.0))
    pose = np.array([3.0, 0.5, math.pi / 2])  # half a metre south of it, looking north
    seen = edge_report.meetpoint(node, pose, 77)
    assert (seen.degree, seen.r_m, seen.sigma_r_m, seen.stamp_ns) == (3, 1.2, 0.03, 77)
    np.testing.assert_allclose(seen.centre_m, [0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(
        np.mod(seen.bearings_rad, 2 * np.pi),
        np.mod([each.bearing_rad - math.pi / 2 for each in node.branches], 2 * np.pi),
    )
    assert (np.diff(seen.bearings_rad) < 0.0).all()
    assert node.degree == 3


def test_an_equidistance_is_the_less_sure_the_more_its_obstacles_leave_open():
    assert edge_report.sigma_r_m(0.0, 0.0) == pytest.approx(0.03)
    assert edge_report.sigma_r_m(0.04, 0.12) == pytest.approx(math.sqrt(0.03**2 + 0.04**2 + 0.12**2))


def test_an_edge_has_its_length_chord_and_turn():
    driven = edge_report.traversal(L_WAY, 2, L_FLOOR)
    assert (driven.rank, driven.length_m) == (2, pytest.approx(9.0))
    assert driven.chord_m == pytest.approx(math.hypot(5.0, 4.0))
    assert driven.chord_bearing_rad == pytest.approx(math.atan2(4.0, 5.0))
    assert driven.turn_rad == pytest.approx(math.pi / 2)
    assert edge_report.bearing_back(L_WAY) == pytest.approx(-math.pi / 2)
    back = edge_report.traversal(L_WAY[::-1], 0, L_FLOOR)
    assert back.turn_rad == pytest.approx(-math.pi / 2) and back.length_m == pytest.approx(9.0)


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.5])
def test_the_walls_of_an_edge_lie_on_those_of_the_map(turn):
    """In the frame at its beginning, wherever that is."""
    to_other = np.array([1.0, -2.0, turn])
    grid = GridMap(L_FLOOR.occupancy, L_FLOOR.resolution_m, to_other)
    way = se2.transform_points(to_other, L_WAY)
    driven = edge_report.traversal(way, 1, grid)
    leaves = atlas_builder.bearings(way)[0]
    start = np.array([*way[0], leaves])
    ends = se2.transform_points(
        se2.inverse(to_other), se2.transform_points(start, driven.segments_m.reshape(-1, 2))
    ).reshape(-1, 2, 2)
    assert len(ends) >= 5
    faces = [
        (np.array(a, float), np.array(b, float))
        for a, b in [
            ((1, 1), (8, 1)),
            ((8, 1), (8, 8)),
            ((8, 8), (6, 8)),
            ((6, 8), (6, 3)),
            ((6, 3), (1, 3)),
            ((1, 3), (1, 1)),
        ]
    ]
    for segment in ends:
        middle = segment.mean(axis=0)
        off = [
            np.hypot(*(middle - (a + np.clip((middle - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1) * (b - a))))
            for a, b in faces
        ]
        assert min(off) < 0.1


def test_a_loop_has_no_chord_to_point_along():
    around = np.array([[2.0, 2.0], [7.0, 2.0], [7.0, 6.0], [2.0, 6.0], [2.0, 2.0]])
    driven = edge_report.traversal(around, 1, floor(10, 9, [(1, 1, 8, 8)]))
    assert driven.chord_m == 0.0 and math.isnan(driven.chord_bearing_rad) and driven.length_m == pytest.approx(18.0)
