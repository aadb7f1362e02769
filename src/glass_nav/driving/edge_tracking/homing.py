"""The last stretch to a node of the graph, and the decision whether it is a meetpoint.

A node seen from afar may turn out otherwise, so it counts only if several graphs in a row have it.
"""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
from scipy.spatial import cKDTree

from glass_nav.driving.edge_tracking import edge_report, moving_things
from glass_nav.driving.edge_tracking.edge_line import line_now
from glass_nav.driving.edge_tracking.edge_report import Node
from glass_nav.driving.edge_tracking.leg import BEHIND_M, DOUBT_M, SAME_NODE_M, Leg, line
from glass_nav.driving.edge_tracking.local_graph import LocalGraph
from glass_nav.driving.edge_tracking.surroundings import Surroundings
from glass_nav.geometry import angles, se2
from glass_nav.vocabulary import DriverPhase

_LOOKS = 4  # graphs that must agree on a meetpoint: over a second, people walk on
_MAX_LOOKS = 9  # then it is none
_SAME_WAY_RAD = 0.2  # an obstacle that is not seen any more was what moves now, if it moves behind it
_OBSTACLE_M = 0.3  # what is no farther away than r and this is one of the obstacles of a node


def begin(leg: Leg, near: Surroundings, target_m: np.ndarray, way_m: np.ndarray) -> None:
    """Drive to a node (2,) along points (n, 2)."""
    leg.phase, leg.reason = DriverPhase.HOMING, "to the meetpoint"
    leg.target_m = np.array(target_m, float)
    leg.way = line(way_m)
    if leg.way is None:
        leg.way = line(np.stack([near.pose[:2], target_m]))
    leg.blocked_s = 0.0
    leg.looking, leg.looks, leg.nodes, leg.scans = False, 0, [], []


def begin_looking(leg: Leg) -> None:
    """The robot is there: brake, and look."""
    leg.looking, leg.looks, leg.nodes, leg.scans = True, 0, [], []
    leg.reason = "checking whether this is a meetpoint"


def correct_target(leg: Leg, near: Surroundings, graph: LocalGraph) -> None:
    """A new graph on the way there: the node may have moved, or be gone."""
    node = graph.node_near(leg.target_m, SAME_NODE_M)
    if node is None or not leg.counts(graph)[node]:
        leg.looks += 1
        if leg.looks > _LOOKS and not _turn_back_to_end(leg, near, graph):
            _dismiss(leg)
        return
    leg.looks = 0
    leg.target_m = graph.graph.position_m[node]
    here, way = near.pose[:2], leg.way
    assert way is not None
    found = line_now(leg, graph, way, here)
    if found is not None and found[1] == node:
        way = found[0]
    else:
        way = line(np.concatenate([way.points[:-1], leg.target_m[None]])) or way
    leg.way = way
    if leg.trace is not None:
        leg.trace.add(way.at(way.nearest(here)))


def look_again(leg: Leg, near: Surroundings, graph: LocalGraph) -> Optional[Node]:
    """A new graph while the robot stands there. Returns the meetpoint once it is sure of one."""
    leg.looks += 1
    node = graph.node_near(leg.target_m, SAME_NODE_M)
    if node is not None:
        leg.nodes.append(_node_of(leg, near, graph, node))
        latest = [found for found in leg.nodes if found.degree == leg.nodes[-1].degree]
        if len(latest) >= _LOOKS and not _something_moves_at(leg, near, latest[-1]):
            if graph.graph.doubt_m[node] > DOUBT_M and not leg.swept:
                leg.swept = True
                leg.look_around()
                begin_looking(leg)
                return None
            return latest[-1]
    if leg.looks >= _MAX_LOOKS and not _turn_back_to_end(leg, near, graph):
        _dismiss(leg)
    return None


def _something_moves_at(leg: Leg, near: Surroundings, node: Node) -> bool:
    """Whether one of the obstacles that make the node was seen to move, or to leave: a person."""
    moved = se2.transform_points(near.pose, moving_things.moved_m(leg.scans)) - node.position_m
    reach_m = node.r_m + _OBSTACLE_M
    if (np.hypot(*moved.T) < reach_m).any():
        return True
    left = near.unseen_walls_m(near.pose) - node.position_m  # the map forgets slowly
    left = left[np.hypot(*left.T) < reach_m]
    off_rad = angles.wrap(np.arctan2(left[:, 1], left[:, 0])[:, None] - np.arctan2(moved[:, 1], moved[:, 0]))
    return bool((np.abs(off_rad) < _SAME_WAY_RAD).any())


def _turn_back_to_end(leg: Leg, near: Surroundings, graph: LocalGraph) -> bool:
    """Back to a dead end, if the robot is past it: a passage that narrows ends the sooner the better it is seen."""
    if leg.trace is None:
        return False
    position, here = graph.graph.position_m, near.pose[:2]
    ends = np.flatnonzero((graph.degree == 1) & leg.counts(graph) & (np.hypot(*(position - leg.target_m).T) < BEHIND_M))
    trace = cKDTree(leg.trace.way_m)
    for node in ends[np.argsort(np.hypot(*(position[ends] - here).T))].tolist():
        passed = trace.query(position[node])[0] < SAME_NODE_M
        if passed and not leg.is_start(graph, node) and graph.sees(here, position[node]):
            leg.trace.cut_back(position[node])
            begin(leg, near, position[node], np.stack([here, position[node]]))
            return True
    return False


def _dismiss(leg: Leg) -> None:
    leg.dismissed_m.append(leg.target_m)
    leg.phase = DriverPhase.FOLLOWING if leg.trace is not None else DriverPhase.SEEKING
    leg.looking, leg.reason = False, "the apparent meetpoint is none"


def _node_of(leg: Leg, near: Surroundings, graph: LocalGraph, node: int) -> Node:
    found, position = graph.graph, graph.graph.position_m[node]
    branches = graph.branches(node)
    if leg.trace is not None:
        past = edge_report.bearing_back(leg.trace.line_m(position))
    else:
        past = float(near.pose[2]) + math.pi
    return Node(
        position,
        float(found.r_m[node]),
        edge_report.sigma_r_m(float(found.spread_m[node]), math.hypot(float(found.doubt_m[node]), near.coarse_m)),
        edge_report.ranked(branches, past),
    )
