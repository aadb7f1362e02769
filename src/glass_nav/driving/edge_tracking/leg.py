"""The current state of the edge driver: its phase, its line, and what it has measured so far."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import List, Optional

import numpy as np

from glass_nav.driving.edge_tracking.edge_report import Node, Trace
from glass_nav.driving.edge_tracking.local_graph import LocalGraph
from glass_nav.geometry import polyline
from glass_nav.geometry.polyline import Polyline
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import DriverPhase, Outcome

SAME_NODE_M = 0.3  # a node moves by no more from one graph to the next
BEHIND_M = 1.0  # a node that shows only once the robot is past it
DOUBT_M = 0.15  # an obstacle that is further from any wall may not be seen in full
_SHORT_EDGE_M = 0.7  # along a longer edge no node follows within
_SPLIT_M = 0.6  # so much: it would be a part of the one that the robot left


@dataclass
class Leg:
    """One order: seeking, following an edge with homing at its end, returning, or standing."""

    phase: DriverPhase
    reason: str
    start: Optional[Node]  # the meetpoint where the robot stands, or which it left last
    yaw_rad: float  # at the last command
    failure: Optional[Outcome] = None
    way: Optional[Polyline] = None  # that it drives along; None: none known yet
    trace: Optional[Trace] = None  # of the edge so far; None: no edge that began at a meetpoint
    rank: int = 0  # by which the edge left
    join_m: float = 0.0  # so much of the way leads to the graph, along no edge
    near_start_m: float = SAME_NODE_M  # nodes so near to its beginning are that
    swept: bool = False  # it has turned round once to see more
    sweep_rad: float = 0.0  # what is left of that turn
    blocked_s: float = 0.0
    lost_since_ns: int = 0  # no graph has had its line since then; 0: the last one has
    # homing
    target_m: np.ndarray = field(default_factory=lambda: np.zeros(2))  # (2,) the node that it homes to
    looking: bool = False  # it stands there, or brakes, and looks
    looks: int = 0  # graphs since then
    nodes: List[Node] = field(default_factory=list)  # what was there in these
    scans: List[Scan] = field(default_factory=list)  # seen while it stands there
    dismissed_m: List[np.ndarray] = field(default_factory=list)  # (2,) places that turned out to be no nodes

    def follow(self, node: Node, rank: int) -> None:
        """Follow the edge of that rank."""
        self.rank = rank
        self.way = line(node.branches[rank].way_m)
        self.trace = Trace(node.position_m)
        short = self.way is None or self.way.length < _SHORT_EDGE_M
        self.near_start_m = SAME_NODE_M if short else _SPLIT_M

    def look_around(self) -> None:
        """Turn round once, before anything else."""
        self.sweep_rad = 2.0 * np.pi

    def counts(self, graph: LocalGraph) -> np.ndarray:
        """(N,) bool: nodes that may be meetpoints; those that turned out to be none on this edge are not."""
        counts = graph.degree != 2
        for none in self.dismissed_m:
            counts &= np.hypot(*(graph.graph.position_m - none).T) > SAME_NODE_M
        return counts

    def is_start(self, graph: LocalGraph, node: int) -> bool:
        """Whether the node is the one that the edge began at, with little of the edge behind the robot."""
        if self.trace is None or self.start is None:
            return False
        there = graph.graph.position_m[node] - self.start.position_m
        return float(np.hypot(*there)) < self.near_start_m and self.trace.length_m < 2.0 * BEHIND_M


def line(points_m: np.ndarray) -> Optional[Polyline]:
    """The line through points (n, 2); None if they are all one."""
    points = polyline.distinct(points_m)
    return Polyline(points) if len(points) > 1 else None
