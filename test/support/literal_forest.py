"""The document's forest, built word for word: a second implementation for the tests, slow and without arrays.

global_localization_procedure.txt, "The Algorithm". Every edge of every active search node gives a search edge and a
search node in the next row; then those that mismatch are marked inactive. Nothing is shared with the package but the
atlas itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import List, Optional, Set

from glass_nav.topology.atlas.atlas import Atlas


@dataclass
class SearchEdge:
    """A possible path between search nodes."""

    dart: int  # by which it leaves


@dataclass
class SearchNode:
    """A candidate for a match node."""

    node: int
    parent: Optional["SearchNode"]
    edge: Optional[SearchEdge]  # that leads here
    active: bool = True

    @property
    def arrival(self) -> int:
        assert self.edge is not None
        return self.edge.dart ^ 1


@dataclass
class Observed:
    """A match edge and the match node at its end; the first has no edge."""

    degree: int
    r_m: float
    rank: int = 0  # of the turn by which the edge began
    length_m: float = 0.0
    chord_m: float = 0.0


class LiteralForest:
    """Rows of search nodes."""

    def __init__(
        self, atlas: Atlas, z: float, sigma_r_m: float, sigma_length_m: float, sigma_length_share: float
    ) -> None:
        self._atlas, self._z = atlas, z
        self._sigma_r, self._sigma, self._share = sigma_r_m, sigma_length_m, sigma_length_share
        self.rows: List[List[SearchNode]] = []

    def begin(self, seen: Observed) -> None:
        self.rows = [
            [SearchNode(node, None, None) for node in range(len(self._atlas.nodes)) if self._node_matches(node, seen)]
        ]

    def step(self, seen: Observed) -> None:
        row = []
        for candidate in self.rows[-1]:
            if candidate.active:
                for dart in self._atlas.rings[candidate.node].tolist():
                    end = int(self._atlas.darts.node[int(dart) ^ 1])
                    row.append(SearchNode(end, candidate, SearchEdge(int(dart))))
        for candidate in row:
            candidate.active = (
                self._node_matches(candidate.node, seen)
                and self._edge_matches(candidate, seen)
                and self._turn_matches(candidate, seen)
            )
        self.rows.append(row)

    def active_nodes(self) -> Set[int]:
        return {candidate.node for candidate in self.rows[-1] if candidate.active}

    def active_arrivals(self) -> List[int]:
        return sorted(candidate.arrival for candidate in self.rows[-1] if candidate.active)

    def _node_matches(self, node: int, seen: Observed) -> bool:
        nodes = self._atlas.nodes
        allowed = self._z * math.hypot(self._sigma_r, float(nodes.sigma_r_m[node]))
        return len(self._atlas.rings[node]) == seen.degree and abs(float(nodes.r_m[node]) - seen.r_m) <= allowed

    def _edge_matches(self, candidate: SearchNode, seen: Observed) -> bool:
        assert candidate.edge is not None
        edge, edges = candidate.edge.dart // 2, self._atlas.edges
        allowed = self._z * math.hypot(self._sigma + self._share * seen.length_m, float(edges.sigma_m[edge]))
        return (
            abs(float(edges.length_m[edge]) - seen.length_m) <= allowed
            and abs(float(edges.chord_m[edge]) - seen.chord_m) <= allowed
        )

    def _turn_matches(self, candidate: SearchNode, seen: Observed) -> bool:
        assert candidate.edge is not None and candidate.parent is not None
        if candidate.parent.edge is None:
            return True  # "at depth 0 the match edge selected to depart is arbitrary"
        ring = self._atlas.rings[candidate.parent.node].tolist()
        turned = (ring.index(candidate.edge.dart) - ring.index(candidate.parent.arrival)) % len(ring)
        return bool(turned == seen.rank)
