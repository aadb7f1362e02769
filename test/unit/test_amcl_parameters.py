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
            "/amcl: ~min_particles must be in [1, max_particles = 100], got 300",
        ),
        ({"max_particles": 0}, "/amcl: ~min_particles must be in [1, max_particles = 0], got 0"),
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
