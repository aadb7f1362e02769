"""What visits teach an atlas: values, tolerances, and meetpoints that are usually missed."""

from __future__ import annotations

import made_atlases
import numpy as np
import pytest

from glass_nav.topology.atlas.atlas import MIN_MISSES, Atlas
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search import learnt_atlas
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.matching import Tolerances
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState

TOLERANCES = Tolerances(r_sigma_m=0.05)
R_M = [0.9, 1.3, 1.7, 0.5, 1.4]


def corridor() -> Atlas:
    """Nodes 0 to 3 along a corridor; at 1 a door leads to the room of node 4."""
    return made_atlases.corridors([(0, 0), (6, 0), (14, 0), (26, 0), (6, 4)], R_M, [(0, 1), (1, 2), (2, 3), (1, 4)])


def visited(node: int, r_m: "list[float]") -> Atlas:
    atlas = corridor()
    atlas.visits.add_nodes(np.full(len(r_m), node), np.array(r_m))
    return atlas


def test_without_visits_an_atlas_stays_the_same_object() -> None:
    atlas = corridor()
    assert learnt_atlas.of(atlas, TOLERANCES) is atlas
    assert learnt_atlas.of(visited(2, [1.72, 1.74]), TOLERANCES).nodes.r_m[2] == 1.7  # two visits are few


def test_many_visits_correct_a_value_and_narrow_its_tolerance() -> None:
    """By hand: the map says 1.70 with 0.02, 10 visits 1.74 with 0.05 / sqrt(10)."""
    learnt = learnt_atlas.of(visited(2, [1.74] * 10), TOLERANCES).nodes
    of_map, of_visits = 0.02**-2, 10 / 0.05**2
    assert learnt.r_m[2] == pytest.approx((of_map * 1.70 + of_visits * 1.74) / (of_map + of_visits))
    assert learnt.sigma_r_m[2] == pytest.approx((of_map + of_visits) ** -0.5) and learnt.sigma_r_m[2] < 0.02
    np.testing.assert_array_equal(learnt.r_m[[0, 1, 3, 4]], np.array(R_M)[[0, 1, 3, 4]])


def test_a_place_that_looks_different_each_time_gets_a_wider_tolerance() -> None:
    learnt = learnt_atlas.of(visited(2, [1.5, 1.9] * 10), TOLERANCES).nodes
    assert learnt.sigma_r_m[2] > 0.15


def test_the_chord_of_an_edge_moves_with_its_length() -> None:
    atlas = corridor()
    atlas.visits.add_edges(np.full(50, 1), np.full(50, 8.2))
    learnt = learnt_atlas.of(atlas, TOLERANCES).edges
    assert 8.0 < learnt.length_m[1] < 8.2 and learnt.chord_m[1] == pytest.approx(learnt.length_m[1])


def drive_past_the_door(atlas: Atlas) -> AtlasLocalizer:
    """From the dead end 3 to the dead end 0; nothing is seen at 1, where the door is shut."""
    localizer = AtlasLocalizer(atlas, SearchParams(confirm_edges=0))
    localizer.start(Meetpoint(1, 0.5))
    localizer.update(Traversal(0, 12.0, 12.0), Meetpoint(2, 1.7))
    localizer.update(Traversal(1, 14.0, 14.0), Meetpoint(1, 0.9))
    assert localizer.estimate is not None and localizer.estimate.state == SearchState.CONFIRMED
    assert localizer.path(int(localizer.estimate.dart[0])).size == 3
    return localizer


def test_a_door_that_is_shut_for_weeks_is_learnt_and_then_no_error() -> None:
    atlas, errors = corridor(), []
    for _ in range(MIN_MISSES + 1):
        localizer = drive_past_the_door(atlas)
        assert localizer.estimate is not None
        errors.append(int(localizer.estimate.errors[0]))
        localizer.count_visits(atlas.visits)
    assert errors == [1] * MIN_MISSES + [0]
    assert atlas.visits.node_missed.tolist() == [0, MIN_MISSES + 1, 0, 0, 0]
    assert atlas.visits.edge_count.tolist() == [0, 0, MIN_MISSES + 1, 0]  # the joined edges are not measured


def test_a_door_that_was_shut_for_weeks_and_is_open_today_is_seen_and_soon_forgotten() -> None:
    atlas = corridor()
    atlas.visits.add_misses(np.full(MIN_MISSES + 1, 1))
    localizer = AtlasLocalizer(atlas, SearchParams(confirm_edges=0))
    localizer.start(Meetpoint(1, 0.5))
    localizer.update(Traversal(0, 12.0, 12.0), Meetpoint(2, 1.7))
    estimate = localizer.update(Traversal(1, 8.0, 8.0), Meetpoint(3, 1.3))
    assert atlas.darts.node[estimate.dart].tolist() == [1] and estimate.errors.tolist() == [0]
    assert atlas.visits.usually_missed.tolist() == [False, True, False, False, False]
    localizer.count_visits(atlas.visits)
    assert not atlas.visits.usually_missed.any()


def test_two_usually_missed_nodes_in_a_row_join_three_edges() -> None:
    atlas = made_atlases.corridors(
        [(0, 0), (5, 0), (9, 0), (16, 0), (5, 3), (9, 3)],
        [0.6, 1.2, 1.4, 0.9, 0.5, 0.8],
        [(0, 1), (1, 2), (2, 3), (1, 4), (2, 5)],
    )
    atlas.visits.add_misses(np.repeat([1, 2], MIN_MISSES))
    localizer = AtlasLocalizer(atlas, SearchParams(confirm_edges=0))
    localizer.start(Meetpoint(1, 0.6))
    estimate = localizer.update(Traversal(0, 16.0, 16.0), Meetpoint(1, 0.9))
    assert atlas.darts.node[estimate.dart].tolist() == [3] and estimate.errors.tolist() == [0]
    assert localizer.forest.missed_along(int(estimate.dart[0])) == [1, 2]
