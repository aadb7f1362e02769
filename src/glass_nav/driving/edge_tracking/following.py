"""Finds in a new graph the line along which the robot continues: its edge, or the way to any meetpoint."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np

from glass_nav.driving.edge_tracking import homing
from glass_nav.driving.edge_tracking.edge_line import line_now
from glass_nav.driving.edge_tracking.leg import BEHIND_M, DOUBT_M, Leg, line
from glass_nav.driving.edge_tracking.local_graph import LocalGraph
from glass_nav.driving.edge_tracking.surroundings import Surroundings
from glass_nav.vocabulary import DriverPhase

LOOKAHEAD_M = 0.35
_TO_GRAPH_M = 15.0  # the graph may be so far away at the beginning, beside the wall of a hall
_LOST_LINE_S = 3.0  # driven on along the last line, without a graph that has it


def follow(leg: Leg, near: Surroundings, graph: LocalGraph) -> Optional[str]:
    """Renew the line, or begin to home to the node at its end. Returns why there is no line any more, else None."""
    here = near.pose[:2]
    if leg.way is None:
        return (
            None
            if _join_graph(leg, near, graph)
            else _without_line(leg, near, "no edge nearby can be reached in a straight line")
        )
    if leg.way.nearest(here) < leg.join_m - LOOKAHEAD_M:
        return None
    leg.join_m = 0.0
    found = line_now(leg, graph, leg.way, here)
    if found is None:
        return _without_line(leg, near, "the edge is no longer seen")
    leg.lost_since_ns = 0
    way, node, behind = found
    passed_m, position = way.nearest(here), graph.graph.position_m
    if passed_m < BEHIND_M and leg.counts(graph)[behind] and not leg.is_start(graph, behind):
        if leg.trace is not None:
            leg.trace.cut_back(position[behind])
        homing.begin(leg, near, position[behind], way.part(passed_m, 0.0))
        return None
    if leg.trace is not None and passed_m > 0.0:
        leg.trace.add(way.at(passed_m))
    leg.way = way
    if way.length - passed_m < 2.0 * LOOKAHEAD_M and not leg.is_start(graph, node):
        homing.begin(leg, near, position[node], way.part(passed_m, way.length))
    return None


def _join_graph(leg: Leg, near: Surroundings, graph: LocalGraph) -> bool:
    """Line to the graph and along it to the nearest meetpoint; False if the graph is out of reach."""
    here = near.pose[:2]
    foot = graph.foot(here, _TO_GRAPH_M)
    if foot is None:
        return False
    heading = np.array([math.cos(near.pose[2]), math.sin(near.pose[2])])
    ways = []
    for along in (heading, -heading):
        way, node = graph.walk(graph.ahead(foot, along), leg.counts(graph))
        doubtful = graph.graph.doubt_m[node] > DOUBT_M
        ways.append((doubtful, len(way), way))  # its points are evenly apart
    leg.way = line(np.concatenate([here[None], min(ways, key=lambda found: found[:2])[2]]))
    leg.join_m = float(np.hypot(*(graph.point(foot) - here)))
    leg.reason = "to the nearest meetpoint"
    return True


def _without_line(leg: Leg, near: Surroundings, why: str) -> Optional[str]:
    """Drive on for a while, then look around once, then fail."""
    if not leg.lost_since_ns:
        leg.lost_since_ns = near.stamp_ns
    elif near.stamp_ns - leg.lost_since_ns > _LOST_LINE_S * 1e9:
        if leg.swept:
            return f"{why}, even after looking around"
        leg.swept, leg.lost_since_ns = True, 0
        leg.look_around()
        if leg.phase == DriverPhase.SEEKING:  # any other edge will do
            leg.way = None
    return None
