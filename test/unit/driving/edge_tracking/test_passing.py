"""A robot that drives through a T of corridors, worked out by hand, and through a gate of glass."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.driving.edge_tracking.local_map import LocalMapParams
from glass_nav.driving.edge_tracking.passing import PassedNode, PassingObserver, PassingParams
from glass_nav.geometry import se2
from glass_nav.simulation import lidar
from glass_nav.simulation.building import Building, Pane, Wall
from glass_nav.simulation.simulation import Simulation

THICK_M = 0.1
LIDAR = lidar.preset("sensitive")
LONG, SHORT = np.array([[-5.0, 0.0], [3.0, 0.0]]), np.array([[-5.0, 0.0], [-3.0, 0.0]])


def wall(*points):
    return Wall(np.array(points, float), THICK_M)


def corridors(*panes):
    """Inner faces: a corridor y = -1 to 1 along x, and one x = -1 to 1 that leaves it upwards."""
    half = THICK_M / 2.0
    low, high, left, right = -1.0 - half, 1.0 + half, -1.0 - half, 1.0 + half
    return Building(
        walls=(
            wall(
                [-7.0, low],
                [7.0, low],
                [7.0, high],
                [right, high],
                [right, 7.0],
                [left, 7.0],
                [left, high],
                [-7.0, high],
                [-7.0, low],
            ),
        ),
        panes=panes,
    )


def drive(building, path_m, params=PassingParams(), rate_hz=5.0):
    """What the observer saw; its nodes in the frame of the building, and the observer."""
    observer = PassingObserver(params)
    simulation = Simulation(building, LIDAR, seed=3, scan_rate_hz=rate_hz)
    at = {}
    for frame in simulation.drive(path_m):
        observer.see(frame.scan, frame.odom_from_base)
        at[frame.stamp_ns] = frame.map_from_base
    nodes = [node for node in observer.finish() if observer.counts(node)]
    return nodes, [se2.transform_points(at[node.stamp_ns], node.in_base_m) for node in nodes], observer


@pytest.fixture(scope="module")
def passed():
    return drive(corridors(), LONG)


@pytest.mark.long_run
def test_the_meetpoint_of_a_t_is_seen_where_three_walls_are_equally_far(passed):
    """(0, y) with y + 1 = hypot(1, 1 - y): y = 1/4, r = 5/4."""
    nodes, places, _ = passed
    assert len(nodes) == 1
    assert places[0] == pytest.approx([0.0, 0.25], abs=0.08)
    assert nodes[0].r_m == pytest.approx(1.25, abs=0.06)
    assert nodes[0].degree == 3
    assert nodes[0].away_m == pytest.approx(0.25, abs=0.15)
    assert nodes[0].first_ns < nodes[0].stamp_ns < nodes[0].last_ns


@pytest.mark.long_run
def test_the_way_is_that_of_the_graph(passed):
    """In the corridor the edge runs in its middle, where the robot drives as well."""
    nodes, _, observer = passed
    first = observer.way[6]
    start = PassedNode(first.stamp_ns, 0, 0, first.local_m, first.local_m, 0.0, 1, 1.0, 0.0, 1, 1.0)
    line = observer.line_between(start, nodes[0])
    length_m, chord_m = float(np.hypot(*np.diff(line, axis=0).T).sum()), float(np.hypot(*(line[-1] - line[0])))
    assert chord_m > 2.0
    assert chord_m <= length_m < chord_m + 0.15


def test_a_robot_that_does_not_come_near_passes_nothing():
    assert drive(corridors(), SHORT)[0] == []


def test_a_robot_that_stands_still_makes_one_graph():
    building = corridors()
    simulation = Simulation(building, LIDAR, seed=3)
    observer = PassingObserver()
    for _ in range(5):
        frame = simulation.look()
        observer.see(frame.scan, frame.odom_from_base)
    assert len(observer.way) == 1


def test_a_node_counts_that_graphs_agree_on_and_whose_obstacles_are_known():
    node = PassedNode(0, 0, 0, np.zeros(2), np.zeros(2), 0.1, 3, 1.0, 0.1, 3, 0.5)
    observer = PassingObserver(PassingParams(least_looks=3, least_share=0.5, most_doubt_m=0.1))
    assert observer.counts(node)
    for looks, share, doubt_m in ((2, 1.0, 0.0), (3, 0.4, 0.0), (3, 0.5, 0.2)):
        assert not observer.counts(PassedNode(0, 0, 0, np.zeros(2), np.zeros(2), 0.1, 3, 1.0, doubt_m, looks, share))


@pytest.mark.long_run
def test_a_pane_across_the_side_corridor_takes_its_meetpoint_away():
    """Beams meet it at right angles as the robot drives past: only before that there is a meetpoint."""
    pane = Pane(np.array([[-1.05, 1.0], [1.05, 1.0]]))
    nodes, _, _ = drive(corridors(pane), LONG, PassingParams(local_map=LocalMapParams(extend_glass_m=0.6)))
    assert [node for node in nodes if node.degree > 1] == []


@pytest.mark.parametrize(
    "change, text",
    [
        ({"near_m": 0.0}, "near_m must be > 0 and finite, got 0.0"),
        ({"graph_step_m": math.inf}, "graph_step_m must be > 0 and finite, got inf"),
        ({"linger_m": -1.0}, "linger_m must be >= 0 and finite, got -1.0"),
        ({"least_looks": 0}, "least_looks must be >= 1, got 0"),
        ({"least_share": 1.5}, r"least_share must be in \[0, 1\], got 1.5"),
    ],
)
def test_a_parameter_out_of_its_range_is_refused(change, text):
    with pytest.raises(ValueError, match=text):
        PassingParams(**change)


def test_near_is_by_the_room_that_there_is():
    assert PassingParams(near_m=0.5, near_share_of_r=0.5).near(np.array([0.4, 3.0])).tolist() == [0.5, 1.5]
