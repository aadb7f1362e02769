"""The candidate place of a search, from its first single candidate on, and the edges that confirm it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Set, Tuple

import numpy as np

from glass_nav.topology.atlas.atlas import Atlas

_TREE_EDGES = 2000  # searched for an edge that was not driven yet


@dataclass(frozen=True)
class Claim:
    """The first depth at which one candidate was left, or several that nothing tells apart."""

    depth: int
    dart: np.ndarray  # (C,)
    driven: Set[int]  # edges by then

    def holds(self, path: List[Tuple[int, int, bool]], count: int) -> bool:
        """Whether as many candidates, one of which came by this path, come from what was claimed."""
        return count == len(self.dart) and any(depth == self.depth and dart in self.dart for depth, dart, _ in path)

    def confirmed(self, driven: Set[int], depth: int) -> int:
        """Edges that have matched since then and were new; at most one for each step."""
        return min(len(driven - self.driven), depth - self.depth)


def turn_to_new_edge(atlas: Atlas, dart: int, driven: Set[int]) -> Optional[int]:
    """Rank of the turn that leads soonest to an edge that was not driven; None if there is no such edge.

    Breadth first over the few edges around; back only if nothing else is near.

    Args:
        atlas: of the building.
        dart: at which the robot arrived.
        driven: edges.
    """
    seen, queue = {dart}, [(dart, -1)]
    for at, first in queue:  # grows
        ring = atlas.rings[int(atlas.darts.node[at])]
        degree = len(ring)
        for rank in [*range(1, degree), 0]:
            departure = int(ring[(int(atlas.rank[at]) + rank) % degree])
            begun = rank if first < 0 else first
            if departure >> 1 not in driven:
                return begun
            arrival = departure ^ 1
            if arrival not in seen and len(seen) < _TREE_EDGES:
                seen.add(arrival)
                queue.append((arrival, begun))
    return None
