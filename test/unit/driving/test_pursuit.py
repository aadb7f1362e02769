"""Arcs against their geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.driving import pursuit
from glass_nav.driving.base_limits import BaseLimits
from glass_nav.geometry import pure_pursuit
from glass_nav.simulation import robot

LIMITS = BaseLimits()


@pytest.mark.parametrize("point", [(0.5, 0.0), (0.5, 0.2), (0.3, -0.3), (0.05, 0.3), (-0.2, 0.3)])
def test_the_arc_leads_through_the_point(point):
    velocity = pursuit.along_arc(np.array(point), LIMITS)
    assert velocity[0] > 0.0 and velocity[1] == 0.0
    times_s = np.linspace(0.0, 12.0, 2401)
    way = np.array([robot.moved(np.zeros(3), velocity * time_s)[:2] for time_s in times_s])
    assert np.hypot(*(way - point).T).min() < 2e-3


@pytest.mark.parametrize("point", [(0.5, 0.0), (0.5, 0.2), (0.3, -0.3), (0.05, 0.3), (0.0, 0.01)])
def test_it_is_no_faster_than_the_base_and_slower_in_bends(point):
    speed, _, turn = pursuit.along_arc(np.array(point), LIMITS)
    assert speed <= LIMITS.max_speed_m_s + 1e-12 and abs(turn) <= LIMITS.max_turn_rad_s + 1e-12
    assert speed * abs(turn) <= pure_pursuit.LATERAL_M_S2 + 1e-9  # v^2 / radius
    straight = pursuit.along_arc(np.array([0.5, 0.0]), LIMITS)
    assert straight.tolist() == [LIMITS.max_speed_m_s, 0.0, 0.0]


@pytest.mark.parametrize("remaining_m", [0.0, 0.02, 0.1, 0.2])
def test_near_the_end_it_is_as_slow_as_it_can_brake(remaining_m):
    speed = pursuit.along_arc(np.array([0.5, 0.0]), LIMITS, remaining_m)[0] - pursuit.CREEP
    assert 0.0 <= speed**2 / (2.0 * LIMITS.max_acceleration_m_s2) <= remaining_m
    assert pursuit.along_arc(np.array([0.5, 0.0]), LIMITS, 3.0)[0] == LIMITS.max_speed_m_s


@pytest.mark.parametrize("angle_rad", [-3.0, -0.5, -0.02, 0.02, 0.5, 3.0])
def test_a_turn_on_the_spot_can_be_braked_within_the_angle(angle_rad):
    forward, left, turn = pursuit.on_the_spot(angle_rad, LIMITS)
    assert forward == left == 0.0 and math.copysign(1.0, turn) == math.copysign(1.0, angle_rad)
    assert abs(turn) <= LIMITS.max_turn_rad_s
    braked = max(abs(turn) - pursuit.CREEP, 0.0)
    assert braked**2 / (2.0 * LIMITS.max_turn_acceleration_rad_s2) <= abs(angle_rad)
