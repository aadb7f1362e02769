"""How often edges were passed, in buildings worked by hand and in a maze."""

from __future__ import annotations

from typing import Dict, List, Tuple

import numpy as np

from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search.passed_edges import PassedEdges

EAST, NORTH, WEST, SOUTH = 0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi


def at(x: float, y: float, came_rad: float, others: List[float], yaw: float = 0.3) -> Meetpoint:
    """A meetpoint with edges in these directions in odom: the one the robot came along, and others clockwise."""
    gaps = np.mod(came_rad - np.array([came_rad, *others]), 2.0 * np.pi)
    return Meetpoint(1 + len(others), 1.0, bearings_rad=came_rad - yaw - gaps, odom_from_base=np.array([x, y, yaw]))


def times(passed: PassedEdges, meetpoint: Meetpoint) -> "List[int]":
    found = passed.times(meetpoint)
    assert found is not None
    return found.tolist()


def test_an_edge_counts_at_both_of_its_ends_to_and_fro() -> None:
    passed = PassedEdges()
    passed.begin(at(0.0, 0.0, WEST, [NORTH, EAST]))
    assert times(passed, at(0.0, 0.0, WEST, [NORTH, EAST])) == [0, 0, 0]
    east = at(5.0, 0.0, WEST, [EAST])
    passed.add(2, east, 5.0)
    assert times(passed, east) == [1, 0]
    back = at(0.1, -0.1, EAST, [WEST, NORTH], yaw=2.0)  # a little off, and looking elsewhere
    passed.add(0, back, 5.0)
    assert times(passed, back) == [2, 0, 0]
    assert times(passed, east) == [2, 0]
    passed.begin(back)
    assert times(passed, back) == [0, 0, 0]


def test_without_odometry_or_directions_nothing_is_known() -> None:
    passed = PassedEdges()
    passed.begin(Meetpoint(2, 1.0))
    passed.add(1, Meetpoint(2, 1.0, odom_from_base=np.zeros(3)), 3.0)
    assert passed.times(Meetpoint(2, 1.0)) is None
    assert passed.times(Meetpoint(2, 1.0, odom_from_base=np.zeros(3))) is None
    assert times(passed, at(0.0, 0.0, WEST, [EAST])) == [0, 0]


def test_leaving_by_the_edge_passed_least_comes_along_every_edge() -> None:
    size = 4  # a grid of streets 5 m apart
    directions = {EAST: (1, 0), SOUTH: (0, -1), WEST: (-1, 0), NORTH: (0, 1)}  # clockwise

    def meetpoint(x: int, y: int, came: float) -> Tuple[Meetpoint, List[float]]:
        order = list(directions)
        turned = order[order.index(came) :] + order[: order.index(came)]
        there = [way for way in turned if 0 <= x + directions[way][0] < size and 0 <= y + directions[way][1] < size]
        return at(5.0 * x, 5.0 * y, there[0], there[1:]), there

    x = y = 0
    here, ways = meetpoint(x, y, EAST)
    passed = PassedEdges()
    streets: Dict[Tuple[int, ...], int] = {}
    passed.begin(here)
    for _ in range(4 * size * (size - 1)):  # twice as many ways as there are streets
        rank = len(ways) - 1 - int(np.argmin(times(passed, here)[::-1]))
        dx, dy = directions[ways[rank]]
        street = (2 * x + dx, 2 * y + dy)
        streets[street] = streets.get(street, 0) + 1
        x, y = x + dx, y + dy
        here, ways = meetpoint(x, y, list(directions)[(list(directions).index(ways[rank]) + 2) % 4])
        passed.add(rank, here, 5.0)
    assert len(streets) == 2 * size * (size - 1)
