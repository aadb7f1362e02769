"""Intensities count where walls show what they mean, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.panes import wall_intensity
from glass_nav.panes.wall_intensity import WallIntensity


def of_walls(intensity, count=40_000, seed=0):
    """A curve learnt from walls; intensity(range_m, incidence_rad, rng) -> (N,)."""
    rng = np.random.default_rng(seed)
    range_m, incidence_rad = rng.uniform(0.5, 12.0, count), rng.uniform(0.0, 1.2, count)
    walls = WallIntensity()
    walls.learn(range_m, incidence_rad, intensity(range_m, incidence_rad, rng))
    return walls


def falling(range_m, incidence_rad, rng):
    """Of grey walls, with the square of the range."""
    return 600.0 * rng.uniform(0.8, 1.2, len(range_m)) * np.cos(incidence_rad) / range_m**2


def excess(walls, range_m, incidence_deg, intensity):
    return float(walls.excess(np.array([range_m]), np.radians([incidence_deg]), np.array([intensity]))[0])


def test_a_return_is_compared_with_walls_at_its_range_and_incidence():
    walls = of_walls(falling)
    assert walls.is_informative
    assert abs(excess(walls, 2.4, 3.0, 600.0 / 2.4**2)) < 1.0
    assert excess(walls, 2.4, 3.0, 3.0 * 600.0 / 2.4**2) > 4.0
    assert excess(walls, 7.0, 50.0, 600.0 / 2.4**2) > 4.0  # what is usual near by is not from there
    assert excess(walls, 2.4, 3.0, 0.0) < -3.0


@pytest.mark.parametrize(
    "intensity",
    [
        pytest.param(lambda range_m, incidence_rad, rng: np.full(len(range_m), 47.0), id="a constant"),
        pytest.param(lambda range_m, incidence_rad, rng: np.zeros(len(range_m)), id="zeros"),
        pytest.param(lambda range_m, incidence_rad, rng: np.full(len(range_m), np.nan), id="NaN"),
    ],
)
def test_intensities_that_carry_nothing_say_nothing(intensity):
    walls = of_walls(intensity)
    assert not walls.is_informative
    assert np.isnan(excess(walls, 2.0, 3.0, 900.0))


def test_nothing_is_said_before_enough_walls_were_seen_there():
    walls = of_walls(falling, count=60)
    assert np.isnan(excess(walls, 2.0, 3.0, 900.0))
    assert np.isnan(excess(WallIntensity(), 2.0, 3.0, 900.0))


def test_returns_unlike_walls_speak_for_a_pane_and_returns_like_them_against_it():
    assert wall_intensity.log_odds(np.full(50, 8.0)) > 1.0
    assert wall_intensity.log_odds(np.zeros(50)) < -0.5
    assert abs(wall_intensity.log_odds(np.full(1000, 50.0))) <= 2.0 + 1e-9
    assert wall_intensity.log_odds(np.full(3, np.nan)) == wall_intensity.log_odds(np.zeros(0)) == 0.0


def test_the_incidence_is_that_of_the_surface_that_neighbouring_beams_met():
    beam_rad = np.radians(np.arange(-60.0, 61.0))
    wall = 2.0 / np.cos(beam_rad)  # at x = 2 m
    points_m = wall[:, None] * np.stack([np.cos(beam_rad), np.sin(beam_rad)], axis=-1)
    points_m[100] = np.nan
    incidence_rad = wall_intensity.incidence(points_m, beam_rad)
    np.testing.assert_allclose(incidence_rad[3:97], np.abs(beam_rad[3:97]), atol=1e-9)
    assert np.isnan(incidence_rad[[0, 97, 103, 120]]).all()


@pytest.mark.parametrize("beams", [1, 5, 6, 7])
def test_a_scan_of_few_beams_has_no_surfaces(beams):
    assert np.isnan(wall_intensity.incidence(np.zeros((beams, 2)), np.zeros(beams))).sum() >= min(beams, 6)
