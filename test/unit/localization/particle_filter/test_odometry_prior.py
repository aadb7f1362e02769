"""How probable a pose is beside the one that odometry led to."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from glass_nav.localization.particle_filter.odometry_prior import MIN_DEVIATION, SLIP_DEVIATION, OdometryPrior

HERE = np.array([1.0, 2.0, np.pi - 0.01])
COVARIANCE = np.array([[4.0, 1.0, 0.1], [1.0, 9.0, 0.0], [0.1, 0.0, 0.5]]) * 1e-3
NEAR = 4.0 * COVARIANCE + np.diag(MIN_DEVIATION**2)
POSES = HERE + np.random.default_rng(0).normal(0.0, 0.1, (20, 3))


def test_without_slip_it_is_a_normal_distribution():
    density = OdometryPrior(HERE, COVARIANCE).log_density(POSES)
    expected = stats.multivariate_normal(HERE, NEAR).logpdf(POSES)
    np.testing.assert_allclose(density - density[0], expected - expected[0], atol=1e-9)


def test_a_wheel_may_have_slipped_with_the_stated_probability():
    density = OdometryPrior(HERE, COVARIANCE, 0.01).log_density(POSES)
    near, far = (stats.multivariate_normal(HERE, each).pdf(POSES) for each in (NEAR, NEAR + np.diag(SLIP_DEVIATION**2)))
    expected = np.log(0.99 * near + 0.01 * far)
    np.testing.assert_allclose(density - density[0], expected - expected[0], atol=1e-9)


def test_headings_are_compared_around_the_circle():
    turned = HERE + [0.0, 0.0, 0.02], HERE + [0.0, 0.0, 0.02 - 2.0 * np.pi]
    density = OdometryPrior(HERE, COVARIANCE).log_density(np.array(turned))
    assert density[0] == pytest.approx(density[1])


def test_information_is_the_inverse_of_the_widened_covariance():
    np.testing.assert_allclose(OdometryPrior(HERE, COVARIANCE).information @ NEAR, np.eye(3), atol=1e-9)


def test_what_odometry_reaches_are_poses_within_three_deviations():
    deviations = np.sqrt(np.diag(NEAR))
    alone = OdometryPrior(HERE, np.diag(np.diag(COVARIANCE)))
    poses = [HERE + share * deviations * axis for share in (2.9, 3.1) for axis in np.eye(3)]
    assert alone.reaches(np.array(poses)).tolist() == [True] * 3 + [False] * 3
