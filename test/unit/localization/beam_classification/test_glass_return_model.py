"""How often a pane answers: between lidars that see little of glass and lidars that see much."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.localization.beam_classification import glass_return_model
from glass_nav.localization.beam_classification.glass_return_model import ObliqueReturns

INCIDENCE_RAD = np.radians(np.linspace(0.0, 89.0, 90))


@pytest.mark.parametrize("share", [glass_return_model.min_share, glass_return_model.max_share])
def test_a_pane_answers_the_less_the_farther_from_head_on(share):
    answers = share(INCIDENCE_RAD)
    assert np.all((answers > 0.0) & (answers < 1.0))
    assert np.all(np.diff(answers) <= 1e-12)
    assert answers[0] > 0.5  # head on most lidars see it
    assert answers[60:].max() < 0.15  # from the side none does


def test_a_lidar_that_sees_little_of_glass_never_sees_more_than_one_that_sees_much():
    assert np.all(glass_return_model.min_share(INCIDENCE_RAD) <= glass_return_model.max_share(INCIDENCE_RAD))
    between = np.radians(15.0)
    assert glass_return_model.max_share(between) > 2.0 * glass_return_model.min_share(between)


def test_what_has_no_normal_is_neither_pane_nor_wall():
    """A railing, a shelf: some beams end there and some pass, for every lidar."""
    for share in (glass_return_model.min_share, glass_return_model.max_share):
        answers = share(np.array([[np.nan, 0.0], [1.0, np.nan]]))
        assert answers.shape == (2, 2)
        assert answers[0, 0] == answers[1, 1] and 0.1 < answers[0, 0] < 0.9
        assert answers[0, 1] == share(np.zeros(1))[0]


def test_how_many_beams_come_back_from_oblique_panes_is_learnt():
    count, oblique = 400, np.radians(60.0)
    returned = np.arange(count) < count // 4

    def learnt(incidence_rad=oblique, glass=1.0):
        returns = ObliqueReturns()
        for _ in range(30):
            measured_m = np.where(returned, 2.0, 8.0)
            returns = returns.learn(
                measured_m, np.full(count, 2.0), np.full(count, incidence_rad), np.full(count, glass), 0.15
            )
        return returns.share

    usual = ObliqueReturns().share
    assert learnt() == pytest.approx(0.25, abs=0.01)
    assert learnt(incidence_rad=0.1) == learnt(incidence_rad=np.nan) == learnt(glass=0.5) == usual


def test_a_surface_that_may_be_a_pane_returns_fewer_beams():
    returns = ObliqueReturns()
    wall, unsure, pane = returns.of_surfaces(np.full(3, 0.5), np.array([0.0, 0.5, 1.0]))
    assert wall == 1.0 > unsure > pane == pytest.approx(returns.share)
    assert returns.of_surfaces(np.ones(1), np.ones(1))[0] > 0.8  # head on
