from __future__ import annotations

import numpy as np
import pytest

from glass_nav.driving import velocity
from glass_nav.driving.base_limits import BaseLimits

LIMITS = BaseLimits(max_speed_m_s=0.5, max_turn_rad_s=1.0, max_acceleration_m_s2=0.5, max_turn_acceleration_rad_s2=2.0)
STANDING = np.zeros(3)


def test_speed_grows_by_the_acceleration_of_the_base_up_to_its_limit():
    command, speeds = STANDING, []
    for _ in range(30):
        command = velocity.limited(np.array([2.0, 0.0, 0.0]), command, LIMITS, 0.05)
        speeds.append(command[0])
    assert speeds[0] == pytest.approx(0.025) and max(np.diff(speeds)) <= 0.025 + 1e-12
    assert speeds[-1] == pytest.approx(0.5)


def test_a_turn_that_is_too_fast_slows_the_way_too_so_that_the_curve_stays():
    wanted = np.array([0.4, 0.0, 2.0])
    command = velocity.limited(wanted, wanted, LIMITS, 10.0)
    assert command[2] == pytest.approx(1.0)
    assert command[0] / command[2] == pytest.approx(wanted[0] / wanted[2])


def test_it_slows_down_and_turns_back_as_gently():
    np.testing.assert_allclose(velocity.limited(STANDING, np.array([0.5, 0.0, -1.0]), LIMITS, 0.1), [0.45, 0.0, -0.8])
    np.testing.assert_allclose(velocity.limited(STANDING, np.array([0.01, 0.0, -0.1]), LIMITS, 0.1), [0.0, 0.0, 0.0])


def test_it_never_goes_sideways():
    assert velocity.limited(np.array([0.1, 0.4, 0.0]), STANDING, LIMITS, 1.0)[1] == 0.0
