"""Files written for amcl: what they leave to defaults must not contradict ours."""

from __future__ import annotations

import pytest

from glass_nav import amcl_parameters, params
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.params import ParamError


def loaded(**given):
    return params.load(LocalizerParams, amcl_parameters.adapted(given, LocalizerParams), "/amcl")


@pytest.mark.parametrize(
    "given, least",
    [
        ({"max_particles": 100}, 100),
        ({"max_particles": 2000}, 300),
        ({}, 300),
        ({"max_particles": 100, "min_particles": 50}, 50),
        ({"min_particles": 6000}, 6000),
    ],
)
def test_few_particles_may_be_asked_for_by_their_maximum_alone(given, least):
    assert loaded(**given).count.min_particles == least


@pytest.mark.parametrize("sigma, most", [(0.05, 0.2), (0.5, 0.5)])
def test_a_wide_scatter_of_ranges_widens_its_limit(sigma, most):
    assert loaded(laser_sigma_hit=sigma).mixture.laser_sigma_hit_max == most


@pytest.mark.parametrize(
    "given, text",
    [
        (
            {"max_particles": 100, "min_particles": 300},
            "/amcl: ~min_particles must be in [1, ~max_particles = 100], got 300",
        ),
        ({"max_particles": 0}, "/amcl: ~max_particles must be in [1, 1000000], got 0"),
        ({"max_particles": -4}, "/amcl: ~max_particles must be in [1, 1000000], got -4"),
        ({"max_particles": 1234567890}, "/amcl: ~max_particles must be in [1, 1000000], got 1234567890"),
        ({"max_particles": 20_000_000}, "/amcl: ~max_particles must be in [1, 1000000], got 20000000"),
        ({"min_particles": 20_000_000}, "/amcl: ~min_particles must be in [1, 1000000], got 20000000"),
        ({"sample_count": 10**9}, "/amcl: ~sample_count must be in [1, 1000], got 1000000000"),
        ({"raycast_threads": 10**6}, "/amcl: ~raycast_threads must be in [1, 256], got 1000000"),
        ({"laser_max_beams": 1}, "/amcl: ~laser_max_beams must be in [2, 10000], got 1"),
        ({"vote_mode": "hard"}, "/amcl: ~vote_mode must be one of soft, paper, got 'hard'"),
        ({"max_particles": "many"}, "/amcl: ~max_particles must be int, got 'many'"),
        (
            {"laser_sigma_hit": 0.5, "laser_sigma_hit_max": 0.2},
            "/amcl: ~laser_sigma_hit_max must be >= ~laser_sigma_hit = 0.5, got 0.2",
        ),
    ],
)
def test_what_is_said_and_contradicts_itself_is_refused(given, text):
    with pytest.raises(ParamError) as err:
        loaded(**given)
    assert str(err.value) == text


def test_a_struct_without_these_parameters_is_left_alone():
    assert amcl_parameters.adapted({"max_particles": 10}, type(LocalizerParams().odometry)) == {"max_particles": 10}
