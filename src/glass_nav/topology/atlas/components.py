"""The connected components of a graph."""

from __future__ import annotations

from typing import Tuple

import numpy as np


def connected(count: int, first: np.ndarray, second: np.ndarray) -> Tuple[int, np.ndarray]:
    """How many parts do not touch, and (N,) in which of them each node lies.

    Args:
        count: N, of the nodes.
        first, second: (E,) nodes that each edge joins.
    """
    from scipy.sparse import coo_matrix, csgraph  # slow to import

    links = coo_matrix((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    parts, label = csgraph.connected_components(links, directed=False)
    return int(parts), label
