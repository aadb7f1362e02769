"""Removes the branches of the Voronoi ridges that end in corners."""

from __future__ import annotations

import heapq
import math
from typing import Dict, List, Tuple

import numpy as np

from glass_nav.geometry import polyline
from glass_nav.topology.atlas.voronoi.ridges import Ridges

CORNER = 0.5  # r falls by more than this share of the distance into a corner of 60 degrees or more,
CORNER_SLACK_CELLS = 2.0  # unless by so much walls are rough


class Chains:
    """The raw graph as junctions, ends and the chains of plain vertices between them; prune() removes twigs.

    A leaf ends before it runs into a corner: a corridor ends in the middle, not in the corner whose twig was pruned
    last.
    """

    def __init__(self, ridges: Ridges) -> None:
        self._r = ridges.r.tolist()
        self._at_xy = ridges.points.tolist()
        self._chains = _chains(ridges)  # vertices of each chain, both ends included
        self._ends = [[chain[0], chain[-1]] for chain in self._chains]
        self._length = [polyline.length(ridges.points[chain]) for chain in self._chains]
        self._parts: List[List[Tuple[int, bool]]] = [[(number, False)] for number in range(len(self._chains))]
        self._alive = [True] * len(self._chains)
        self._at: Dict[int, List[int]] = {}  # chains at each junction or end; a loop is there twice
        for number, (first, last) in enumerate(self._ends):
            self._at.setdefault(first, []).append(number)
            self._at.setdefault(last, []).append(number)

    def prune(self, leaf: float, share_of_r: float) -> None:
        """Remove leaves with length + r_end - r_junction < max(leaf, share r_junction), least salient first."""
        twigs: List[Tuple[float, int]] = []

        def judge(number: int) -> None:
            side = self._free_end(number)
            if side >= 0:
                junction_r = self._r[self._ends[number][1 - side]]
                _, corner, end_r = self._corner(number, side)
                salience = self._length[number] - corner + end_r - junction_r
                if salience < max(leaf, share_of_r * junction_r):
                    heapq.heappush(twigs, (salience, number))

        for number in range(len(self._chains)):
            judge(number)
        while twigs:
            _, number = heapq.heappop(twigs)
            side = self._free_end(number) if self._alive[number] else -1
            if side < 0:
                continue
            junction = self._ends[number][1 - side]
            self._remove(number)
            left = self._at[junction]
            if len(left) == 2 and left[0] != left[1]:
                judge(self._join(left[0], left[1], junction))

    def kept(self) -> List[np.ndarray]:
        """Vertices (n,) of each chain that is left, both ends included, n >= 2."""
        kept = []
        for number in np.flatnonzero(self._alive).tolist():
            vertices = self._vertices(number)
            first, last = (
                self._corner(number, side)[0] if len(self._at[self._ends[number][side]]) == 1 else 0 for side in (0, 1)
            )
            first = min(first, len(vertices) - 2)
            kept.append(vertices[first : max(len(vertices) - last, first + 2)])
        return kept

    def _free_end(self, number: int) -> int:
        """Which end of a chain is free: 0, 1; -1 for neither or both."""
        free = [len(self._at[end]) == 1 for end in self._ends[number]]
        return free.index(True) if free[0] != free[1] else -1

    def _corner(self, number: int, side: int) -> Tuple[int, float, float]:
        """How far an end of a chain runs into a corner: in vertices, as a length, and r where it begins to."""
        parts = self._parts[number]
        end = self._ends[number][side]
        before, along = end, 0.0
        count, best, corner = 0, self._r[end], (0, 0.0, self._r[end])
        for part, back in reversed(parts) if side else parts:
            chain = self._chains[part]
            for vertex in (chain[-2::-1] if back != bool(side) else chain[1:]).tolist():
                along += math.hypot(
                    self._at_xy[vertex][0] - self._at_xy[before][0], self._at_xy[vertex][1] - self._at_xy[before][1]
                )
                before, count = vertex, count + 1
                rise = self._r[vertex] - CORNER * along
                if rise > best:
                    best, corner = rise, (count, along, self._r[vertex])
                elif rise < best - CORNER_SLACK_CELLS:
                    return corner
        return corner

    def _remove(self, number: int) -> None:
        self._alive[number] = False
        for end in self._ends[number]:
            self._at[end].remove(number)

    def _join(self, first: int, second: int, junction: int) -> int:
        """Joins two chains that meet where nothing else does."""
        turned = self._ends[first][0] == junction, self._ends[second][1] == junction
        parts = [
            [(part, back != turn) for part, back in self._parts[number][:: -1 if turn else 1]]
            for number, turn in zip((first, second), turned)
        ]
        ends = [self._ends[first][1 if turned[0] else 0], self._ends[second][0 if turned[1] else 1]]
        self._remove(first)
        self._remove(second)
        self._ends.append(ends)
        self._length.append(self._length[first] + self._length[second])
        self._parts.append(parts[0] + parts[1])
        self._alive.append(True)
        for end in ends:
            self._at[end].append(len(self._ends) - 1)
        return len(self._ends) - 1

    def _vertices(self, number: int) -> np.ndarray:
        pieces = [self._chains[part][::-1] if back else self._chains[part] for part, back in self._parts[number]]
        return np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])


def _chains(ridges: Ridges) -> List[np.ndarray]:
    """Chains of vertices of degree 2 between others; a ring of such starts and ends where it is widest."""
    links = len(ridges.links)
    ends = np.concatenate([ridges.links[:, 0], ridges.links[:, 1]])
    order = np.argsort(ends, kind="stable")
    degrees = np.bincount(ends, minlength=len(ridges.r))
    start = np.concatenate([[0], np.cumsum(degrees)]).tolist()
    link_at = (order % max(links, 1)).tolist()
    beyond_at = np.concatenate([ridges.links[:, 1], ridges.links[:, 0]])[order].tolist()
    degree = degrees.tolist()
    walked = [False] * links

    def walk(vertex: int, place: int) -> np.ndarray:
        chain = [vertex]
        first = vertex
        while True:
            walked[link_at[place]] = True
            vertex = beyond_at[place]
            chain.append(vertex)
            if degree[vertex] != 2 or vertex == first:
                return np.array(chain)
            place = start[vertex] + (1 if walked[link_at[start[vertex]]] else 0)

    chains = []
    for vertex in np.flatnonzero((degrees > 0) & (degrees != 2)).tolist():
        for place in range(start[vertex], start[vertex + 1]):
            if not walked[link_at[place]]:
                chains.append(walk(vertex, place))
    plain = np.flatnonzero(degrees == 2)
    for vertex in plain[np.argsort(-ridges.r[plain], kind="stable")].tolist():
        if not walked[link_at[start[vertex]]]:
            chains.append(walk(vertex, start[vertex]))
    return chains
