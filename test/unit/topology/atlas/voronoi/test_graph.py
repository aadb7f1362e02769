from __future__ import annotations

import numpy as np

from glass_nav.topology.atlas.voronoi import graph
from glass_nav.topology.atlas.voronoi.bounds import Bounds
from glass_nav.topology.atlas.voronoi.meetpoints import Meetpoints
from glass_nav.topology.atlas.voronoi.ridges import Ridges
from glass_nav.world.grid_map import GridMap

MAP = GridMap(np.zeros((4, 4), np.int8), 0.5, np.array([10.0, 0.0, np.pi / 2.0]))
WALL = np.array([[0.0, 4.0], [20.0, 4.0], [40.0, 4.0]])


def test_cells_become_metres_where_the_map_is() -> None:
    """A line along x of the grid, 4 cells from its wall: along y of the map, by half."""
    line = np.column_stack([np.linspace(40.0, 0.0, 41), np.zeros(41)])  # from its far end
    bounds = Bounds(WALL, np.array([0.0, 9.0, 1.0]), np.zeros((0, 2)), np.ones((6, 6), bool))
    ridges = Ridges(line, np.full(41, 4.0), np.tile([0, 1, 2], (41, 1)), np.zeros((0, 2), int))
    made = graph.in_map(MAP, bounds, ridges, Meetpoints(bounds, ridges, [np.arange(41)]), left_out=3)
    np.testing.assert_allclose(made.position_m, [[10.0, 0.0], [10.0, 20.0]], atol=1e-9)  # in order
    assert made.edge_node.tolist() == [[0, 1]] and made.degree.tolist() == [1, 1] and made.components()[0] == 1
    np.testing.assert_allclose(made.lines_m[0][[0, -1]], made.position_m, atol=1e-9)
    np.testing.assert_allclose(made.r_m, 2.0)
    np.testing.assert_allclose(made.doubt_m, 2.0)  # 4.5 m of doubt, but no more than r
    np.testing.assert_allclose(made.spread_m, 0.0)
    np.testing.assert_allclose(made.line_clearance_m[0][[0, -1]], 2.0)
    assert made.left_out == 3
