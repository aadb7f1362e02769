"""Merges meetpoints that no lidar can tell apart, and leaves out small parts of the graph."""

from __future__ import annotations

import heapq
from typing import Dict, List, Sequence

import numpy as np

from glass_nav.geometry import polyline
from glass_nav.topology.atlas import components
from glass_nav.topology.atlas.voronoi.bounds import Bounds
from glass_nav.topology.atlas.voronoi.ridges import Ridges


class Meetpoints:
    """Nodes and lines between them; merge() joins nodes that are too close to tell apart."""

    def __init__(self, bounds: Bounds, ridges: Ridges, chains: Sequence[np.ndarray]) -> None:
        self.lines = [ridges.points[chain] for chain in chains]
        self.ends = [[int(chain[0]), int(chain[-1])] for chain in chains]
        self.members = {end: [end] for ends in self.ends for end in ends}  # vertices that each node is made of
        self.position = {node: ridges.points[node] for node in self.members}
        self._r = {node: float(ridges.r[node]) for node in self.members}
        self._obstacles = {node: bounds.points[ridges.generator[node]] for node in self.members}
        self._at: Dict[int, List[int]] = {node: [] for node in self.members}
        for edge, ends in enumerate(self.ends):
            for end in ends:
                self._at[end].append(edge)
        self._length = [polyline.length(line) for line in self.lines]
        self.edges = set(range(len(self.lines)))

    def merge(self, least: float, tolerance: float) -> None:
        """Contract edges that no robot can tell from a point, the shortest first; their neighbours grow."""

        def further(node: int, other: int) -> float:
            """By how much the obstacles of the other node are further away from this one than its own."""
            away = np.hypot(*(self._obstacles[other] - self.position[node]).T)
            return float(away.max()) - self._r[node]

        def too_short(edge: int) -> bool:
            first, second = self.ends[edge]
            return first != second and (
                self._length[edge] < least or max(further(first, second), further(second, first)) < tolerance
            )

        short = [(self._length[edge], edge) for edge in self.edges if too_short(edge)]
        heapq.heapify(short)
        while short:
            length, edge = heapq.heappop(short)
            if edge in self.edges and length == self._length[edge] and too_short(edge):
                for changed in self._contract(edge):
                    if too_short(changed):
                        heapq.heappush(short, (self._length[changed], changed))

    def drop_small(self, least: float) -> int:
        """Leave out parts with a smaller total length, or none; returns their number."""
        edges = sorted(self.edges)
        number = {node: index for index, node in enumerate(self.members)}
        count, part = components.connected(
            len(number),
            np.array([number[self.ends[edge][0]] for edge in edges], int),
            np.array([number[self.ends[edge][1]] for edge in edges], int),
        )
        of_edge = np.array([part[number[self.ends[edge][0]]] for edge in edges], int)
        length = np.bincount(of_edge, [self._length[edge] for edge in edges], minlength=count)
        small = (length < least) | (length == 0.0)
        self.edges -= {edge for edge, its in zip(edges, of_edge.tolist()) if small[its]}
        self.members = {node: members for node, members in self.members.items() if not small[part[number[node]]]}
        return int(small.sum())

    def _contract(self, edge: int) -> List[int]:
        """Both ends of an edge become one node between them, or the junction if one is a dead end. Returns the edges
        whose length changed.
        """
        kept, gone = sorted(self.ends[edge], key=lambda node: -len(self._at[node]))
        self._forget(edge)
        if not self._at[gone]:
            del self._at[gone], self.members[gone]
            return self._dissolve(kept) if len(self._at[kept]) == 2 else []
        count = len(self.members[kept]), len(self.members[gone])
        shares = np.array(count) / sum(count)
        centre = shares[0] * self.position[kept] + shares[1] * self.position[gone]
        for node in (kept, gone):
            for other in set(self._at[node]):
                self._move_end(other, node, centre)
        self.position[kept] = centre
        self._r[kept] = shares[0] * self._r[kept] + shares[1] * self._r[gone]
        self.members[kept] += self.members.pop(gone)
        self._obstacles[kept] = np.concatenate([self._obstacles[kept], self._obstacles.pop(gone)])
        for other in set(self._at[gone]):
            self.ends[other] = [kept if end == gone else end for end in self.ends[other]]
        self._at[kept] += self._at.pop(gone)
        return sorted(set(self._at[kept]))

    def _move_end(self, edge: int, node: int, centre: np.ndarray) -> None:
        """Let the line of an edge end at the centre, not at the node; points nearer to it than the node are cut off."""
        for side in (0, 1):
            if self.ends[edge][side] == node:
                line = self.lines[edge][::-1] if side else self.lines[edge]
                away = np.hypot(*(line - centre).T)
                beyond = np.flatnonzero(away[1:-1] > away[0]) + 1
                inner = line[beyond[0] : -1] if len(beyond) else line[:0]
                line = np.concatenate([centre[None], inner, line[-1:]])
                self.lines[edge] = line[::-1] if side else line
        self._length[edge] = polyline.length(self.lines[edge])

    def _dissolve(self, node: int) -> List[int]:
        """Remove a node of degree 2, unless it is the only one on a ring."""
        first, second = self._at[node]
        if first == second:
            return [first]
        lines = [
            self.lines[first] if self.ends[first][1] == node else self.lines[first][::-1],
            self.lines[second] if self.ends[second][0] == node else self.lines[second][::-1],
        ]
        ends = [
            self.ends[first][0 if self.ends[first][1] == node else 1],
            self.ends[second][1 if self.ends[second][0] == node else 0],
        ]
        self._forget(first)
        self._forget(second)
        del self._at[node], self.members[node]
        joined = len(self.lines)
        self.lines.append(np.concatenate([lines[0], lines[1][1:]]))
        self.ends.append(ends)
        self._length.append(polyline.length(self.lines[joined]))
        self.edges.add(joined)
        for end in ends:
            self._at[end].append(joined)
        return [joined]

    def _forget(self, edge: int) -> None:
        self.edges.remove(edge)
        for end in self.ends[edge]:
            self._at[end].remove(edge)
