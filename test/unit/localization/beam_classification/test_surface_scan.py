"""The scan as a costmap should see it: cut at glass, never longer, and untouched while the pose is not trusted."""

from __future__ import annotations

import numpy as np
import pytest
from made_expected_ranges import NEVER, expect

from glass_nav.localization.beam_classification import surface_scan

# Chances to be seen through, and to be there. NEW: nearly nothing is known of it.
WALL, PANE, GONE, NEW = (0.01, 0.8), (0.99, 0.99), (0.99, 0.01), (0.3, 0.8)


def cut(ranges_m, case, first=2.0, glass=WALL, gone=False, trusted=True, gate_m=0.15, max_range_m=20.0, **offered):
    """glass: chances of every first surface, or (B, 2) of each; gone: whether all that is drawn is gone."""
    ranges_m = np.atleast_1d(np.asarray(ranges_m, float))
    beams = len(ranges_m)
    seen = expect(first=np.broadcast_to(np.asarray(first, float), beams), **offered)
    return surface_scan.of(
        ranges_m=ranges_m,
        case=np.broadcast_to(case, beams).astype(np.uint8),
        first=surface_scan.standing(seen, lambda cell, axis_rad: np.full(len(cell), gone)),
        glass=np.broadcast_to(np.reshape(np.transpose(glass), (2, -1)), (2, beams)),
        gate_m=np.full(beams, gate_m),
        max_range_m=max_range_m,
        trusted=trusted,
    )


@pytest.mark.parametrize("glass", [WALL, PANE, GONE])
@pytest.mark.parametrize("case", [2, 3, 4])
def test_a_beam_that_passed_or_was_mirrored_is_cut_at_the_pane(case, glass):
    found = cut(5.0, case, glass=glass)
    assert found.ranges_m.tolist() == [2.0] and found.cut.tolist() == [True] and found.trusted is True


@pytest.mark.parametrize("case", range(5))
def test_where_a_door_is_open_by_now_nothing_is_cut(case):
    assert cut(5.0, case, glass=PANE, gone=True).ranges_m.tolist() == [5.0]


THING, DOOR, PANE_BEHIND = 1, 2, 3  # cells


def cut_behind(ranges_m, cells, case=3, lines=(2.0, 2.6, 3.0)):
    """One beam and the surfaces along it, of which those with the cell of a thing are gone."""
    offered = dict(zip(("first", "second", "third"), lines))
    cell = np.zeros((4, 1, 1), int)
    cell[[0, 2, 3], 0, 0] = cells
    seen = expect(**offered, cell=cell)
    first = surface_scan.standing(seen, lambda cell, axis_rad: cell == THING)
    glass = np.reshape(PANE, (2, 1))
    return surface_scan.of(np.array([ranges_m]), np.array([case]), first, glass, np.full(1, 0.15), 20.0, True)


@pytest.mark.parametrize(
    "cells, range_m, cut_m",
    [
        pytest.param((THING, THING, PANE_BEHIND), 5.0, 3.0, id="a pane behind a thing that is gone"),
        pytest.param((THING, PANE_BEHIND, DOOR), 5.0, 2.6, id="a pane, and another one"),
        pytest.param((THING, THING, PANE_BEHIND), 2.8, 2.8, id="something between them"),
        pytest.param((THING, THING, PANE_BEHIND), 3.0, 3.0, id="the pane itself"),
        pytest.param((THING, THING, THING), 5.0, 5.0, id="all of it is gone"),
        pytest.param((DOOR, THING, PANE_BEHIND), 5.0, 2.0, id="in front of a thing that is gone"),
    ],
)
def test_where_a_thing_is_gone_the_next_surface_that_stands_counts(cells, range_m, cut_m):
    assert cut_behind(range_m, cells).ranges_m.tolist() == [cut_m]


@pytest.mark.parametrize("range_m", [2.0, 2.1, 1.0, 0.3])
@pytest.mark.parametrize("case", range(5))
def test_a_beam_that_ended_at_the_first_surface_or_before_it_stays(case, range_m):
    found = cut(range_m, case, glass=PANE)
    assert found.ranges_m.tolist() == [range_m] and not found.cut.any()


@pytest.mark.parametrize("case", range(5))
def test_nothing_is_cut_while_the_pose_is_not_trusted(case):
    ranges_m = np.array([5.0, 2.0, np.inf, np.nan, 0.4])
    found = cut(ranges_m, case, glass=PANE, trusted=False)
    np.testing.assert_array_equal(found.ranges_m, ranges_m)
    assert not found.cut.any() and found.trusted is False


@pytest.mark.parametrize("nothing", [np.nan, -np.inf])
@pytest.mark.parametrize("case", range(5))
def test_what_is_no_measurement_is_never_cut(case, nothing):
    found = cut(np.full(3, nothing), case, glass=PANE)
    assert not found.cut.any()
    np.testing.assert_array_equal(found.ranges_m, [nothing] * 3)


def test_a_beam_is_cut_at_the_line_of_the_wall_not_at_the_staircase_of_its_cells():
    assert cut(5.0, 3, first=1.6, line_m=2.0).ranges_m.tolist() == [2.0]
    assert cut(1.9, 3, first=1.6, line_m=2.0).ranges_m.tolist() == [1.9]


@pytest.mark.parametrize("gate_m, is_cut", [(0.1, True), (0.4, False)])
def test_what_ends_within_the_gate_of_a_surface_is_that_surface(gate_m, is_cut):
    assert cut(2.25, 3, gate_m=gate_m).cut.tolist() == [is_cut]


def test_where_the_map_has_nothing_nothing_is_cut():
    found = cut([5.0, np.inf, 3.0], [3, 0, 2], first=NEVER, glass=PANE)
    assert not found.cut.any() and found.ranges_m.tolist() == [5.0, np.inf, 3.0]


