"""The four ranges that a beam may show, in buildings whose distances are worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
import slow_expected_ranges
from buildings import BASE_FROM_LASER, CELL_M, Building

from glass_nav.geometry import se2
from glass_nav.localization.beam_classification import expected_ranges
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.wall_thickness import wall_thickness
from glass_nav.world.grid_map import UNKNOWN, GridMap

TO_BOUNDARY_M = CELL_M / 2  # the line of a wall is in the middle of its cells
# Three rooms in a row, with panes at x = 3 and x = 5 m and the last wall at x = 9 m.
ROW = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)], panes=[(3, 0, 3, 4), (5, 0, 5, 4)])


def seen(building, samples, angles_rad, base_from_laser=(0.0, 0.0, 0.0), max_range_m=20.0, max_thickness_m=0.2):
    grid_map = building.grid_map()
    angles_rad = np.asarray(angles_rad, float)
    scan = Scan(0, np.full(len(angles_rad), np.nan), angles_rad, 0.1, max_range_m, np.array(base_from_laser))
    return expected_ranges.of(
        RayCaster(grid_map),
        wall_thickness(grid_map),
        np.atleast_2d(np.array(samples, float)),
        scan,
        max_thickness_m,
        min_linearity=0.9,
    )


def test_head_on_the_three_surfaces_are_where_they_stand():
    offered = seen(ROW, [0.5, 2.0, 0.0], [0.0])
    first, _, second, third = offered.range_m[:, 0, 0]
    np.testing.assert_allclose([first, second, third], np.array([2.5, 4.5, 8.5]) - TO_BOUNDARY_M, atol=1e-6)
    np.testing.assert_allclose(offered.cos_incidence[[0, 2, 3], 0, 0], 1.0, atol=1e-4)
    np.testing.assert_allclose(offered.pane_incidence, 0.0, atol=0.01)


def test_on_a_slant_ranges_grow_as_one_over_the_cosine():
    angle = np.radians(20.0)
    offered = seen(ROW, [0.5, 1.0, 0.0], [angle])
    np.testing.assert_allclose(
        offered.range_m[[0, 2], 0, 0], (np.array([2.5, 4.5]) - TO_BOUNDARY_M) / np.cos(angle), atol=1e-6
    )
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
    building = Building(
        [(-1, 0), (9, 0), (9, 4), (-1, 4)], walls=[(3 + CELL_M * cell, 0, 3 + CELL_M * cell, 4) for cell in range(7)]
    )
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
        crossing = (
            laser[:2]
            + np.minimum(crossed_m, 1e6)[..., None]
            * np.stack([np.cos(angles_rad + laser[2]), np.sin(angles_rad + laser[2])], axis=-1)[:, None]
        )
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
            alone = seen(ROW, np.tile(sample, (row + 1, 1)), np.full(column + 1, angle), BASE_FROM_LASER)
            for name in ("range_m", "cos_incidence", "thickness_m", "cell"):
                one, other = getattr(together, name), getattr(alone, name)
                np.testing.assert_allclose(one[:, row, column], other[:, row, column])
            if row == 0:
                np.testing.assert_allclose(together.pane_incidence[0, column], alone.pane_incidence[0, column])
            if row == 0:
                np.testing.assert_allclose(together.line_m[:, column], alone.line_m[:, column])
                np.testing.assert_allclose(together.axis_rad[:, column], alone.axis_rad[:, column])
                np.testing.assert_array_equal(together.seen_side[:, column], alone.seen_side[:, column])


# -- cells


def test_the_cells_that_answer_are_those_of_the_walls():
    grid_map = ROW.grid_map()
    offered = seen(ROW, [0.5, 2.0, 0.0], [0.0])
    expected = [
        int(np.ravel_multi_index(grid_map.cells(np.array([[x, 2.0]])), grid_map.occupancy.shape)[0])
        for x in (3.0, -1.0, 5.0, 9.0)
    ]  # mirrored head-on: the wall behind the robot
    assert offered.cell[:, 0, 0].tolist() == expected
    assert seen(ROW, [0.5, 2.0, 0.0], [0.0], max_range_m=1.0).cell[:, 0, 0].tolist() == [-1] * 4


def test_the_mirrored_reference_is_of_the_surface_where_the_path_ends():
    """A pane along x mirrors a beam of 30 degrees into a wall along y, three cells thick, met at 30 degrees, too."""
    building = Building(
        [(0, 0), (6.5, 0), (6.5, 4), (0, 4)],
        panes=[(0, 2, 6, 2)],
        walls=[(6 + CELL_M * cell, 0, 6 + CELL_M * cell, 4) for cell in range(3)],
    )
    angle = np.radians(30.0)
    offered = seen(building, [3.0, 0.6, 0.0], [angle])
    grid_map = building.grid_map()
    row, column = np.divmod(offered.cell[1, 0, 0], grid_map.occupancy.shape[1])
    met = grid_map.centres(np.array([row]), np.array([column]))[0]
    assert met == pytest.approx([6.0, 1.4 - 3.0 * np.tan(angle) + 2.0], abs=0.08)
    assert offered.cos_incidence[1, 0, 0] == pytest.approx(np.cos(angle), abs=0.01)
    assert offered.cos_incidence[0, 0, 0] == pytest.approx(np.sin(angle), abs=0.01)
    assert offered.thickness_m[1, 0, 0] == pytest.approx(3 * CELL_M)
    assert offered.thickness_m[0, 0, 0] == pytest.approx(CELL_M)


# -- corners that may be missed

POST = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)], walls=[(3, 2, 3, 2)])  # one cell alone: no normal
POST_BEHIND_PANE = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)], panes=[(3, 0, 3, 4)], walls=[(5, 2, 5, 2)])


def by_parity(building, surface):
    """Samples all at one place, beams all one way: which of them (N, B) see that surface at its place."""
    offered = seen(building, np.tile([0.5, 2.0, 0.0], (5, 1)), np.zeros(4))
    return offered, np.isclose(offered.range_m[{1: 0, 2: 2, 3: 3}[surface]], offered.range_m[0, 0, 0])


def test_half_of_the_samples_see_past_a_post_but_the_pose_itself_does_not():
    offered, at_the_post = by_parity(POST, 1)
    assert at_the_post[0].all()
    assert at_the_post[1:].sum(axis=0).tolist() == [2] * 4  # for each beam half of the samples
    assert at_the_post[1:].sum(axis=1).tolist() == [2] * 4  # for each sample half of the beams
    wall_m = 8.5 - TO_BOUNDARY_M
    np.testing.assert_allclose(offered.range_m[0][~at_the_post], wall_m)  # what is behind moves up
    np.testing.assert_allclose(offered.range_m[2][at_the_post], wall_m)
    assert np.isinf(offered.range_m[2][~at_the_post]).all() and np.isinf(offered.range_m[1]).all()
    assert (offered.cell[2][~at_the_post] == -1).all()
    assert len(set(offered.cell[0][~at_the_post])) == 1 and (offered.cell[0][~at_the_post] > 0).all()
    np.testing.assert_allclose(offered.cos_incidence[0][~at_the_post], 1.0, atol=1e-3)


def test_a_post_behind_a_pane_may_be_missed_and_the_pane_may_not():
    offered, _ = by_parity(POST_BEHIND_PANE, 2)
    np.testing.assert_allclose(offered.range_m[0], 2.5 - TO_BOUNDARY_M)
    post_m, wall_m = np.array([4.5, 8.5]) - TO_BOUNDARY_M
    missed = np.isclose(offered.range_m[2], wall_m)
    assert not missed[0].any() and missed[1:].sum(axis=0).tolist() == [2] * 4
    np.testing.assert_allclose(offered.range_m[2][~missed], post_m)
    np.testing.assert_allclose(offered.range_m[3][~missed], wall_m)
    assert np.isinf(offered.range_m[3][missed]).all()
    assert np.isfinite(offered.range_m[1]).all()  # the pane still mirrors


def test_what_is_mirrored_at_a_corner_is_missed_with_it():
    """Nothing is mirrored where the first surface is taken out: what moves up is not where the path would turn."""
    offered, at_the_post = by_parity(POST, 1)
    assert np.isinf(offered.range_m[1]).all() and (offered.cell[1][~at_the_post] == -1).all()


def test_a_wall_is_missed_by_no_sample():
    offered = seen(ROW, np.tile([0.5, 2.0, 0.0], (6, 1)), np.linspace(-0.5, 0.5, 7))
    np.testing.assert_array_equal(offered.range_m, offered.range_m[:, :1].repeat(6, axis=1))


# -- lines of walls


def slanted(slant_rad, offset_m=4.0, map_from_grid=(-2.0, 3.0, 0.4), cell_m=CELL_M):
    """A wall across a map of 12 m, its normal at slant_rad in the grid, offset_m from the grid's centre: cells whose
    centre is within half a cell of the line."""
    row, column = np.mgrid[:240, :240] + 0.5
    across = (column - 120) * np.cos(slant_rad) + (row - 120) * np.sin(slant_rad) - offset_m / cell_m
    return GridMap(np.where(np.abs(across) <= 0.5, 100, 0).astype(np.int8), cell_m, np.array(map_from_grid))


def on_map(grid_map, angles_rad, pose_in_grid):
    scan = Scan(0, np.full(len(angles_rad), np.nan), np.asarray(angles_rad), 0.1, 30.0, np.zeros(3))
    pose = se2.compose(grid_map.map_from_grid, np.array(pose_in_grid))
    return expected_ranges.of(RayCaster(grid_map), wall_thickness(grid_map), pose[None], scan, 0.2, 0.9)


@pytest.mark.parametrize("slant_deg", [3.0, 14.0, 31.0, 42.0, 58.0, -20.0])
def test_a_beam_crosses_the_line_of_a_wall_not_the_staircase_of_its_cells(slant_deg):
    """Against the line itself; up to 84 degrees of incidence, where the staircase is decimetres off."""
    slant = np.radians(slant_deg)
    grid_map = slanted(slant)
    incidence = np.radians(np.array([-75.0, -40.0, 0.0, 20.0, 60.0, 78.0, 84.0]))
    start = 6.0 + 3.2 * np.array([np.cos(slant), np.sin(slant)])  # 0.8 m before the wall
    offered = on_map(grid_map, slant + incidence, [*start, 0.0])
    true_m = 0.8 / np.cos(incidence)
    met = np.isfinite(offered.range_m[0, 0])
    assert met[1:6].all()
    off_m = np.abs(offered.line_m[0] - true_m) * np.cos(incidence)
    assert off_m[met].max() < 0.2 * CELL_M
    np.testing.assert_allclose(np.cos(2.0 * (offered.axis_rad[0, met] - slant - 0.4)), 1.0, atol=1e-3)


def test_the_line_of_a_wall_that_is_drawn_thick_is_half_a_cell_behind_its_face():
    """A costmap is to see the face of the wall that the robot drives at, from either side."""
    thick = [(3 + CELL_M * cell, 0, 3 + CELL_M * cell, 4) for cell in range(3)]
    building = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)], walls=thick)
    angle = np.radians(40.0)
    for pose, to_face_m in (([0.5, 1.0, 0.0], 2.5), ([6.0, 1.0, np.pi], 3.0 - 2 * CELL_M)):
        offered = seen(building, pose, [0.0, angle if pose[2] == 0.0 else -angle])
        np.testing.assert_allclose(offered.line_m[0], to_face_m / np.cos([0.0, angle]), atol=0.05 * CELL_M)


def test_the_line_is_nearer_the_truth_than_the_cells_are():
    rng = np.random.default_rng(0)
    by_line, by_cells = [], []
    for _ in range(30):
        slant = rng.uniform(-np.pi, np.pi)
        incidence = np.radians(rng.uniform(-80.0, 80.0, 12))
        start = 6.0 + 2.5 * np.array([np.cos(slant), np.sin(slant)])
        offered = on_map(slanted(slant, 3.0), slant + incidence, [*start, 0.0])
        true_m = 0.5 / np.cos(incidence)
        by_line.append(offered.line_m[0] - true_m)
        by_cells.append(offered.range_m[0, 0] - true_m)
    by_line, by_cells = np.abs(np.concatenate(by_line)), np.abs(np.concatenate(by_cells))
    assert np.median(by_line) < 0.2 * np.median(by_cells) and by_line.max() < by_cells.max()


def test_the_lines_of_the_walls_behind_are_found_as_well():
    angle = np.radians(18.0)
    offered = seen(ROW, [0.5, 0.5, 0.0], [angle])
    np.testing.assert_allclose(offered.line_m[[0, 2, 3], 0], np.array([2.5, 4.5, 8.5]) / np.cos(angle), atol=1e-3)
    np.testing.assert_allclose(np.cos(offered.axis_rad[[0, 2, 3], 0]) ** 2, 1.0, atol=1e-4)
    assert offered.face_m == pytest.approx(TO_BOUNDARY_M)


def test_a_mirrored_path_goes_from_line_to_line():
    """Head-on into the pane x = 3 and back to the wall x = -1, whose image stands at x = 7."""
    offered = seen(ROW, [0.5, 2.0, 0.0], [0.0])
    assert offered.line_m[1, 0] == pytest.approx(2.5 + 4.0, abs=0.1 * CELL_M)
    assert np.cos(offered.axis_rad[1, 0]) ** 2 == pytest.approx(1.0, abs=1e-4)


def test_the_axis_of_a_mirrored_wall_is_that_of_its_image():
    """A pane of 45 degrees shows a wall along x as one along y."""
    occupancy = np.zeros((240, 240), np.int8)
    occupancy[230] = 100
    row, column = np.indices(occupancy.shape)
    occupancy[np.abs(row - column) <= 0.5] = 100  # the pane y = x
    grid_map = GridMap(occupancy, CELL_M, np.zeros(3))
    scan = Scan(0, np.full(1, np.nan), np.zeros(1), 0.1, 30.0, np.zeros(3))
    offered = expected_ranges.of(
        RayCaster(grid_map), wall_thickness(grid_map), np.array([[2.0, 6.0, 0.0]]), scan, 0.2, 0.9
    )
    assert np.isfinite(offered.range_m[1, 0, 0])  # along x to the pane at x = 6, then up to y = 11.5
    assert offered.range_m[1, 0, 0] == pytest.approx(4.0 + 5.5, abs=0.1)
    assert np.cos(2.0 * offered.axis_rad[1, 0]) == pytest.approx(1.0, abs=0.01)  # its normal along x
    assert offered.cos_incidence[1, 0, 0] == pytest.approx(1.0, abs=0.02)  # met face on, though the beam goes along it


def test_where_there_is_no_line_the_cell_is_told_or_nothing():
    post = seen(POST, [0.5, 2.0, 0.0], [0.0])
    assert post.line_m[0, 0] == pytest.approx(post.range_m[0, 0, 0] + TO_BOUNDARY_M) and np.isnan(post.axis_rad[0, 0])
    nothing = seen(ROW, [0.5, 2.0, 0.0], [0.0, 0.3], max_range_m=1.0)
    assert np.isinf(nothing.line_m).all() and np.isnan(nothing.axis_rad).all()


def test_a_beam_along_a_wall_ends_where_the_cells_begin():
    """Nearly parallel to it the line is crossed anywhere; the face of a wall is met where its cells are."""
    building = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)], walls=[(4, 2, 8, 2)])
    offered = seen(building, [0.0, 2.0 + 0.01, 0.0], [np.radians(0.1), 0.0])
    assert np.all(np.abs(offered.range_m[0, 0] - 4.0) < CELL_M)
    assert np.all(np.abs(offered.line_m[0] - 4.0) < 4 * CELL_M)


# -- sides that nobody saw


def test_a_wall_met_from_a_side_that_is_unknown_is_reported():
    """A building as a mapper draws it: free inside, unknown outside; seen from a room through a pane, and back."""
    grid_map = ROW.grid_map()
    occupancy = grid_map.occupancy.copy()
    x, y = grid_map.centres(*np.indices(occupancy.shape).reshape(2, -1)).T
    outside = ((x < -1.0) | (x > 5.0) | (y < 0.0) | (y > 4.0)).reshape(occupancy.shape)
    occupancy[outside & (occupancy == 0)] = UNKNOWN  # the last of the three rooms was never mapped
    world = GridMap(occupancy, grid_map.resolution_m, grid_map.map_from_grid)

    def sides(pose, angle):
        scan = Scan(0, np.full(1, np.nan), np.array([angle]), 0.1, 30.0, np.zeros(3))
        return (
            expected_ranges.of(RayCaster(world), wall_thickness(world), np.array([pose]), scan, 0.2, 0.9)
            .seen_side[:, 0]
            .tolist()
        )

    # first x = 3, mirrored to x = -1, second x = 5 from inside; the third, x = 9, lies in what is unknown
    assert sides([0.5, 2.0, 0.0], 0.0) == [True, True, True, False]
    # from the unmapped room: x = 5 from outside; the mirrored path ends at x = 9 from there, too
    assert sides([7.0, 2.0, 0.0], np.pi) == [False, False, True, True]


def test_a_post_is_seen_from_where_the_beam_comes():
    world = POST.grid_map()
    occupancy = world.occupancy.copy()
    column = int(world.cells(np.array([[3.0, 2.0]]))[1][0])
    for hidden, told in ((slice(column + 1, None), True), (slice(None, column), False)):
        half = occupancy.copy()
        part = half[:, hidden]
        part[part == 0] = UNKNOWN
        grid_map = GridMap(half, world.resolution_m, world.map_from_grid)
        scan = Scan(0, np.full(1, np.nan), np.zeros(1), 0.1, 30.0, np.zeros(3))
        offered = expected_ranges.of(
            RayCaster(grid_map), wall_thickness(grid_map), np.array([[0.5, 2.0, 0.0]]), scan, 0.2, 0.9
        )
        assert offered.seen_side[0, 0] == told


def test_what_is_not_met_and_what_lies_at_the_border_of_the_map():
    offered = seen(ROW, [0.5, 2.0, 0.0], [0.0], max_range_m=1.0)
    assert offered.seen_side.all()  # nothing there: nothing to doubt
    cells = np.zeros((40, 40), np.int8)
    cells[:, 39] = 100  # the last column: beside it from outside is no map
    grid_map = GridMap(cells, CELL_M, np.zeros(3))
    scan = Scan(0, np.full(1, np.nan), np.array([np.pi]), 0.1, 30.0, np.zeros(3))
    outside = expected_ranges.of(
        RayCaster(grid_map), wall_thickness(grid_map), np.array([[3.0, 1.0, 0.0]]), scan, 0.2, 0.9
    )
    assert np.isfinite(outside.range_m[0, 0, 0]) and not outside.seen_side[0, 0]


# -- against numpy, and what may be left out

SLANTED = Building(
    [(0, 0), (9, 1), (8, 7), (-1, 6)],
    panes=[(3, 0.4, 2.6, 6.2), (5, 0.6, 5.2, 6.5)],
    walls=[(6, 3, 6, 3), (1, 4, 1.6, 4)],
)
SAMPLES = np.array([1.5, 2.0, 0.4]) + np.random.default_rng(1).normal(0.0, 1.0, (9, 3)) * [0.02, 0.02, 0.005]
BEAMS_RAD = np.radians(np.arange(-135.0, 135.0, 1.0))


def of_slanted(how, yaw, **options):
    """Expected ranges in a building that is turned in the map, and the scan of what is measured there."""
    grid_map = SLANTED.grid_map()
    grid_map = GridMap(grid_map.occupancy, grid_map.resolution_m, se2.compose([3.0, -1.0, yaw], grid_map.map_from_grid))
    caster, samples = RayCaster(grid_map), se2.compose(np.array([3.0, -1.0, yaw]), SAMPLES)
    hits = caster.cast_surfaces(samples[:1], BEAMS_RAD, 20.0)
    beam = np.arange(len(BEAMS_RAD))
    ends = np.stack([hits.first_m, hits.second_m, hits.third_m, hits.mirrored_m])[beam % 4, 0, beam]
    measured_m = np.where(np.isfinite(ends), ends + 0.03, hits.first_m[0] - 0.5)
    measured_m[::9] = np.inf
    scan = Scan(0, measured_m, BEAMS_RAD, 0.1, 20.0, np.zeros(3))
    return how.of(caster, wall_thickness(grid_map), samples, scan, 0.2, 0.9, **options), measured_m


@pytest.mark.parametrize("yaw", [0.0, 0.7])
@pytest.mark.parametrize("options", [{}, {"behind_m": 0.6}, {"mirrored_by_line": False}], ids=str)
def test_without_a_gate_all_is_as_in_numpy(yaw, options):
    fast, _ = of_slanted(expected_ranges, yaw, **options)
    slow, _ = of_slanted(slow_expected_ranges, yaw, **options)
    met = slow.cell >= 0
    assert met[1:].sum() > 300
    np.testing.assert_array_equal(fast.cell, slow.cell)
    np.testing.assert_allclose(fast.range_m, slow.range_m, atol=1e-4)
    np.testing.assert_allclose(fast.cos_incidence, slow.cos_incidence, atol=1e-5)
    np.testing.assert_array_equal(fast.thickness_m[met], slow.thickness_m[met])
    np.testing.assert_allclose(fast.line_m, slow.line_m, atol=1e-4)
    np.testing.assert_allclose(fast.pane_incidence, slow.pane_incidence, atol=1e-3)
    np.testing.assert_allclose(np.cos(2.0 * fast.axis_rad), np.cos(2.0 * slow.axis_rad), atol=1e-4)
    np.testing.assert_array_equal(fast.seen_side, slow.seen_side)


def test_what_a_gate_leaves_out_did_not_end_the_beam():
    gate_m = 0.15
    (gated, measured_m), (whole, _) = (of_slanted(expected_ranges, 0.3, gate_m=gate) for gate in (gate_m, np.inf))
    np.testing.assert_array_equal(gated.range_m[:, 0], whole.range_m[:, 0])
    with np.errstate(invalid="ignore"):
        across_m = (measured_m - whole.range_m) * np.maximum(whole.cos_incidence, expected_ranges.MIN_COS)
        may_end = (across_m >= -gate_m) & (across_m <= gate_m)
    off_m = (gated.range_m[may_end] - whole.range_m[may_end]) * whole.cos_incidence[may_end]
    assert abs(off_m).max() < CELL_M  # along a straight wall its line is told, not the steps of its cells
    assert abs(off_m.mean()) < 0.04 * CELL_M
    left_out = np.isfinite(whole.range_m) & ~np.isfinite(gated.range_m)
    assert np.count_nonzero(left_out[1:, 1:]) > 0.2 * np.count_nonzero(np.isfinite(whole.range_m[1:, 1:]))
    assert not np.isfinite(gated.range_m[:, 1:, ~np.isfinite(measured_m)]).any()


def test_poses_nearby_see_a_straight_wall_where_rays_end():
    # At the panes and walls of a row of rooms, which are parallel to the grid: a wall has no steps there.
    samples = np.array([0.5, 2.0, 0.1]) + np.random.default_rng(2).normal(0.0, 1.0, (9, 3)) * [0.02, 0.02, 0.005]
    angles_rad = np.radians(np.arange(-20.0, 20.0, 0.5))
    grid_map = ROW.grid_map()
    caster, thickness_m = RayCaster(grid_map), wall_thickness(grid_map)
    scan = Scan(0, caster.cast(samples[:1], angles_rad, 20.0)[0] + 0.02, angles_rad, 0.1, 20.0, np.zeros(3))
    by_line, by_ray = (
        expected_ranges.of(caster, thickness_m, samples, scan, 0.2, 0.9, gate_m=gate_m) for gate_m in (0.15, np.inf)
    )
    needed = np.isfinite(by_line.range_m)
    assert needed[0].all() and not needed[2:, 1:, 20:60].any()  # the beams ended at the first pane
    for name in ("range_m", "cos_incidence", "thickness_m"):
        np.testing.assert_allclose(getattr(by_line, name)[needed], getattr(by_ray, name)[needed], atol=1e-4)
