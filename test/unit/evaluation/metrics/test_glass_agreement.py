"""Two opinions on which cells are glass: worked out by hand, and by all pairs."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.evaluation.metrics import glass_agreement

NOWHERE = np.zeros((0, 2))


def test_four_cells_against_three_worked_by_hand():
    reported = np.array([[0.0, 0.0], [0.1, 0.0], [1.0, 1.0], [5.0, 5.0]])
    other = np.array([[0.0, 0.1], [1.0, 1.14], [9.0, 9.0]])
    found = glass_agreement.of(reported, other, wall_cells=40)
    assert (found.reported, found.other) == (4, 3)
    assert found.precision == pytest.approx(3 / 4)  # (0.1, 0) is 0.141 m from (0, 0.1)
    assert found.recall == pytest.approx(2 / 3)
    assert found.wall_share == pytest.approx(0.1)
    assert found.summary() == {
        "glass_cells": 4,
        "other_cells": 3,
        "precision": found.precision,
        "recall": found.recall,
        "wall_share": found.wall_share,
    }


def test_a_cell_at_just_the_distance_is_near():
    reported, other = np.array([[0.0, 0.0]]), np.array([[0.15, 0.0]])
    assert glass_agreement.of(reported, other, 1).precision == 1.0
    assert glass_agreement.of(reported, other, 1, near_m=0.1499).precision == 0.0


def test_one_opinion_alone_agrees_with_nobody():
    cells = np.array([[0.0, 0.0], [1.0, 0.0]])
    reported = glass_agreement.of(cells, NOWHERE, 10)
    assert reported.precision == 0.0 and np.isnan(reported.recall)
    other = glass_agreement.of(NOWHERE, cells, 10)
    assert np.isnan(other.precision) and other.recall == 0.0 and other.wall_share == 0.0


def test_without_glass_or_walls_there_is_nothing_to_agree_on():
    found = glass_agreement.of(NOWHERE, NOWHERE, 0)
    assert (found.reported, found.other) == (0, 0)
    assert np.isnan([found.precision, found.recall, found.wall_share]).all()


@pytest.mark.parametrize("seed", range(5))
def test_the_shares_are_those_of_all_pairs_and_change_places_with_the_opinions(seed):
    rng = np.random.default_rng(seed)
    reported, other = rng.uniform(0.0, 3.0, (80, 2)), rng.uniform(0.0, 3.0, (60, 2))
    near = np.linalg.norm(reported[:, None] - other, axis=-1) <= glass_agreement.NEAR_M
    found, turned = glass_agreement.of(reported, other, 100), glass_agreement.of(other, reported, 100)
    assert found.precision == pytest.approx(near.any(axis=1).mean())
    assert found.recall == pytest.approx(near.any(axis=0).mean())
    assert (turned.precision, turned.recall) == (found.recall, found.precision)