# -- unexplained behind a wall


def behind_a_wall(beams=5, range_m=5.0, glass=WALL, **offered):
    """Beams that ended behind one straight wall, 2 m before the lidar, unexplained: which are cut."""
    return cut(np.full(beams, range_m), 0, glass=glass, **{**dict(first=2.0, incidence=0.0), **offered}).cut.tolist()


def test_what_ended_behind_the_middle_of_a_wall_that_is_there_has_passed_it():
    """Whatever it met behind: people in the next room are on no map."""
    for glass in (WALL, PANE, NEW):
        assert behind_a_wall(glass=glass)[1:-1] == [True] * 3


def test_what_ended_behind_a_thing_that_is_gone_is_no_reason_to_cut():
    assert behind_a_wall(glass=GONE) == [False] * 5


def test_beside_an_edge_a_beam_may_have_missed_the_wall():
    """The wall ends, or turns, or has no normal, at the third beam."""
    edge = dict(first=[2.0, 2.0, 4.0, 2.0, 2.0])
    assert behind_a_wall(**edge, range_m=7.0)[1:4] == [False] * 3
    corner = dict(axis_rad=[0.0, 0.0, 0.6, 0.0, 0.0])
    assert behind_a_wall(**corner)[1:4] == [False] * 3
    post = dict(axis_rad=[0.0, 0.0, np.nan, 0.0, 0.0])
    assert behind_a_wall(**post)[1:4] == [False] * 3


def test_a_wall_along_the_axis_of_its_normal_is_one_wall():
    """An axis is known up to half a turn: -90 and 90 degrees are the same."""
    assert behind_a_wall(axis_rad=np.radians([89.9, -89.9, 90.0, -90.0, 89.9]))[1:-1] == [True] * 3


@pytest.mark.parametrize("beams", [1, 2])
def test_of_one_beam_or_two_none_is_in_the_middle_of_a_wall(beams):
    assert behind_a_wall(beams) == [False] * beams


def test_where_the_map_ends_there_is_no_middle_of_a_wall():
    assert behind_a_wall(first=[NEVER, NEVER, 2.0, NEVER, NEVER]) == [False] * 5


# -- without an answer


def no_answer(beams=5, **offered):
    return behind_a_wall(beams, range_m=np.inf, **offered)


def test_what_did_not_come_back_from_where_a_pane_is_known_is_cut_there():
    assert no_answer(glass=PANE) == [True] * 5
    assert no_answer(glass=PANE, beams=1) == [True]
    assert cut(np.full(4, np.inf), 0, glass=PANE, line_m=2.1).ranges_m.tolist() == [2.1] * 4


def test_what_did_not_come_back_from_a_wall_has_passed_it_unless_the_wall_proved_solid_or_is_gone():
    assert no_answer(glass=NEW)[1:-1] == [True] * 3
    assert no_answer(glass=WALL) == [False] * 5
    assert no_answer(glass=GONE) == [False] * 5


def test_a_single_beam_without_an_answer_may_be_a_fault_of_the_lidar():
    ranges_m = np.array([2.0, 2.0, np.inf, 2.0, 2.0, np.inf, np.inf, 2.0])
    assert cut(ranges_m, 0, glass=NEW).cut.tolist() == [False] * 5 + [True] * 2 + [False]


@pytest.mark.parametrize(
    "offered",
    [
        pytest.param(dict(first=19.0, cos=0.1), id="far and grazing"),
        pytest.param(dict(first=15.0, max_range_m=5.0), id="beyond what the lidar sees"),
    ],
)
def test_where_no_wall_would_answer_it_says_nothing_that_none_did(offered):
    assert no_answer(glass=NEW, **offered) == [False] * 5


def test_a_beam_without_an_answer_passed_the_wall_that_a_beam_beside_it_meets_too():
    assert no_answer(glass=NEW, first=[2.0, 2.0, 6.0, 2.0, 2.0]) == [True, True, False, True, True]


# -- always


@pytest.mark.parametrize("seed", range(10))
def test_no_beam_is_ever_made_longer(seed):
    rng = np.random.default_rng(seed)
    beams = 300
    first = rng.uniform(0.5, 8.0, beams)
    first[rng.random(beams) < 0.1] = np.inf
    ranges_m = rng.choice([np.nan, np.inf, -np.inf, *rng.uniform(0.1, 10.0, 40)], beams)
    found = cut(
        ranges_m,
        rng.integers(0, 5, beams),
        first,
        glass=rng.random((beams, 2)),
        line_m=first + 0.1,
        gate_m=0.0,
        incidence=rng.choice([0.1, np.nan], beams),
        axis_rad=rng.choice([0.0, np.nan], beams),
    )
    known = ~np.isnan(ranges_m)
    assert np.all(found.ranges_m[known] <= ranges_m[known]) and np.isnan(found.ranges_m[~known]).all()
    np.testing.assert_array_equal(found.cut, known & (found.ranges_m != ranges_m))
    assert found.cut.any() and not found.cut.all()


def test_what_is_cut_is_not_cut_again():
    ranges_m, case = np.array([5.0, 6.0, np.inf, 2.0, 1.0]), np.array([3, 2, 0, 1, 0])
    once = cut(ranges_m, case, glass=PANE)
    again = cut(once.ranges_m, case, glass=PANE)
    np.testing.assert_array_equal(again.ranges_m, once.ranges_m)
    assert not again.cut.any()


def test_the_scan_that_came_in_is_left_alone():
    ranges_m = np.array([5.0, 5.0, 5.0])
    cut(ranges_m, 3)
    assert ranges_m.tolist() == [5.0, 5.0, 5.0]
