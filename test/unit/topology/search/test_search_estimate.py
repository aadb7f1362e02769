from __future__ import annotations

import numpy as np
import pytest

from glass_nav.topology.search.search_estimate import SearchEstimate, TurnChoice
from glass_nav.vocabulary import SearchState


@pytest.mark.parametrize(
    "rank, degree, name", [(0, 3, "U_TURN"), (1, 3, "LEFT"), (2, 3, "RIGHT"), (1, 2, "FORWARD"), (2, 4, "RANK_2")]
)
def test_a_turn_has_a_word(rank: int, degree: int, name: str) -> None:
    assert TurnChoice(rank, degree).name == name


@pytest.mark.parametrize("state", SearchState)
def test_a_search_is_over_when_nothing_is_left_to_find_out(state: SearchState) -> None:
    estimate = SearchEstimate(state, "why", 0, np.zeros(0, int), np.zeros(0, int), None)
    assert estimate.done == (state in ("CONFIRMED", "AMBIGUOUS", "LOST"))
