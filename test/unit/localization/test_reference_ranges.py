"""The four ranges that a beam may show, in buildings whose distances are worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from buildings import BASE_FROM_LASER, CELL_M, Building
from glass_nav.geometry import se2
from glass_nav.localization import reference_ranges
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.wall_thickness import wall_thickness

TO_BOUNDARY_M = CELL_M / 2  # the line of a wall is in the middle of its cells
# Three rooms in a row, with panes at x = 3 and x = 5 m and the last wall at x = 9 m.
ROW = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)], panes=[(3, 0, 3, 4), (5, 0, 5, 4)])


def seen(building, samples, angles_rad, base_from_laser=(0.0, 0.0, 0.0), max_range_m=20.0, max_thickness_m=0.2):
    grid_map = building.grid_map()
    angles_rad = np.asarray(angles_rad, float)
    scan = Scan(0, np.full(len(angles_rad), np.nan), angles_rad, 0.1, max_range_m, np.array(base_from_laser))
    return reference_ranges.of(RayCaster(grid_map), wall_thickness(grid_map), np.atleast_2d(np.array(samples, float)),
                               scan, max_thickness_m, min_linearity=0.9)


def test_head_on_the_three_surfaces_are_where_they_stand():
    offered = seen(ROW, [0.5, 2.0, 0.0], [0.0])
    first, _, second, third = offered.range_m[:, 0, 0]
    np.testing.assert_allclose([first, second, third], np.array([2.5, 4.5, 8.5]) - TO_BOUNDARY_M, atol=1e-6)
    np.testing.assert_allclose(offered.cos_incidence[[0, 2, 3], 0, 0], 1.0, atol=1e-4)
    np.testing.assert_allclose(offered.pane_incidence, 0.0, atol=0.01)


def test_on_a_slant_ranges_grow_as_one_over_the_cosine():
    angle = np.radians(20.0)
    offered = seen(ROW, [0.5, 1.0, 0.0], [angle])
    np.testing.assert_allclose(offered.range_m[[0, 2], 0, 0],
                               (np.array([2.5, 4.5]) - TO_BOUNDARY_M) / np.cos(angle), atol=1e-6)
    np.testing.assert_allclose(offered.cos_incidence[[0, 1, 2], 0, 0], np.cos(angle), atol=1e-3)
    np.testing.assert_allclose(offered.pane_incidence, angle, atol=1e-3)


def test_a_grazing_beam_is_mirrored_into_the_room():
    # From 0.5 m beside the pane y = 2 at 10 degrees: the path goes to the wall x = 6, 5 m along x; behind the pane
    # the building goes on to x = 9.
    building = Building([(0, 0), (6, 0), (6, 2), (9, 2), (9, 6), (0, 6)], panes=[(0, 2, 6, 2)])
    angle = np.radians(10.0)
    offered = seen(building, [1.0, 1.5, 0.0], [angle])
    first, mirrored, second, _ = offered.range_m[:, 0, 0]
    assert first == pytest.approx((0.5 - TO_BOUNDARY_M) / np.sin(angle), abs=1e-6)
    assert mirrored == pytest.approx((5.0 - TO_BOUNDARY_M) / np.cos(angle), abs=0.02)
    assert second == pytest.approx((8.0 - TO_BOUNDARY_M) / np.cos(angle), abs=1e-6)
    assert offered.pane_incidence[0, 0] == pytest.approx(np.radians(80.0), abs=1e-3)


def test_nothing_is_offered_beyond_the_lidars_range():
    offered = seen(ROW, [0.5, 2.0, 0.0], [0.0], max_range_m=4.0)
    np.testing.assert_array_equal(np.isfinite(offered.range_m[:, 0, 0]), [True, False, False, False])
    assert not np.isfinite(seen(ROW, [0.5, 2.0, 0.0], [0.0], max_range_m=2.0).range_m).any()


def test_where_no_surface_is_met_there_is_no_normal_either():
    offered = seen(ROW, [0.5, 2.0, 0.0], [0.0], max_range_m=2.0)
    np.testing.assert_array_equal(offered.cos_incidence, 1.0)
    assert np.isnan(offered.pane_incidence).all()


def test_a_thick_wall_ends_the_beam_and_says_how_thick_it_is():
    building = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)],
                        walls=[(3 + CELL_M * cell, 0, 3 + CELL_M * cell, 4) for cell in range(7)])
    offered = seen(building, [0.5, 2.0, 0.0], [0.0])
    assert np.isfinite(offered.range_m[0, 0, 0])
    assert not np.isfinite(offered.range_m[2:, 0, 0]).any()
    assert offered.thickness_m[0, 0, 0] == pytest.approx(7 * CELL_M)
    passed = seen(building, [0.5, 2.0, 0.0], [0.0], max_thickness_m=0.4)
    assert passed.range_m[2, 0, 0] == pytest.approx(8.5 - TO_BOUNDARY_M)


def test_a_post_has_no_normal_and_mirrors_nothing():
    post = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)], walls=[(3, 2, 3, 2)])  # one cell alone
    offered = seen(post, [0.5, 2.0, 0.0], [0.0])
    assert offered.range_m[0, 0, 0] == pytest.approx(2.5 - TO_BOUNDARY_M)
    assert np.isinf(offered.range_m[1, 0, 0])
    assert offered.cos_incidence[0, 0, 0] == 1.0
    assert np.isnan(offered.pane_incidence[0, 0])


@pytest.mark.parametrize("seed", range(5))
def test_from_anywhere_surfaces_are_half_a_cell_before_the_lines_of_the_building(seed):
    """Against the building as lines: half a cell across the wall, along x or along y."""
    rng = np.random.default_rng(seed)
    samples = np.column_stack([rng.uniform(-0.5, 2.5, 20), rng.uniform(0.5, 3.5, 20), rng.uniform(-3.0, 3.0, 20)])
    angles_rad = np.linspace(-np.pi, np.pi, 40, endpoint=False)
    offered = seen(ROW, samples, angles_rad, BASE_FROM_LASER)
    checked = 0
    for sample, ranges_m in zip(samples, offered.range_m.transpose(1, 2, 0)):
        laser = se2.compose(sample, BASE_FROM_LASER)
        crossed_m, _ = ROW.crossings(laser, angles_rad)
        cos, sin = np.abs(np.cos(angles_rad + laser[2])), np.abs(np.sin(angles_rad + laser[2]))
        crossing = laser[:2] + np.minimum(crossed_m, 1e6)[..., None] * np.stack([
            np.cos(angles_rad + laser[2]), np.sin(angles_rad + laser[2])], axis=-1)[:, None]
        to_end_m = np.linalg.norm(crossing[:, :, None] - ROW.lines_m.reshape(-1, 2), axis=-1).min(axis=(1, 2))
        clear = (cos > 0.3) & (sin > 0.3) & (to_end_m > 0.4)  # neither grazing nor into a corner
        for surface, reference in enumerate([0, 2, 3]):
            met = clear & np.isfinite(crossed_m[:, surface])
            np.testing.assert_array_equal(np.isfinite(ranges_m[clear, reference]), met[clear])
            short_m = crossed_m[met, surface] - ranges_m[met, reference]
            off = np.minimum(np.abs(short_m * cos[met] - TO_BOUNDARY_M), np.abs(short_m * sin[met] - TO_BOUNDARY_M))
            assert off.max(initial=0.0) < 1e-6
            checked += np.count_nonzero(met)
    assert checked > 300


def test_every_sample_and_beam_has_its_own_place():
    samples = np.array([[0.5, 2.0, 0.0], [0.0, 1.0, 0.3], [2.0, 3.0, -2.0]])
    angles_rad = np.array([0.0, 0.1, 1.5, -2.0])
    together = seen(ROW, samples, angles_rad, BASE_FROM_LASER)
    for row, sample in enumerate(samples):
        for column, angle in enumerate(angles_rad):
            alone = seen(ROW, sample, [angle], BASE_FROM_LASER)
            np.testing.assert_allclose(together.range_m[:, row, column], alone.range_m[:, 0, 0])
            np.testing.assert_allclose(together.cos_incidence[:, row, column], alone.cos_incidence[:, 0, 0])
            np.testing.assert_allclose(together.thickness_m[:, row, column], alone.thickness_m[:, 0, 0])
            np.testing.assert_allclose(together.pane_incidence[row, column], alone.pane_incidence[0, 0])
