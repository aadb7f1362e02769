"""Verdicts on drives along a line, each counted by hand."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest

from glass_nav.evaluation.metrics import passed_nodes
from glass_nav.evaluation.metrics.passed_nodes import (
    DOUBTFUL,
    INVENTED,
    MISSED,
    NOTHING,
    SEEN,
    UNSTEADY,
    KnownNodes,
    Passing,
    SeenNode,
    TopologyScore,
)
from glass_nav.evaluation.plots import passed_nodes_picture
from glass_nav.world.grid_map import GridMap

PASSING = Passing(lambda r_m: np.full(np.shape(r_m), 0.5), 1.0, lambda from_m, to_m: True)
KNOWN = KnownNodes(
    np.array([[0.0, 0.0], [5.0, 0.3], [10.0, 0.0], [5.0, 3.0]]),
    np.array([1.0, 1.5, 1.0, 0.4]),
    np.array([3, 3, 3, 1]),
    np.array([[0, 1], [1, 2], [3, 1], [1, 2]]),
    np.array([5.1, 5.2, 2.7, 9.0]),
    np.array([5.0, 5.0, 2.7, 5.0]),
)
WAY_M = np.linspace(-3.0, 13.0, 161)  # a scan every 0.1 m and 0.1 s


def along(x_m):
    """Poses (S, 3)."""
    return np.column_stack([x_m, np.zeros((len(x_m), 2))])


def stamps(count):
    return np.arange(count, dtype=np.int64) * 100_000_000


def at(x_m):
    return int(round((x_m + 3.0) * 10)) * 100_000_000


def seen(x_m, y_m=0.0, degree=3, r_m=1.0, away_m=0.1, doubtful=False, steady=True):
    return SeenNode(at(x_m), at(x_m - 1.0), at(x_m + 1.0), np.array([x_m, y_m]), away_m, degree, r_m, doubtful, steady)


def verdicts(nodes, known=KNOWN):
    visits = passed_nodes.visits(known, stamps(len(WAY_M)), along(WAY_M), PASSING)
    return passed_nodes.compare(known, visits, nodes, PASSING)


def score(nodes, known=KNOWN):
    meetings = verdicts(nodes, known)
    edges = passed_nodes.driven_edges(
        known, meetings, lambda first, second: np.array([nodes[first].position_m, nodes[second].position_m])
    )
    return TopologyScore(known, nodes, meetings, edges)


def test_nodes_near_the_way_are_passed_where_it_is_nearest():
    visits = passed_nodes.visits(KNOWN, stamps(len(WAY_M)), along(WAY_M), PASSING)
    assert [visit.node for visit in visits] == [0, 1, 2]  # 3 is 3 m off
    assert [visit.stamp_ns for visit in visits] == [at(0.0), at(5.0), at(10.0)]
    assert [visit.away_m for visit in visits] == pytest.approx([0.0, 0.3, 0.0], abs=1e-9)
    assert (visits[0].first_ns, visits[0].last_ns) == (at(-1.5), at(1.5))


def test_a_node_behind_a_wall_is_not_passed():
    blind = PASSING._replace(sees=lambda from_m, to_m: False)
    assert passed_nodes.visits(KNOWN, stamps(len(WAY_M)), along(WAY_M), blind) == []


def test_coming_back_is_passing_again_and_dithering_is_not():
    back = np.concatenate([np.linspace(-1.0, 3.0, 41), np.linspace(3.0, -1.0, 41)])
    dither = np.concatenate([np.linspace(-1.0, 1.0, 21), np.linspace(1.0, -1.0, 21)])
    for way, times in ((back, 2), (dither, 1)):
        assert len(passed_nodes.visits(KNOWN, stamps(len(way)), along(way), PASSING)) == times


def test_where_the_pose_is_not_known_nothing_is_passed():
    poses = along(WAY_M)
    poses[np.abs(WAY_M - 5.0) < 2.0] = np.nan
    assert [visit.node for visit in passed_nodes.visits(KNOWN, stamps(len(WAY_M)), poses, PASSING)] == [0, 2]


def test_what_was_seen_within_half_a_metre_belongs_to_the_node():
    meetings = verdicts([seen(0.4), seen(5.0), seen(10.6)])
    assert [each.verdict for each in meetings] == [SEEN, SEEN, MISSED, INVENTED]
    assert [each.seen for each in meetings] == [0, 1, None, 2]


def test_one_node_is_seen_once_and_its_double_is_invented():
    meetings = verdicts([seen(-0.3), seen(0.2)])
    assert [(each.verdict, each.seen) for each in meetings[:2]] == [(INVENTED, 0), (SEEN, 1)]


def test_what_was_seen_at_another_time_is_not_this_visit():
    late = SeenNode(at(9.0), at(8.0), at(9.5), np.array([0.0, 0.0]), 0.1, 3, 1.0, False, True)
    assert [each.verdict for each in verdicts([late])] == [MISSED, MISSED, MISSED]


def test_a_node_seen_from_further_away_than_near_is_not_invented():
    assert INVENTED not in [each.verdict for each in verdicts([seen(7.5, away_m=0.6)])]
    assert INVENTED in [each.verdict for each in verdicts([seen(7.5, away_m=0.4)])]


def test_why_a_node_is_missed_is_reported():
    meetings = verdicts([seen(0.0, doubtful=True), seen(5.0, steady=False), seen(10.0, y_m=2.0, steady=False)])
    assert [(each.verdict, each.why) for each in meetings] == [
        (MISSED, DOUBTFUL),
        (MISSED, UNSTEADY),
        (MISSED, NOTHING),
    ]


def test_figures_are_those_counted_by_hand():
    figures = score([seen(0.1), seen(5.0, degree=4, r_m=1.2), seen(7.5, degree=1)]).metrics()
    assert {name: figures[name] for name in ("passed", "seen", "missed", "invented", "degree_right")} == {
        "passed": 3,
        "seen": 2,
        "missed": 1,
        "invented": 1,
        "degree_right": 1,
    }
    assert figures["seen_share"] == pytest.approx(2 / 3)
    assert figures["meetpoints"]["invented"] == 0
    assert figures["dead_ends"]["invented"] == 1
    assert figures["missed_why"] == {DOUBTFUL: 0, UNSTEADY: 0, NOTHING: 1}
    assert figures["position_off_m"]["median_abs"] == pytest.approx(0.2)  # of 0.1 and 0.3
    assert figures["r_off_m"]["median"] == pytest.approx(-0.15)  # of 0 and -0.3
    assert figures["edges_driven"] == 1
    assert figures["edge_length_off_m"]["median"] == pytest.approx(4.9 - 5.1)
    assert figures["edge_chord_off_m"]["median"] == pytest.approx(4.9 - 5.0)


def test_of_two_edges_between_the_same_nodes_the_likelier_was_driven():
    assert [driven.edge for driven in score([seen(5.0), seen(10.0)]).edges] == [1]


def test_no_edge_is_driven_past_something_invented():
    assert score([seen(0.0), seen(2.5), seen(5.0)]).edges == []


def test_a_drive_past_nothing_has_figures():
    nowhere = KnownNodes(
        np.full((1, 2), 99.0), np.ones(1), np.array([3]), np.zeros((0, 2), int), np.zeros(0), np.zeros(0)
    )
    figures = score([], nowhere).metrics()
    assert (figures["passed"], figures["seen_share"], figures["degree_right_share"]) == (0, None, None)
    assert figures["position_off_m"]["p95_abs"] is None


def test_each_meeting_is_a_row_and_what_is_not_known_is_empty(tmp_path):
    passed_nodes.write(tmp_path / "topology.csv", score([seen(0.3, degree=4), seen(7.5, away_m=0.2)]))
    with (tmp_path / "topology.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["verdict"] for row in rows] == [SEEN, MISSED, INVENTED, MISSED]
    assert (rows[0]["node"], rows[0]["degree"], rows[0]["seen_degree"], rows[0]["off_m"]) == ("0", "3", "4", "0.300")
    assert (rows[1]["why"], rows[1]["seen_x_m"], rows[1]["off_m"], rows[1]["away_m"]) == (NOTHING, "", "", "0.300")
    assert (rows[2]["node"], rows[2]["r_m"], rows[2]["seen_x_m"], rows[2]["away_m"]) == ("", "", "7.500", "0.200")


def test_the_picture_shows_each_verdict_in_its_colour(tmp_path):
    from matplotlib import image

    path = tmp_path / "topology.png"
    grid = GridMap(np.zeros((40, 160), np.int8), 0.1, np.array([-3.0, -2.0, 0.0]))
    passed_nodes_picture.draw(
        path, grid, [KNOWN.position_m[[0, 1]]], along(WAY_M)[:, :2], score([seen(0.3, degree=4), seen(7.5)]), "a drive"
    )
    pixels = image.imread(str(path))[..., :3]
    for colour in passed_nodes_picture.COLOURS.values():
        wanted = [int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5)]
        assert (np.abs(pixels - wanted).max(axis=-1) < 0.02).sum() > 20


def test_a_drive_without_poses_is_drawn_over_the_whole_atlas(tmp_path):
    nowhere = np.full((3, 2), math.nan)
    passed_nodes_picture.draw(
        tmp_path / "topology.png",
        GridMap(np.zeros((40, 160), np.int8), 0.1, np.array([-3.0, -2.0, 0.0])),
        [],
        nowhere,
        TopologyScore(KNOWN, [], [], []),
        "nowhere",
    )
    assert (tmp_path / "topology.png").stat().st_size > 5000
