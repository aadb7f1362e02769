"""Nodes of an atlas to be driven to one after another."""

from __future__ import annotations

from typing import List

import numpy as np

from glass_nav.topology.atlas.atlas import Atlas

MIN_ROOM_M = 0.5  # around nodes of the tour
MIN_LEG_M, LEG_M = 2.0, 8.0  # from node to node, at least and about
LEG_CHOICES = 4  # nodes of which one is drawn


def nodes(atlas: Atlas, here_m: np.ndarray, count: int, rng: np.random.Generator) -> List[int]:
    """Not far from each other, in one part of the graph and with room for a robot; fewer where there are no more.

    Args:
        atlas: of the building.
        here_m: (2,) where the tour begins.
        count: of nodes.
        rng: draws them.
    """
    _, part = atlas.components()
    position = atlas.nodes.position_m
    at = int(np.argmin(np.hypot(*(position - here_m).T)))
    tour: List[int] = []
    for _ in range(count):
        away_m = np.hypot(*(position - position[at]).T)
        fits = (part == part[at]) & (atlas.nodes.r_m > MIN_ROOM_M) & (away_m > MIN_LEG_M)
        fits[tour] = False
        choices = [node for node in np.argsort(np.abs(away_m - LEG_M)).tolist() if fits[node]][:LEG_CHOICES]
        if not choices:
            break
        at = int(rng.choice(choices))
        tour.append(at)
    return tour
