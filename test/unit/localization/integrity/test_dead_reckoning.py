import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.localization.integrity.dead_reckoning import DeadReckoning
from glass_nav.localization.particle_filter import motion
from glass_nav.localization.particle_filter.motion import OdometryNoise

SURE = np.diag([0.02, 0.01, 0.005]) ** 2


def driven(start, steps, noise):
    for step in steps:
        start = start.carried(np.array(step), noise)
    return start


@pytest.mark.parametrize("model", ["diff-corrected", "omni-corrected"])
def test_it_is_as_wide_as_particles_that_drove_the_same_way(model):
    noise = OdometryNoise(odom_model_type=model)
    steps = [(0.1, 0.0, 0.0)] * 20 + [(0.05, 0.0, 0.2)] * 5 + [(0.1, 0.0, 0.0)] * 20
    start = np.array([2.0, -1.0, 2.9])
    reckoned = driven(DeadReckoning(start, SURE), steps, noise)
    rng = np.random.default_rng(0)
    particles = start + rng.multivariate_normal(np.zeros(3), SURE, 20000)
    for step in steps:
        particles = motion.sample(particles, np.array(step), noise, rng)
    off = particles - reckoned.map_from_base
    off[:, 2] = angles.wrap(off[:, 2])
    np.testing.assert_allclose(
        np.sqrt(np.diag(off.T @ off / len(off))), np.sqrt(np.diag(reckoned.covariance)), rtol=0.05
    )
    np.testing.assert_allclose(np.corrcoef(off.T), correlation(reckoned.covariance), atol=0.05)


def correlation(covariance):
    deviations = np.sqrt(np.diag(covariance))
    return covariance / np.outer(deviations, deviations)


def test_the_pose_is_the_one_that_odometry_leads_to():
    steps = [(0.3, 0.1, 0.4), (0.0, 0.0, -3.0), (-0.2, 0.0, 0.1)]
    start = np.array([1.0, 2.0, 3.0])
    expected = start
    for step in steps:
        expected = se2.compose(expected, np.array(step))
    reckoned = driven(DeadReckoning(start, SURE), steps, OdometryNoise())
    np.testing.assert_allclose(reckoned.map_from_base, expected)
    assert reckoned.distance_m == pytest.approx(np.hypot(0.3, 0.1) + 0.2)


def test_a_scale_of_the_noise_is_that_of_its_variances_along_and_across_the_robot():
    start, step = DeadReckoning(np.array([1.0, 2.0, 0.7]), np.zeros((3, 3))), np.array([0.5, 0.1, 0.3])
    scale = np.array([4.0, 0.25, 9.0])
    cos, sin = np.cos(0.7), np.sin(0.7)
    along_across = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    plain, scaled = (
        along_across @ start.carried(step, OdometryNoise(), factors).covariance @ along_across.T
        for factors in (np.ones(3), scale)
    )
    np.testing.assert_allclose(np.diag(scaled), scale * np.diag(plain))
    np.testing.assert_allclose(correlation(scaled), correlation(plain))


def test_a_look_alike_60_m_away_is_out_of_the_question_after_60_m():
    reckoned = driven(DeadReckoning(np.zeros(3), SURE), [(0.1, 0.0, 0.0)] * 600, OdometryNoise())
    here, twin = reckoned.map_from_base, reckoned.map_from_base - [60.0, 0.0, 0.0]
    drifted = reckoned.map_from_base + [0.5, 0.5, 0.05]
    near, far = reckoned.log_likelihood(np.array([here, drifted])), reckoned.log_likelihood(twin[None])
    assert near[0] == 0.0
    assert near[1] > -4.0
    assert far[0] < -100.0
    assert reckoned.log_likelihood(twin[None], least=-12.0)[0] == -12.0


def test_yaw_is_compared_on_the_circle():
    reckoned = DeadReckoning(np.array([0.0, 0.0, 3.13]), np.diag([0.1, 0.1, 0.1]) ** 2)
    assert reckoned.mahalanobis(np.array([[0.0, 0.0, -3.13]]))[0] < 0.3
