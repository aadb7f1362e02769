"""The Voronoi graph around the robot: its position on it, the way ahead, the branches of a node.

Coordinates are those of the grid, odom. A line (n, 2) runs from the robot along an edge to a node.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import List, Optional, Tuple

import numpy as np

from glass_nav.topology.atlas import atlas_builder, voronoi_graph
from glass_nav.topology.atlas.voronoi.graph import VoronoiGraph
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams
from glass_nav.world.grid_map import GridMap

_THICKER_M = 0.03  # walls of the local map than those of a drawn one: noise of the ranges
_ALONG_COS = 0.35  # an edge that turns away by more than 70 degrees is another one


@dataclass(frozen=True)
class Ahead:
    """An edge from a point of it to the node at its end."""

    way_m: np.ndarray  # (n, 2), the point first
    node: int  # where it ends
    edge: int
    end: int  # 1: it runs as the edge's line does; 0: against it
    back_m: np.ndarray  # (k, 2) the rest of the edge, from the point to the node at the other end
    back_node: int


@dataclass(frozen=True)
class Branch:
    """An edge as it leaves a node."""

    bearing_rad: float  # as in the atlas, from the node to the point BEARING_AT_M along
    way_m: np.ndarray  # (n, 2) from the node on


def params_beside(atlas: VoronoiParams) -> VoronoiParams:
    """Parameters of the local graph, to match an atlas that was built with the given ones."""
    return replace(atlas, passage_margin_m=max(atlas.passage_margin_m - _THICKER_M, 0.0))


def in_sight(grid: GridMap, from_m: np.ndarray, to_m: np.ndarray) -> bool:
    """Whether nothing of a map stands on the straight line between two points (2,) in it."""
    count = int(np.hypot(*(to_m - from_m)) / (0.5 * grid.resolution_m)) + 2
    points = from_m + np.linspace(0.0, 1.0, count)[:, None] * (to_m - from_m)
    rows, columns = grid.cells(points)
    inside = grid.contains(rows, columns)
    return bool(inside.all()) and not grid.occupied[rows, columns].any()


class LocalGraph:
    """The graph of one state of the local map."""

    def __init__(self, grid: GridMap, params: VoronoiParams) -> None:
        self._grid = grid
        self.graph: VoronoiGraph = voronoi_graph.build(grid, params)
        self.degree = self.graph.degree
        lines = self.graph.lines_m
        self._edge = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
        self._index = np.concatenate([np.arange(len(line)) for line in lines]) if lines else np.zeros(0, int)
        self._points = np.concatenate(lines) if lines else np.zeros((0, 2))
        self._tangents = np.concatenate([_tangents(line) for line in lines]) if lines else np.zeros((0, 2))

    def __len__(self) -> int:
        return len(self.graph.lines_m)

    def foot(self, point_m: np.ndarray, within_m: float, along: Optional[np.ndarray] = None) -> Optional[int]:
        """Index of the nearest point of the graph that can be reached straight on.

        Args:
            point_m: (2,).
            within_m: no further away than this.
            along: (2,) unit vector; edges that do not run that way or the opposite way are left out.
        """
        if not len(self._points):
            return None
        away = np.hypot(*(self._points - point_m).T)
        if along is not None:
            away = np.where(np.abs(self._tangents @ along) >= _ALONG_COS, away, np.inf)
        for index in np.argsort(away, kind="stable")[:200:8].tolist():
            if away[index] > within_m:
                return None
            if self.sees(point_m, self._points[index]):
                return int(index)
        return None

    def point(self, foot: int) -> np.ndarray:
        """(2,) of the graph, by its index."""
        return self._points[foot]

    def sees(self, from_m: np.ndarray, to_m: np.ndarray) -> bool:
        """Whether nothing stands on the straight way."""
        return in_sight(self._grid, from_m, to_m)

    def ahead(self, foot: int, along: np.ndarray) -> Ahead:
        """The line from a point of the graph onwards in a direction (2,)."""
        edge, index = int(self._edge[foot]), int(self._index[foot])
        line, (first, last) = self.graph.lines_m[edge], self.graph.edge_node[edge].tolist()
        if self._tangents[foot] @ along >= 0.0:
            return Ahead(line[index:], last, edge, 1, line[index::-1], first)
        return Ahead(line[index::-1], first, edge, 0, line[index:], last)

    def node_near(self, point_m: np.ndarray, within_m: float) -> Optional[int]:
        """The nearest node that is no plain point of a ring."""
        if not len(self.degree):
            return None
        away = np.where(self.degree != 2, np.hypot(*(self.graph.position_m - point_m).T), np.inf)
        nearest = int(away.argmin())
        return nearest if away[nearest] <= within_m else None

    def branches(self, node: int) -> List[Branch]:
        """Ways that leave a node, clockwise seen from above; a loop is there twice."""
        found: List[Branch] = []
        for line, ends in zip(self.graph.lines_m, self.graph.edge_node.tolist()):
            bearings = atlas_builder.bearings(line)
            found += [Branch(bearings[side], line[::-1] if side else line) for side in (0, 1) if ends[side] == node]
        return sorted(found, key=lambda branch: -branch.bearing_rad)

    def walk(self, start: Ahead, wanted: "np.ndarray") -> Tuple[np.ndarray, int]:
        """The line from there on to the next node whose flag (N,) is set, straight on at others; or to where it ends."""
        way, node, edge, end = start.way_m, start.node, start.edge, start.end
        for _ in range(len(self)):
            if wanted[node] or self.degree[node] == 1:
                break
            onward = self._straight_on(node, edge, end, way)
            if onward is None:
                break
            edge, end, line = onward
            way, node = np.concatenate([way, line[1:]]), int(self.graph.edge_node[edge, end])
        return way, node

    def _straight_on(self, node: int, edge: int, end: int, way: np.ndarray) -> Optional[Tuple[int, int, np.ndarray]]:
        heading = direction_at_end(way)
        best, chosen = -2.0, None
        for other, ends in enumerate(self.graph.edge_node.tolist()):
            for side in (0, 1):
                if ends[side] != node or (other == edge and side == end):
                    continue
                line = self.graph.lines_m[other][::-1] if side else self.graph.lines_m[other]
                bearing = atlas_builder.bearings(line)[0]
                cos = math.cos(bearing) * heading[0] + math.sin(bearing) * heading[1]
                if cos > best:
                    best, chosen = cos, (other, 1 - side, line)
        return chosen


def direction_at_end(way_m: np.ndarray) -> np.ndarray:
    """(2,) unit vector in which a line (n, 2) arrives, over its last half metre."""
    bearing = atlas_builder.bearings(way_m[::-1])[0]
    return -np.array([math.cos(bearing), math.sin(bearing)])


def _tangents(line: np.ndarray) -> np.ndarray:
    """(n, 2) unit vectors along a line (n, 2), over a few of its points."""
    reach = min(4, len(line) - 1)
    index = np.arange(len(line))
    step = line[np.minimum(index + reach, len(line) - 1)] - line[np.maximum(index - reach, 0)]
    return step / np.maximum(np.hypot(*step.T), 1e-9)[:, None]
