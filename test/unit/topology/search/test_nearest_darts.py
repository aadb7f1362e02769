"""The dart of the atlas at which a robot stands, by its place and the directions of the edges that it sees."""

from __future__ import annotations

import made_atlases
import numpy as np
import pytest

from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search import nearest_darts
from glass_nav.topology.search.belief import NO_DART

CROSS = made_atlases.corridors(
    [(0.0, 0.0), (5.0, 0.0), (0.0, 5.0), (-5.0, 0.0), (0.0, -5.0)], [1.0] * 5, [(0, 1), (0, 2), (0, 3), (0, 4)]
)
BEARINGS_RAD = np.array([3.0, 1.4, 0.2, -1.7])  # a little off


@pytest.mark.parametrize("quarter, dart", [(0, 4), (1, 6), (2, 0), (3, 2)])
def test_the_edge_that_it_came_along_is_told_by_all_directions_together(quarter: int, dart: int) -> None:
    pose = np.array([[0.1, -0.1, 0.5 * np.pi * quarter]])
    meetpoint = Meetpoint(4, 3.0, bearings_rad=BEARINGS_RAD)  # r is far off, too
    assert nearest_darts.like(CROSS, pose, meetpoint).tolist() == [dart]
    assert nearest_darts.like(CROSS, pose, Meetpoint(4, 3.0)).tolist() == [dart]


@pytest.mark.parametrize(
    "pose, degree",
    [
        pytest.param([1.0, 0.0, 0.0], 4, id="too far away"),
        pytest.param([0.0, 0.0, 0.0], 3, id="another degree"),
        pytest.param([0.0, 0.0, 0.8], 4, id="turned"),
    ],
)
def test_no_edge_is_told_where_the_atlas_has_no_such_node(pose: "list[float]", degree: int) -> None:
    meetpoint = Meetpoint(degree, 1.0, bearings_rad=BEARINGS_RAD[:degree])
    assert nearest_darts.like(CROSS, np.array([pose]), meetpoint).tolist() == [NO_DART]


@pytest.mark.parametrize("degree", [2, 4])
def test_beside_a_node_stands_a_robot_that_sees_another_degree(degree: int) -> None:
    meetpoint = Meetpoint(degree, 1.0, bearings_rad=BEARINGS_RAD[:degree])
    dart = nearest_darts.beside(CROSS, np.array([0.2, 0.0, 1.0]), meetpoint)
    assert CROSS.darts.node[dart] == 0
    assert nearest_darts.beside(CROSS, np.array([1.0, 0.0, 1.0]), meetpoint) == NO_DART
    assert nearest_darts.beside(CROSS, np.array([0.2, 0.0, 1.0]), Meetpoint(degree, 1.0)) == NO_DART
