"""The table is of one clear pane of index 1.51 without absorption, worked out from Fresnel's equations."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.simulation import glass

TABLE = [  # incidence [deg], R, T squared
    (0.0, 0.08, 0.85),
    (30.0, 0.08, 0.85),
    (45.0, 0.095, 0.82),
    (60.0, 0.154, 0.72),
    (70.0, 0.273, 0.53),
    (75.0, 0.384, 0.38),
    (80.0, 0.543, 0.21),
]


def cos(incidence_deg):
    return np.cos(np.deg2rad(incidence_deg))


@pytest.mark.parametrize("incidence_deg, reflected, passed_twice", TABLE)
def test_a_clear_sheet_reflects_and_passes_what_fresnel_says(incidence_deg, reflected, passed_twice):
    r, t = glass.sheet(cos(incidence_deg), 1.0, 0.0)
    assert r == pytest.approx(reflected, abs=0.006)
    assert t**2 == pytest.approx(passed_twice, abs=0.012)


def test_face_on_the_two_surfaces_reflect_by_the_index_alone():
    r = ((1.51 - 1.0) / (1.51 + 1.0)) ** 2
    assert glass.reflectance(1.0, 1.0, 1) == pytest.approx(2.0 * r / (1.0 + r))


def test_at_brewsters_angle_only_the_light_across_is_reflected():
    brewster_rad = np.arctan(1.51)
    inside_rad = np.pi / 2.0 - brewster_rad
    across = np.sin(brewster_rad - inside_rad) ** 2  # Fresnel, with sin of the sum 1
    assert glass.reflectance(np.cos(brewster_rad), 1.0, 1) == pytest.approx(across / (1.0 + across))


def test_thicker_glass_lets_less_through_and_a_flat_beam_has_a_longer_way_in_it():
    _, thin = glass.sheet(cos(60.0), 1.0, 0.004)
    _, thick = glass.sheet(cos(60.0), 1.0, 0.008)
    reflected, clear = glass.sheet(cos(60.0), 1.0, 0.0)
    assert thin > thick
    assert thick / clear == pytest.approx((thin / clear) ** 2)
    way_m = 0.004 / np.sqrt(1.0 - (np.sin(np.deg2rad(60.0)) / 1.51) ** 2)
    assert thin / clear == pytest.approx(np.exp(-glass.ABSORPTION_PER_M * way_m))
    _, face_on = glass.sheet(1.0, 1.0, 0.008)
    assert 0.02 < 1.0 - face_on - glass.reflectance(1.0, 1.0, 1) < 0.05


@pytest.mark.parametrize("coating, face_on", [(2.0, 0.159), (4.0, 0.317), (50.0, glass.LARGEST_REFLECTANCE)])
def test_a_coating_multiplies_the_reflectance_up_to_a_cap(coating, face_on):
    assert glass.reflectance(1.0, coating, 1) == pytest.approx(face_on, abs=0.002)


def test_a_coated_pane_mirrors_as_much_as_a_clear_one_where_that_is_beyond_the_cap():
    flat = cos(89.0)
    assert glass.reflectance(flat, 4.0, 1) == pytest.approx(glass.reflectance(flat, 1.0, 1))
    assert glass.reflectance(flat, 1.0, 1) > glass.LARGEST_REFLECTANCE


def test_two_sheets_reflect_the_sum_of_all_ways_between_them():
    r, t = glass.sheet(cos(50.0), 1.0, 0.0)
    bounces = r + sum(t * r ** (2 * n + 1) * t for n in range(50))
    assert glass.reflectance(cos(50.0), 1.0, 2) == pytest.approx(bounces)


def test_glancing_light_is_mirrored_whole():
    for sheets in (1, 2):
        assert glass.reflectance(0.0, 1.0, sheets) == pytest.approx(1.0)
    assert glass.sheet(0.0, 1.0, 0.01)[1] == pytest.approx(0.0)


def test_visibility_is_half_at_its_half_angle_and_falls_over_its_width():
    half_rad, width_rad = np.deg2rad(20.0), np.deg2rad(2.0)
    seen = glass.visibility(np.deg2rad([0.0, 18.0, 20.0, 22.0, 90.0]), half_rad, width_rad)
    np.testing.assert_allclose(seen, [1.0, 1 / (1 + np.exp(-1)), 0.5, 1 / (1 + np.exp(1)), 0.0], atol=1e-4)
    assert glass.visibility(np.array(0.1), 0.0, 1e-12) == pytest.approx(0.0)
