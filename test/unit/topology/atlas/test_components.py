from __future__ import annotations

import numpy as np

from glass_nav.topology.atlas import components


def test_nodes_hang_together_by_edges_only() -> None:
    count, part = components.connected(5, np.array([0, 3]), np.array([2, 4]))
    assert count == 3
    assert part[0] == part[2] and part[3] == part[4] and len({part[0], part[1], part[3]}) == 3


def test_without_nodes_there_is_no_part() -> None:
    count, part = components.connected(0, np.zeros(0, int), np.zeros(0, int))
    assert (count, len(part)) == (0, 0)
