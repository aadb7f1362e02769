import numpy as np
import pytest

from glass_nav.localization.particle_filter import resampling
from glass_nav.localization.particle_filter.resampling import ParticleCount


def test_weights_of_any_offset_sum_to_one():
    log_w = np.array([-2000.0, -2001.0, -1999.0])
    np.testing.assert_allclose(resampling.normalised(log_w), resampling.normalised(log_w + 1990.0))
    assert resampling.normalised(log_w).sum() == pytest.approx(1.0)


def test_if_nothing_is_possible_all_are_equal():
    np.testing.assert_allclose(resampling.normalised(np.full(4, -np.inf)), 0.25)


def test_one_particle_with_all_weight_is_worth_one():
    assert resampling.effective_count(np.array([1.0, 0.0])) == 1.0
    assert resampling.effective_count(np.full(8, 0.125)) == pytest.approx(8.0)


@pytest.mark.parametrize("seed", range(20))
def test_each_particle_is_drawn_as_often_as_its_weight_says_give_or_take_one(seed):
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.full(30, 0.3))
    drawn = np.bincount(resampling.low_variance(weights, 1000, rng), minlength=30)
    assert drawn.sum() == 1000
    assert np.all(np.abs(drawn - 1000 * weights) <= 1.0 + 1e-9)


def test_a_weightless_particle_is_never_drawn():
    for seed in range(50):
        drawn = resampling.low_variance(np.array([0.0, 1.0, 0.0]), 7, np.random.default_rng(seed))
        assert set(drawn) == {1}


def test_a_cloud_in_one_bin_needs_the_fewest_particles():
    limits = ParticleCount(min_particles=123, max_particles=5000)
    assert resampling.enough_particles(np.full((900, 3), 0.1), limits) == 123


def test_the_count_follows_the_formula_of_kld_sampling():
    # Fox (2003), eq. 7, worked by hand for k = 11 bins: (10 / 0.1)(1 - 1/45 + sqrt(1/45) 0.99)^3
    poses = np.column_stack([np.arange(11) + 0.1, np.zeros(11), np.zeros(11)])
    limits = ParticleCount(min_particles=1, max_particles=5000, kld_err=0.05, kld_z=0.99)
    expected = int(np.ceil(100.0 * (1.0 - 1.0 / 45.0 + np.sqrt(1.0 / 45.0) * 0.99) ** 3))
    assert resampling.enough_particles(poses, limits) == expected


def test_a_cloud_everywhere_takes_the_most():
    poses = np.random.default_rng(0).uniform(-50.0, 50.0, (5000, 3))
    assert resampling.enough_particles(poses, ParticleCount(min_particles=1, max_particles=700)) == 700


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(min_particles=10, max_particles=5), "~min_particles must be in [1, ~max_particles = 5], got 10"),
        (dict(min_particles=0), "~min_particles must be in [1, ~max_particles = 5000], got 0"),
        (dict(kld_err=0.0), "~kld_err must be > 0, got 0.0"),
        (dict(kld_z=-1.0), "~kld_z must be >= 0, got -1.0"),
    ],
)
def test_wrong_limits_are_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        ParticleCount(**values)
    assert str(err.value) == text


def test_weights_that_many_particles_share_are_left_alone():
    log_w = np.random.default_rng(0).normal(0.0, 0.5, 500)
    np.testing.assert_array_equal(resampling.tempered(log_w), resampling.normalised(log_w))


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("scale", [5.0, 100.0, 10000.0])
def test_a_scan_that_one_particle_alone_explains_is_flattened_until_enough_count(seed, scale):
    log_w = scale * np.random.default_rng(seed).standard_normal(500)
    weights = resampling.tempered(log_w, min_effective=20.0)
    assert weights.sum() == pytest.approx(1.0)
    assert resampling.effective_count(resampling.normalised(log_w)) < 20.0  # the case is meant
    assert 20.0 <= resampling.effective_count(weights) < 22.0  # and no flatter than that
    assert np.all(np.diff(weights[np.argsort(log_w)]) >= 0.0)  # the better explained stay the heavier


def test_of_a_few_particles_half_have_to_count():
    weights = resampling.tempered(np.array([0.0, -1e3, -2e3, -3e3]), min_effective=20.0)
    assert resampling.effective_count(weights) == pytest.approx(2.0, rel=0.05)
    np.testing.assert_array_equal(resampling.tempered(np.array([-7.0])), [1.0])


def test_flattening_does_not_depend_on_the_offset():
    log_w = 50.0 * np.random.default_rng(3).standard_normal(100)
    np.testing.assert_allclose(resampling.tempered(log_w), resampling.tempered(log_w - 1e4), rtol=1e-6)


def test_if_nothing_is_possible_flattening_leaves_all_equal():
    np.testing.assert_allclose(resampling.tempered(np.full(30, -np.inf)), 1.0 / 30)


@pytest.mark.parametrize("seed", range(10))
def test_compiled_draws_and_bins_agree_with_numpy(seed):
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.full(200, 0.1))
    drawn = resampling.low_variance(weights, 150, np.random.default_rng(seed))
    strides = (np.arange(150) + np.random.default_rng(seed).uniform()) / 150
    np.testing.assert_array_equal(drawn, np.searchsorted(np.cumsum(weights), strides, side="right"))
    poses = rng.normal(0.0, 2.0, (300, 3))
    bins = len(np.unique(np.floor(poses / resampling.BIN), axis=0))
    share = 2.0 / (9.0 * (bins - 1))
    needed = (bins - 1) / 0.02 * (1.0 - share + np.sqrt(share) * 0.99) ** 3
    limits = ParticleCount(min_particles=1, max_particles=10**6)
    assert resampling.enough_particles(poses, limits) == np.ceil(needed)
