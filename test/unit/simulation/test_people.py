from __future__ import annotations

import numpy as np
import pytest

from glass_nav.simulation import people
from glass_nav.simulation.building import Person

FAR = np.array([100.0, 100.0])
CORNER = Person(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]]), speed_m_s=2.0, radius_m=0.3)  # 7 m, 3.5 s


@pytest.mark.parametrize(
    "time_s, place",
    [
        (0.0, (0.0, 0.0)),
        (1.0, (2.0, 0.0)),
        (1.5, (3.0, 0.0)),
        (2.5, (3.0, 2.0)),
        (3.5, (3.0, 4.0)),
        (4.5, (3.0, 2.0)),
        (6.5, (1.0, 0.0)),
        (7.0, (0.0, 0.0)),
        (8.0, (2.0, 0.0)),
        (-1.0, (2.0, 0.0)),
    ],
)
def test_somebody_walks_along_the_waypoints_and_back(time_s, place):
    np.testing.assert_allclose(people.position(CORNER, time_s), place, atol=1e-9)


def test_a_person_is_round_opaque_and_on_no_map():
    surfaces = people.surfaces([CORNER], 2.5, FAR)
    assert len(surfaces.mapped) == people.CORNERS
    assert not surfaces.mapped.any() and surfaces.present.all()
    np.testing.assert_allclose(np.hypot(*(surfaces.from_m - [3.0, 2.0]).T), 0.3)
    np.testing.assert_allclose(surfaces.to_m, np.roll(surfaces.from_m, -1, axis=0))


def test_who_would_bump_into_the_robot_steps_aside():
    assert len(people.surfaces([CORNER], 2.5, np.array([3.0, 1.3])).mapped) == 0  # 0.70 m, radius 0.3
    assert len(people.surfaces([CORNER], 2.5, np.array([3.0, 1.2])).mapped) == people.CORNERS


def test_nobody_is_nothing():
    assert people.surfaces([], 0.0, FAR).from_m.shape == (0, 2)
