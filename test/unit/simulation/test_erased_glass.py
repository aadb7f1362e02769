"""Which panes a map lacks."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.simulation import erased_glass
from glass_nav.simulation.building import Building, Pane, Wall

WALL = Wall(np.array([[0.0, 0.0], [9.0, 0.0]]))
PANES = tuple(Pane(np.array([[x, 1.0], [x, 2.0]]), film=x == 4.0) for x in np.arange(1.0, 9.0))
BUILDING = Building((WALL,), panes=PANES)


def test_a_share_of_the_panes_is_erased_and_film_is_a_wall():
    assert erased_glass.choose(BUILDING, 0.0, 1) == ()
    assert len(erased_glass.choose(BUILDING, 0.43, 1)) == 3
    assert erased_glass.choose(BUILDING, 1.0, 1) == (0, 1, 2, 4, 5, 6, 7)


def test_the_seed_chooses_and_a_larger_share_erases_more_of_the_same():
    choices = {erased_glass.choose(BUILDING, 0.5, seed) for seed in range(20)}
    assert len(choices) > 5
    assert set(erased_glass.choose(BUILDING, 0.3, 4)) < set(erased_glass.choose(BUILDING, 0.7, 4))


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_a_share_is_0_to_1(share):
    with pytest.raises(ValueError, match=f"share of erased glass must be 0 to 1, got {share}"):
        erased_glass.choose(BUILDING, share, 0)
