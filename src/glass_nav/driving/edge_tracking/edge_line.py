"""The line along which the robot drives, in the newest graph."""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np

from glass_nav.driving.edge_tracking.leg import BEHIND_M, Leg, line
from glass_nav.driving.edge_tracking.local_graph import LocalGraph
from glass_nav.geometry.polyline import Polyline

_AHEAD_M = 0.4  # of the robot, where its edge is told from others
_FOOT_M = 0.4  # the line moves by no more from one graph to the next


def line_now(leg: Leg, graph: LocalGraph, way: Polyline, here: np.ndarray) -> Optional[Tuple[Polyline, int, int]]:
    """The edge that the robot follows as the graph has it now: its line, the node ahead and the one behind.

    Looked up a little ahead of the robot: beside a node all its edges are near.
    """
    passed_m = way.nearest(here)
    at = passed_m + min(_AHEAD_M, 0.5 * (way.length - passed_m))
    along = way.direction(at)
    foot = graph.foot(way.at(at), _FOOT_M, along)
    if foot is None:
        return None
    ahead = graph.ahead(foot, along)
    counts = leg.counts(graph)
    if leg.trace is not None and leg.start is not None and leg.trace.length_m < BEHIND_M:
        away = np.hypot(*(graph.graph.position_m - leg.start.position_m).T)
        counts = counts & (away > leg.near_start_m)
    onward, node = graph.walk(ahead, counts)
    found = line(np.concatenate([ahead.back_m[:0:-1], onward]))
    return None if found is None else (found, node, ahead.back_node)
