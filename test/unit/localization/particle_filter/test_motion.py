import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.localization.particle_filter import motion
from glass_nav.localization.particle_filter.motion import OdometryNoise

EXACT = dict(
    odom_alpha1=0.0,
    odom_alpha2=0.0,
    odom_alpha3=0.0,
    odom_alpha4=0.0,
    odom_alpha5=0.0,
    wheel_left_noise_m=0.0,
    wheel_right_noise_m=0.0,
)


@pytest.mark.parametrize("model", motion.MODELS)
@pytest.mark.parametrize(
    "step", [(0.5, 0.0, 0.0), (0.3, 0.1, 0.2), (-0.4, 0.0, 0.0), (0.0, 0.0, 2.0), (-0.3, -0.2, -3.0)]
)
def test_without_noise_every_particle_makes_the_step_of_odometry(model, step):
    start = np.array([[1.0, 2.0, 0.5], [-3.0, 0.0, -2.0]])
    noise = OdometryNoise(odom_model_type=model, **EXACT)
    moved = motion.sample(start, np.array(step), noise, np.random.default_rng(0))
    expected = se2.compose(start, np.array(step))
    np.testing.assert_allclose(moved[:, :2], expected[:, :2], atol=1e-9)
    np.testing.assert_allclose(angles.wrap(moved[:, 2] - expected[:, 2]), 0.0, atol=1e-9)


def spread(model, step, **alphas):
    noise = OdometryNoise(odom_model_type=model, **dict(EXACT, **alphas))
    moved = motion.sample(np.zeros((40000, 3)), np.array(step), noise, np.random.default_rng(3))
    return moved.std(axis=0)


def test_the_corrected_model_takes_the_variance_for_a_variance():
    way = 0.5
    np.testing.assert_allclose(spread("diff-corrected", (way, 0, 0), odom_alpha3=0.04)[0], 0.2 * way, rtol=0.03)
    np.testing.assert_allclose(spread("omni-corrected", (way, 0, 0), odom_alpha5=0.04)[1], 0.2 * way, rtol=0.03)


def test_the_plain_model_takes_it_for_a_deviation_as_amcl_does():
    way = 0.5
    np.testing.assert_allclose(spread("diff", (way, 0, 0), odom_alpha3=0.04)[0], 0.04 * way**2, rtol=0.03)


def test_the_spread_across_grows_with_the_turn_in_front_of_the_way():
    # first rotation noise sqrt(alpha2) way, seen after the way: way * that
    way = 0.5
    np.testing.assert_allclose(
        spread("diff-corrected", (way, 0, 0), odom_alpha2=0.0025)[1], way * 0.05 * way, rtol=0.05
    )


def test_driving_backwards_is_as_sure_as_driving_forwards():
    forwards = spread("diff-corrected", (0.5, 0, 0), odom_alpha1=0.2)
    backwards = spread("diff-corrected", (-0.5, 0, 0), odom_alpha1=0.2)
    np.testing.assert_allclose(forwards, backwards, atol=1e-9)


def test_turning_on_the_spot_keeps_the_place():
    assert np.all(spread("diff-corrected", (0.0, 0.0, 1.0), odom_alpha1=0.1)[:2] < 1e-9)


@pytest.mark.parametrize(
    "left, right",
    [
        pytest.param(0.0004, 0.0004, id="both wheels"),
        pytest.param(0.0008, 0.0, id="the left one alone"),
    ],
)
def test_each_wheel_has_its_own_noise(left, right):
    # straight ahead: sqrt(var_left + var_right) / 2 along, over the base in yaw, and half the way times that across
    noise = dict(wheel_left_noise_m=left, wheel_right_noise_m=right, wheel_base_m=0.4)
    along, across, yaw = spread("wheels", (0.5, 0.0, 0.0), **noise)
    np.testing.assert_allclose((along, yaw), (0.01, 0.05), rtol=0.03)
    np.testing.assert_allclose(across, 0.25 * 0.05, rtol=0.05)


def test_the_worn_wheel_bends_the_path_to_its_side():
    noise = OdometryNoise(odom_model_type="wheels", **dict(EXACT, wheel_left_noise_m=0.002))
    moved = motion.sample(np.zeros((20000, 3)), np.array([0.5, 0.0, 0.0]), noise, np.random.default_rng(0))
    assert np.corrcoef(moved[:, 0], moved[:, 2])[0, 1] < -0.9  # farther by the left wheel is a turn to the right


@pytest.mark.parametrize("step", [(0.5, 0.0, 0.0), (0.3, 0.1, 0.4), (-0.4, 0.05, -0.3), (0.0, 0.0, 1.0)])
def test_the_covariance_of_wheels_is_that_of_their_samples(step):
    noise = OdometryNoise(odom_model_type="wheels", wheel_left_noise_m=1e-4, wheel_right_noise_m=3e-4)
    moved = motion.sample(np.zeros((60000, 3)), np.array(step), noise, np.random.default_rng(1))
    np.testing.assert_allclose(np.cov(moved.T), motion.covariance(np.array(step), noise), atol=6e-5, rtol=0.1)


def test_an_omnidirectional_robot_errs_sideways():
    deviation = spread("omni-corrected", (0.0, 0.5, 0.0), odom_alpha5=0.04)
    assert deviation[0] == pytest.approx(0.1, rel=0.05) and deviation[1] < 1e-9


def test_the_same_seed_gives_the_same_particles():
    one, other = (
        motion.sample(np.zeros((9, 3)), np.array([0.2, 0, 0.1]), OdometryNoise(), np.random.default_rng(7))
        for _ in range(2)
    )
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    "values, text",
    [
        (
            dict(odom_model_type="tank"),
            "~odom_model_type must be one of diff, omni, diff-corrected, omni-corrected, wheels, got 'tank'",
        ),
        (dict(odom_alpha3=-0.1), "~odom_alpha3 must be finite and >= 0, got -0.1"),
        (dict(wheel_base_m=0.0), "~wheel_base_m must be > 0 m, got 0.0"),
        (dict(odom_alpha1=float("nan")), "~odom_alpha1 must be finite and >= 0, got nan"),
    ],
)
def test_a_wrong_noise_is_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        OdometryNoise(**values)
    assert str(err.value) == text


@pytest.mark.parametrize("model", motion.MODELS)
@pytest.mark.parametrize("step", [(0.5, 0.0, 0.0), (-0.3, 0.05, 0.2), (0.0, 0.0, 0.6)])
def test_the_covariance_of_a_step_is_that_of_the_particles(model, step):
    noise = OdometryNoise(odom_model_type=model, odom_alpha1=0.01, odom_alpha3=0.01)
    moved = motion.sample(np.zeros((40000, 3)), np.array(step), noise, np.random.default_rng(3))
    expected = np.cov(moved.T)
    np.testing.assert_allclose(motion.covariance(np.array(step), noise), expected, atol=0.05 * np.abs(expected).max())
