from __future__ import annotations

import made_atlases
import numpy as np

from glass_nav.topology.search.claim import Claim, turn_to_new_edge

# A corridor of three edges, 0 - 1 - 2 - 3; dart 2 e leaves the first end of edge e, dart 2 e + 1 the other.
CORRIDOR = made_atlases.corridors([(0, 0), (10, 0), (20, 0), (30, 0)], [1.0] * 4, [(0, 1), (1, 2), (2, 3)])
CLAIM = Claim(2, np.array([4, 8]), {1, 2})


def test_a_claim_holds_for_as_many_candidates_that_come_from_it() -> None:
    path = [(1, 2, True), (2, 8, True), (3, 6, True)]
    assert CLAIM.holds(path, 2)
    assert not CLAIM.holds(path, 1)
    assert not CLAIM.holds([(1, 8, True), (2, 6, True)], 2)


def test_only_new_edges_confirm_it_and_one_for_each_step() -> None:
    assert CLAIM.confirmed({1, 2}, 5) == 0
    assert CLAIM.confirmed({1, 2, 7}, 5) == 1
    assert CLAIM.confirmed({1, 2, 7, 8, 9}, 3) == 1


def test_the_turn_leads_soonest_to_an_edge_that_was_not_driven() -> None:
    """Dart 1 is edge 0 at node 1: rank 1 is edge 1, straight on."""
    assert turn_to_new_edge(CORRIDOR, 1, {0}) == 1
    assert turn_to_new_edge(CORRIDOR, 1, {0, 1}) == 1  # edge 2 is beyond it
    assert turn_to_new_edge(CORRIDOR, 1, {1, 2}) == 0  # back is all that is left
    assert turn_to_new_edge(CORRIDOR, 1, {0, 1, 2}) is None
