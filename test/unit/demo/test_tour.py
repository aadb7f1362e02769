from __future__ import annotations

import made_atlases
import numpy as np

from glass_nav.demo import tour

# A corridor of nodes 4 m apart, the fourth without room; and a part of its own beside it.
PLACES = [(4.0 * k, 0.0) for k in range(8)] + [(0.0, 3.0), (8.0, 3.0)]
ATLAS = made_atlases.corridors(PLACES, [1.0] * 3 + [0.3] + [1.0] * 6, [*((k, k + 1) for k in range(7)), (8, 9)])


def drawn(count: int, seed: int = 0) -> "list[int]":
    return tour.nodes(ATLAS, np.array([0.5, 0.5]), count, np.random.default_rng(seed))


def test_a_tour_stays_in_one_part_and_has_room_everywhere() -> None:
    for seed in range(20):
        nodes = drawn(5, seed)
        assert len(set(nodes)) == 5 and set(nodes) <= {0, 1, 2, 4, 5, 6, 7}


def test_legs_are_about_as_long_as_they_should_be() -> None:
    assert {drawn(1, seed)[0] for seed in range(40)} == {1, 2, 4, 5}  # the nearest four to 8 m


def test_a_tour_is_the_same_for_the_same_seed() -> None:
    assert drawn(4, 3) == drawn(4, 3)


def test_it_ends_where_no_node_is_left() -> None:
    nodes = drawn(50)
    assert len(set(nodes)) == len(nodes) <= 7
    assert drawn(0) == []


def test_a_tour_begins_in_the_part_that_the_robot_is_in_where_a_node_behind_a_wall_is_nearer() -> None:
    """In the middle of a long corridor, beside a room."""
    atlas = made_atlases.corridors([(0, 0), (20, 0), (10, 2), (10, 6)], [1.0] * 4, [(0, 1), (2, 3)])
    nodes = tour.nodes(atlas, np.array([10.0, 0.1]), 1, np.random.default_rng(0))
    assert set(nodes) <= {0, 1} and nodes
