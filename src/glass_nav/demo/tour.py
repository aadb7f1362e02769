"""The nodes of an atlas that the demo drives to, one after another."""

from __future__ import annotations

from typing import List

import numpy as np

from glass_nav.geometry import polyline
from glass_nav.geometry.polyline import Polyline
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
    at = _nearest(atlas, here_m)
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


def _nearest(atlas: Atlas, here_m: np.ndarray) -> int:
    """The nearer end of the nearest edge; the node nearest to the robot may be behind a wall."""
    off_m = np.full(len(atlas.edges), np.inf)
    for edge in range(len(atlas.edges)):
        line = atlas.edges.polyline_m[edge]
        if len(line) < 2:
            line = atlas.nodes.position_m[atlas.darts.node[2 * edge : 2 * edge + 2]]
        points = polyline.distinct(line)
        path = Polyline(points) if len(points) > 1 else None
        off_m[edge] = np.hypot(*((points[0] if path is None else path.at(path.nearest(here_m))) - here_m))
    ends = atlas.darts.node[2 * int(off_m.argmin()) + np.arange(2)]
    return int(ends[np.argmin(np.hypot(*(atlas.nodes.position_m[ends] - here_m).T))])
