"""Arcs through points, and speeds from which a base can brake."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.geometry import pure_pursuit
from glass_nav.simulation.robot import RobotParams

BASE = BaseLimits(max_speed_m_s=0.5, max_turn_rad_s=1.0)


@pytest.mark.parametrize("point", [(0.4, 0.3), (0.2, -0.3), (-0.1, 0.4)])
def test_the_arc_leads_through_the_point(point):
    radius = 1.0 / pure_pursuit.curvature_to(np.array(point))  # its centre is straight to the side
    assert math.hypot(point[0], point[1] - radius) == pytest.approx(abs(radius))
    assert math.copysign(1.0, radius) == math.copysign(1.0, point[1])


def test_a_point_has_the_same_arc_in_polar_coordinates():
    for x, y in np.random.default_rng(0).uniform(-2.0, 2.0, (50, 2)):
        polar = pure_pursuit.curvature_towards(math.atan2(y, x), math.hypot(x, y))
        assert polar == pytest.approx(pure_pursuit.curvature_to(np.array([x, y])), rel=1e-9)


def test_a_point_where_the_base_stands_has_an_arc():
    assert pure_pursuit.curvature_to(np.zeros(2)) == 0.0 and pure_pursuit.curvature_towards(0.0, 0.0) == 0.0


@pytest.mark.parametrize("curvature", [0.0, 0.5, -3.0, 20.0])
@pytest.mark.parametrize("base", [BASE, RobotParams()], ids=["limits", "robot"])
def test_no_limit_is_exceeded(curvature, base):
    speed, left, turn = pure_pursuit.along_arc(curvature, base, 0.4, 0.2)
    assert 0.0 < speed <= min(0.4, base.max_speed_m_s) and left == 0.0
    assert abs(turn) <= base.max_turn_rad_s + 1e-9 and speed * abs(turn) <= 0.2 + 1e-9
    assert turn == pytest.approx(speed * curvature)


def test_a_turn_on_the_spot_creeps_to_its_end():
    assert pure_pursuit.on_the_spot(-3.0, BASE).tolist() == [0.0, 0.0, -1.0]
    assert pure_pursuit.on_the_spot(0.0, BASE, 0.04).tolist() == [0.0, 0.0, 0.04]
    assert 0.0 < pure_pursuit.on_the_spot(0.01, BASE)[2] < 0.2


def test_a_base_that_brakes_from_the_braking_speed_stands_within_the_distance():
    for distance_m in (0.01, 0.1, 1.0):
        speed = pure_pursuit.braking_speed(distance_m, 0.5)
        assert speed**2 / (2.0 * 0.5) < distance_m
    assert pure_pursuit.braking_speed(-1.0, 0.5) == 0.0
