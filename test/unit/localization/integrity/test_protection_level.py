from __future__ import annotations

import numpy as np
import pytest

from glass_nav.localization.integrity import protection_level


def test_levels_are_along_and_across_the_heading():
    levels = protection_level.of(np.array([3.0, 4.0, 0.5 * np.pi]), np.diag([0.04, 0.01, 1e-4]), 0.05)
    assert levels.p95[0] == pytest.approx(0.5 * levels.p95[1])
    assert levels.p999[0] / levels.p999[2] == pytest.approx(10.0)


@pytest.mark.parametrize("freedom", [5, np.inf])
def test_levels_bound_errors_of_the_claimed_variance(freedom):
    """Normal errors, and errors with tails as heavy as those assumed."""
    rng = np.random.default_rng(1)
    if np.isinf(freedom):
        error = rng.standard_normal(200_000)
    else:
        error = rng.standard_t(freedom, 200_000) * np.sqrt((freedom - 2.0) / freedom)
    levels = protection_level.of(np.zeros(3), np.eye(3), 0.05)
    assert np.mean(np.abs(error) > levels.p95[0]) < 0.055
    assert np.mean(np.abs(error) > levels.p999[0]) < 0.0012


def test_no_pose_is_surer_than_the_map_says_where_its_walls_are():
    levels = protection_level.of(np.zeros(3), np.diag([1e-6, 1e-2, 1e-6]), 0.05)
    assert levels.p999[0] == 0.05 and levels.p999[1] > 0.3
    assert levels.p95[0] < 0.003 and levels.p999[2] < 0.01


def test_a_heading_is_never_more_than_half_a_turn_off():
    levels = protection_level.of(np.zeros(3), np.diag([1e6, 1e6, 1e6]), 0.05)
    assert levels.p999[2] == np.pi and levels.p999[0] > 1e3


def test_without_a_pose_the_levels_are_not_known():
    assert np.isnan([protection_level.UNKNOWN.p95, protection_level.UNKNOWN.p999]).all()
