import numpy as np
import pytest

from glass_nav.geometry import angles


@pytest.mark.parametrize("turns", range(-3, 4))
def test_a_whole_turn_changes_nothing(turns):
    angle = np.linspace(-3.0, 3.0, 41)
    np.testing.assert_allclose(angles.wrap(angle + 2.0 * np.pi * turns), angle, atol=1e-12)


def test_wrapped_angles_lie_in_the_half_open_interval():
    wrapped = angles.wrap(np.array([np.pi, -np.pi, 3.0 * np.pi, 1e6]))
    assert np.all(wrapped >= -np.pi) and np.all(wrapped < np.pi)


def test_one_angle_is_wrapped_as_many_are():
    for angle in (0.3, np.pi, -np.pi, 3.0 * np.pi, -4.0, 1e6):
        assert angles.wrap_one(angle) == angles.wrap(angle)
    assert all(np.isnan(angles.wrap_one(angle)) for angle in (np.nan, np.inf))


def test_not_a_number_stays_not_a_number():
    assert np.isnan(angles.wrap(np.nan))


def test_the_mean_of_179_and_minus_179_degrees_is_180():
    assert abs(angles.wrap(angles.mean(np.radians([179.0, -179.0])) - np.pi)) < 1e-12


def test_weights_pull_the_mean():
    assert angles.mean(np.array([0.0, 1.0]), np.array([1.0, 0.0])) == pytest.approx(0.0)
