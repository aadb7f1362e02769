"""Chooses the panes that a map lacks: mappers erase glass, because beams pass it."""

from __future__ import annotations

from typing import Tuple

import numpy as np

from glass_nav.simulation.building import Building

_STREAM = 0xE4A5ED  # of the seed: no other part of a simulation draws from it


def choose(building: Building, share: float, seed: int) -> Tuple[int, ...]:
    """Indices of the panes that a mapper erased, whole panes, for building_map.draw().

    Args:
        building: its panes under film are walls and stay.
        share: of the panes, 0 to 1.
        seed: of the choice, >= 0; a larger share includes the panes of a smaller one.

    Raises:
        ValueError: the share is not 0 to 1.
    """
    if not 0.0 <= share <= 1.0:
        raise ValueError(f"share of erased glass must be 0 to 1, got {share}")
    panes = [index for index, pane in enumerate(building.panes) if not pane.film]
    order = np.random.default_rng([seed, _STREAM]).permutation(len(panes))
    return tuple(sorted(panes[number] for number in order[: int(round(share * len(panes)))]))
