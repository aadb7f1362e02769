from __future__ import annotations

from typing import List

import numpy as np
import pytest

from glass_nav.topology.atlas.voronoi.bounds import Bounds
from glass_nav.topology.atlas.voronoi.meetpoints import Meetpoints
from glass_nav.topology.atlas.voronoi.ridges import Ridges

R = 5.0


def made(xy: np.ndarray, chains: List[List[int]]) -> Meetpoints:
    """Nodes whose obstacles lie R to the left, to the right and below."""
    obstacles = (xy[:, None] + R * np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0]])).reshape(-1, 2)
    bounds = Bounds(obstacles, np.zeros(len(obstacles)), np.zeros((0, 2)), np.ones((3, 3), bool))
    ridges = Ridges(xy, np.full(len(xy), R), np.arange(3 * len(xy)).reshape(-1, 3), np.zeros((0, 2), int))
    return Meetpoints(bounds, ridges, [np.array(chain) for chain in chains])


XY = np.array([[0.0, 0.0], [4.0, 0.0], [40.0, 0.0], [-40.0, 0.0], [0.0, 40.0], [4.0, -40.0]])
TWO_T = [[0, 1], [1, 2], [0, 3], [0, 4], [1, 5]]  # 4 cells apart


def test_meetpoints_near_each_other_are_one_between_them() -> None:
    meetpoints = made(XY, TWO_T)
    meetpoints.merge(least=4.5, tolerance=0.0)
    assert sorted(meetpoints.members) == [0, 2, 3, 4, 5] and sorted(meetpoints.members[0]) == [0, 1]
    np.testing.assert_allclose(meetpoints.position[0], [2.0, 0.0])
    assert len(meetpoints.edges) == 4
    for edge in meetpoints.edges:
        ends, line = meetpoints.ends[edge], meetpoints.lines[edge]
        np.testing.assert_allclose(line[[0, -1]], [meetpoints.position[end] for end in ends])


def test_so_are_those_that_see_each_others_obstacles_at_their_own_distance() -> None:
    """The right obstacle of one is 4 cells further from the other."""
    for tolerance, count in ((3.9, 6), (4.1, 5)):
        meetpoints = made(XY, TWO_T)
        meetpoints.merge(least=0.0, tolerance=tolerance)
        assert len(meetpoints.members) == count


@pytest.mark.parametrize("least, left_out", [(0.0, 0), (10.0, 1), (500.0, 2)])
def test_small_parts_are_left_out(least: float, left_out: int) -> None:
    xy = np.concatenate([XY, [[100.0, 0.0], [108.0, 0.0]]])
    meetpoints = made(xy, [*TWO_T, [6, 7]])
    assert meetpoints.drop_small(least) == left_out
    assert len(meetpoints.members) == [8, 6, 0][left_out]
