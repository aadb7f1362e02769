from __future__ import annotations

from typing import List, Sequence

import numpy as np

from glass_nav.topology.atlas.voronoi.pruning import Chains
from glass_nav.topology.atlas.voronoi.ridges import Ridges


def graph(xy: Sequence["tuple[float, float]"], r: Sequence[float], links: Sequence["tuple[int, int]"]) -> Ridges:
    return Ridges(np.array(xy, float), np.array(r, float), np.zeros((len(xy), 3), int), np.array(links))


def kept(raw: Ridges, leaf: float) -> List[List[int]]:
    chains = Chains(raw)
    chains.prune(leaf, share_of_r=0.0)
    return sorted(min(chain.tolist(), chain[::-1].tolist()) for chain in chains.kept())


# A corridor along x with a twig to vertex 3; r is 5 everywhere, so no end is in a corner.
T = graph([(0, 0), (20, 0), (40, 0), (20, 8)], [5.0] * 4, [(0, 1), (1, 2), (1, 3)])


def test_a_twig_shorter_than_the_limit_goes_and_its_junction_with_it() -> None:
    assert kept(T, leaf=7.0) == [[0, 1], [1, 2], [1, 3]]
    assert kept(T, leaf=9.0) == [[0, 1, 2]]


def test_an_end_in_a_corner_is_where_it_begins_to_be_one() -> None:
    """r falls by more than half the distance from vertex 2 on."""
    raw = graph(
        [(0, 0), (20, 0), (40, 0), (44, 0), (48, 0)], [5.0, 5.0, 5.0, 2.5, 0.0], [(0, 1), (1, 2), (2, 3), (3, 4)]
    )
    assert kept(raw, leaf=0.0) == [[0, 1, 2]]


def test_a_ring_begins_where_it_is_widest() -> None:
    raw = graph([(0, 0), (9, 0), (9, 9), (0, 9)], [5.0, 5.0, 6.0, 5.0], [(0, 1), (1, 2), (2, 3), (3, 0)])
    (chain,) = Chains(raw).kept()
    assert chain[0] == chain[-1] == 2 and sorted(chain[:-1].tolist()) == [0, 1, 2, 3]
