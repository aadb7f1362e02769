from __future__ import annotations

import made_atlases
import numpy as np

from glass_nav.topology.search import distinguishability
from glass_nav.topology.search.search_params import SearchParams


def test_places_that_half_a_turn_takes_to_each_other_are_found_indistinguishable() -> None:
    # A corridor with a side corridor to the left near either end; the stubs at the ends are alike.
    atlas = made_atlases.corridors(
        [(0, 0), (10, 0), (-5, 0), (15, 0), (0, 4), (10, -4)],
        [1.3, 1.3, 0.8, 0.8, 0.6, 0.6],
        [(0, 1), (2, 0), (1, 3), (0, 4), (1, 5)],
    )
    found = distinguishability.of(atlas, SearchParams())
    assert not found.confirmed.any() and not len(found.unresolved)
    # Half a turn about (5, 0) takes node 0 to 1, 2 to 3, 4 to 5.
    halfturn = {0: 1, 1: 0, 2: 5, 5: 2, 3: 4, 4: 3, 6: 8, 8: 6, 7: 9, 9: 7}
    assert {frozenset(alike) for alike in found.alike} == {frozenset(pair) for pair in halfturn.items()}


def test_where_all_differs_nothing_is_indistinguishable() -> None:
    steps = []
    atlas = made_atlases.voronoi(60, 5)
    found = distinguishability.of(atlas, SearchParams(), np.arange(0, len(atlas.darts), 5), lambda: steps.append(1))
    assert found.confirmed.all() and found.alike == [] and len(steps) == len(found.starts)
    assert found.edges.max() < 12
