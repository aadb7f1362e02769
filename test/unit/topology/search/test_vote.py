"""Votes, worked by hand on a floor where the sides tell different amounts."""

from __future__ import annotations

import made_atlases
import numpy as np

from glass_nav.topology.search import vote
from glass_nav.topology.search.matching import Matcher, Tolerances


def three_junctions(lefts: "tuple[float, float, float]", rights: "tuple[float, float, float]") -> Matcher:
    """Three T junctions far apart that were reached by equal corridors from the south: to the left and to the right
    there are dead ends at these distances. The dart that leads back of junction j is 6 j + 1."""
    xy, ends = [], []
    for number, (left, right) in enumerate(zip(lefts, rights)):
        x, first = 100.0 * number, 4 * number
        xy += [(x, -5.0), (x, 0.0), (x - left, 0.0), (x + right, 0.0)]
        ends += [(first, first + 1), (first + 1, first + 2), (first + 1, first + 3)]
    return Matcher(made_atlases.corridors(xy, [0.8, 1.2, 0.8, 0.8] * 3, ends), Tolerances(), use_angles=False)


ARRIVALS = np.array([1, 7, 13])


def test_the_best_turn_leaves_the_fewest() -> None:
    # To the left all differ: one survivor. To the right two are alike: of three equally likely truths, two leave two.
    voted = vote.best(three_junctions((4.0, 8.0, 12.0), (5.0, 5.0, 9.0)), ARRIVALS)
    np.testing.assert_allclose(voted.survivors, [3.0, 1.0, (2 + 2 + 1) / 3])
    np.testing.assert_allclose(voted.length_m, [5.0, 8.0, 19 / 3])
    assert (voted.rank, voted.splits) == (1, True)


def test_of_equal_turns_the_shorter_one_is_taken_and_back_is_the_last_choice() -> None:
    voted = vote.best(three_junctions((9.0, 9.0, 9.0), (7.0, 7.0, 7.0)), ARRIVALS)
    assert (voted.rank, voted.splits) == (2, False)  # back would be 5 m


def test_the_majority_goes_where_its_own_expectation_is_rarest() -> None:
    # To the left 0 and 1 expect the same, to the right 1 and 2: candidate 0 votes right, 2 left, and 1 does not care.
    matcher = three_junctions((4.0, 4.0, 9.0), (5.0, 9.0, 9.0))
    assert vote.left_right_votes(matcher, ARRIVALS) == (1, 2)  # who does not care counts for the right
    assert vote.seed(matcher, ARRIVALS) == 2
    matcher = three_junctions((4.0, 8.0, 12.0), (9.0, 9.0, 9.0))
    assert vote.left_right_votes(matcher, ARRIVALS) == (3, 0)
    assert vote.seed(matcher, ARRIVALS) == 1


def test_where_there_is_no_left_and_right_the_way_on_is_the_only_one() -> None:
    atlas = made_atlases.corridors([(0, 0), (5, 0), (10, 0)], [1.0, 1.0, 1.0], [(0, 1), (1, 2)])
    matcher = Matcher(atlas, Tolerances(), use_angles=False)
    assert vote.seed(matcher, np.array([1])) == 1  # at the middle
    assert vote.seed(matcher, np.array([0, 3])) == 0  # at the ends


def test_many_candidates_are_polled_and_counted_as_all() -> None:
    atlas = made_atlases.torus(20, 20)
    matcher = Matcher(atlas, Tolerances(), use_angles=False)
    darts = np.arange(len(atlas.darts))
    voted = vote.best(matcher, darts)
    np.testing.assert_allclose(voted.survivors, [len(darts)] * 4)
    assert not voted.splits
    assert vote.left_right_votes(matcher, darts) == (0, len(darts))


def test_the_turn_that_leaves_the_least_doubt_per_metre_is_taken() -> None:
    # To the left all differ after 4 m at least, to the right the third one does: what counts are the shares.
    matcher = three_junctions((4.0, 8.0, 12.0), (5.0, 5.0, 9.0))
    voted = vote.expected(matcher, ARRIVALS, np.array([0.5, 0.1, 0.4]))
    np.testing.assert_allclose(voted.survivors, [0.5, 0.0, 0.6 * (1 / 6)])  # probability outside the first
    np.testing.assert_allclose(voted.length_m[1:], [0.5 * 4 + 0.1 * 8 + 0.4 * 12, 0.6 * 5 + 0.4 * 9])
    assert voted.rank == 1 and voted.splits
    near = vote.expected(matcher, ARRIVALS, np.array([0.6, 0.0001, 0.3999]))
    assert near.rank == 2  # nearly as much for a shorter way
    assert not vote.expected(three_junctions((9.0,) * 3, (7.0,) * 3), ARRIVALS, np.ones(3)).splits
