"""Where the robot's environment frame lies, once a meetpoint is confirmed."""

from __future__ import annotations

import made_atlases
import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.topology import frame_relation

ATLAS = made_atlases.corridors([(0, 0), (6, 0), (15, 0), (6, 4)], [0.5, 1.3, 1.1, 1.7], [(0, 1), (1, 2), (1, 3)])


def test_the_relation_carries_a_pose_of_the_environment_frame_to_node_and_map() -> None:
    map_from_base, environment_from_base = np.array([6.2, 0.1, 0.7]), np.array([-3.0, 40.0, -2.5])
    relation = frame_relation.of(ATLAS, 1, map_from_base, environment_from_base)
    assert relation is not None and relation.node == 1 and relation.node_from_environment is not None
    np.testing.assert_allclose(
        se2.compose(relation.map_from_environment, environment_from_base), map_from_base, atol=1e-9
    )
    by_node = se2.compose(frame_relation.node_frame(ATLAS, 1), relation.node_from_environment)
    np.testing.assert_allclose(by_node, relation.map_from_environment, atol=1e-9)


@pytest.mark.parametrize("node, towards", [(0, [1.0, 0.0]), (2, [-1.0, 0.0]), (3, [0.0, -1.0])])
def test_a_node_looks_along_its_first_edge(node: int, towards: list) -> None:
    x, y, yaw = frame_relation.node_frame(ATLAS, node)
    np.testing.assert_allclose([x, y], ATLAS.nodes.position_m[node])
    np.testing.assert_allclose([np.cos(yaw), np.sin(yaw)], towards, atol=1e-9)


def test_without_dead_reckoning_there_is_none_and_a_place_off_the_atlas_has_no_node() -> None:
    pose = np.array([1.0, 2.0, 0.5])
    assert frame_relation.of(ATLAS, 1, pose, None) is None
    relation = frame_relation.of(ATLAS, None, pose, pose)
    assert relation is not None and relation.node is None and relation.node_from_environment is None
    np.testing.assert_allclose(relation.map_from_environment, np.zeros(3), atol=1e-12)
