"""Proofs that nothing tells places apart, on floors whose symmetry is known, and turns that do."""

from __future__ import annotations

import made_atlases
import numpy as np
import pytest

from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search import ambiguity
from glass_nav.topology.search.matching import Matcher, Tolerances


def matcher_of(atlas: Atlas, use_angles: bool = False) -> Matcher:
    return Matcher(atlas, Tolerances(), use_angles)


def brute_force(matcher: Matcher) -> np.ndarray:
    """(D, D) which darts are indistinguishable: of all pairs those go, again and again, of which a turn leads to one
    that is gone."""
    atlas, count = matcher.atlas, len(matcher.atlas.darts)
    every = np.arange(count)
    alike = matcher.alike_at(every[:, None], every) & matcher.alike_at(every[:, None], every).T
    along = matcher.alike_along(every[:, None], every)
    along &= along.T
    degree = atlas.degree[atlas.darts.node]
    while True:
        left = alike.copy()
        for a, b in zip(*np.nonzero(alike)):
            for rank in range(int(degree[a])):
                one, other = (int(atlas.clockwise(np.array(dart), np.array(rank))) for dart in (a, b))
                left[a, b] &= along[one, other] and alike[one ^ 1, other ^ 1]
        if (left == alike).all():
            return alike
        alike = left


@pytest.mark.parametrize("seed", range(25))
def test_pairs_are_proved_alike_exactly_when_no_turns_at_all_tell_them_apart(seed: int) -> None:
    matcher = matcher_of(made_atlases.rotation_system(np.random.default_rng(seed), values=1 + seed % 2))
    truth = brute_force(matcher)
    every = np.arange(len(truth))
    alike_now = matcher.alike_at(every[:, None], every)
    for a, b in zip(*np.nonzero(alike_now)):
        if a < b:
            proof = ambiguity.prove(matcher, np.array([a, b]))
            assert proof.indistinguishable == truth[a, b]
            assert (proof.ranks is None) == proof.indistinguishable


def test_the_turns_found_are_the_shortest_that_tell_two_places_apart() -> None:
    # Two corridors of five equal rooms in a row; only the last dead ends differ, by r.
    count = 6
    xy = [(5.0 * i, y) for y in (0.0, 100.0) for i in range(count)]
    r = [1.0] * count + [1.0] * (count - 1) + [2.0]
    ends = [(row + i, row + i + 1) for row in (0, count) for i in range(count - 1)]
    matcher = matcher_of(made_atlases.corridors(xy, r, ends))
    arrivals = np.array([1, 11])  # at the second place of each, come from the first
    proof = ambiguity.prove(matcher, arrivals)
    assert (proof.indistinguishable, proof.ranks) == (False, [1, 1, 1, 1])


@pytest.mark.parametrize("columns, rows", [(5, 4), (7, 7)])
def test_all_darts_of_a_torus_are_alike(columns: int, rows: int) -> None:
    atlas = made_atlases.torus(columns, rows)
    proof = ambiguity.prove(matcher_of(atlas), np.arange(len(atlas.darts)))
    # A square torus looks the same in all four directions; another only if lengths are all that is seen, and they are.
    assert proof.indistinguishable == (columns == rows) or proof.indistinguishable


def test_a_symmetry_costs_no_more_pairs_than_there_are_darts() -> None:
    atlas = made_atlases.torus(30, 30)
    proof = ambiguity.prove(matcher_of(atlas), np.array([0, 2 * 17]))
    assert proof.indistinguishable and proof.pairs <= len(atlas.darts)


def test_a_search_that_takes_too_long_is_broken_off_without_a_verdict() -> None:
    atlas = made_atlases.torus(12, 12)
    proof = ambiguity.prove(matcher_of(atlas), np.array([0, 2]), max_pairs=20)
    assert (proof.indistinguishable, proof.ranks) == (False, None)


def test_angles_tell_a_mirrored_wing_from_the_other() -> None:
    # From the middle an L to the left in one wing, to the right in the other: lengths alone are the same.
    xy = [(0, 0), (6, 0), (6, 5), (50, 0), (56, 0), (56, -5)]
    atlas = made_atlases.corridors(xy, [1.0, 1.3, 1.0, 1.0, 1.3, 1.0], [(0, 1), (1, 2), (3, 4), (4, 5)])
    arrivals = np.array([1, 5])
    assert ambiguity.prove(matcher_of(atlas), arrivals).indistinguishable
    proof = ambiguity.prove(matcher_of(atlas, use_angles=True), arrivals)
    assert not proof.indistinguishable and proof.ranks is not None
