"""What lies behind the first surface, how thick it is, where it faces, and what it mirrors."""

from __future__ import annotations

import re

import numpy as np
import pytest
import slow_raycast

from glass_nav.geometry.angles import wrap
from glass_nav.geometry.se2 import compose, inverse
from glass_nav.sensing.raycast import RayCaster, SurfaceHits
from glass_nav.world.grid_map import UNKNOWN, GridMap

CELL_M = 0.05
BACKENDS = ["exact", "mrpt"]


def three_walls(thickness_cells=(1, 2, 3), map_from_grid=(0.0, 0.0, 0.0)) -> GridMap:
    """Walls across the map that begin at 2, 4 and 6 m of 8 x 20 m."""
    cells = np.zeros((400, 160), np.int8)
    for start, thickness in zip((40, 80, 120), thickness_cells):
        cells[:, start : start + thickness] = 100
    return GridMap(cells, CELL_M, np.array(map_from_grid))


def hits(world, pose, angle_rad, backend="exact", max_range_m=30.0, **limits) -> SurfaceHits:
    return RayCaster(world, backend).cast_surfaces([pose], [angle_rad], max_range_m, **limits)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("angle_deg", [0.0, 20.0, -55.0])
def test_three_walls_one_behind_the_other(angle_deg, backend):
    cos = np.cos(np.radians(angle_deg))
    found = hits(three_walls(), [1.0, 10.0, 0.0], np.radians(angle_deg), backend)
    assert found.first_m[0, 0] == pytest.approx(1.0 / cos)
    assert found.second_m[0, 0] == pytest.approx(3.0 / cos)
    assert found.third_m[0, 0] == pytest.approx(5.0 / cos)
    assert found.first_thickness_m[0, 0] == pytest.approx(0.05, rel=1e-5)  # along the normal, not along the ray
    assert found.second_thickness_m[0, 0] == pytest.approx(0.10, rel=1e-5)
    assert abs(wrap(found.normal_rad[0, 0] - np.pi)) < 1e-6  # towards the robot
    assert found.linearity[0, 0] > 0.99
    columns = [cell[0, 0] % 160 for cell in (found.first_cell, found.second_cell, found.third_cell)]
    assert columns == [40, 80, 120]


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_normal_is_in_the_frame_of_the_map(backend):
    world = three_walls(map_from_grid=(3.0, -2.0, 0.7))
    start = world.centres(np.array([200]), np.array([20]))[0]
    found = hits(world, [*start, 0.7], 0.0, backend)
    assert abs(wrap(found.normal_rad[0, 0] - 0.7 - np.pi)) < 1e-5
    axis_rad = RayCaster(world).normals()[0][200 * 160 + 40]
    assert abs(wrap(2.0 * (axis_rad - 0.7))) < 1e-5


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_wall_thicker_than_allowed_ends_the_ray(backend):
    found = hits(three_walls((1, 8, 1)), [1.0, 10.0, 0.0], 0.0, backend, max_thickness_m=0.3)
    assert np.isfinite([found.first_m, found.second_m, found.first_thickness_m]).all()
    assert (found.third_m == np.inf).all() and (found.second_thickness_m == np.inf).all()
    assert (found.third_cell == -1).all()


def test_thickness_is_judged_along_the_normal_not_along_the_ray():
    """At 75 degrees the ray is 0.39 m in a wall of 0.1 m."""
    found = hits(three_walls((2, 2, 2)), [1.0, 2.0, 0.0], np.radians(75.0), max_thickness_m=0.15)
    assert np.isfinite(found.second_m[0, 0])
    assert found.first_thickness_m[0, 0] == pytest.approx(0.1, rel=1e-5)


@pytest.mark.parametrize(
    "min_gap_m, second_m", [pytest.param(0.16, 3.0, id="one surface"), pytest.param(0.14, 1.2, id="two surfaces")]
)
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_gap_parts_two_surfaces_only_if_it_is_long_enough(min_gap_m, second_m, backend):
    world = three_walls((1, 1, 1))
    world.occupancy[:, 44] = 100  # 0.15 m behind the first
    found = hits(world, [1.0, 10.0, 0.0], 0.0, backend, min_gap_m=min_gap_m)
    assert found.second_m[0, 0] == pytest.approx(second_m)
    assert found.first_thickness_m[0, 0] == pytest.approx(0.05 if second_m < 3.0 else 0.25, rel=1e-5)


def test_a_ray_that_ends_in_a_wall_did_not_pass_it():
    found = hits(three_walls((4, 1, 1)), [1.0, 10.0, 0.0], 0.0, max_range_m=1.1)
    assert found.first_m[0, 0] == pytest.approx(1.0) and found.first_thickness_m[0, 0] == np.inf


def test_unknown_cells_that_stop_rays_hide_what_is_behind():
    world = three_walls()
    world.occupancy[:, 60] = UNKNOWN
    caster = RayCaster(world, unknown="stop")
    found = caster.cast_surfaces([[1.0, 10.0, 0.0]], [0.0], 30.0)
    assert found.first_thickness_m[0, 0] == pytest.approx(0.05, rel=1e-5) and found.second_m[0, 0] == np.inf
    world.occupancy[:, 41] = UNKNOWN  # right behind the pane: how thick it is remains unknown
    found = RayCaster(world, unknown="stop").cast_surfaces([[1.0, 10.0, 0.0]], [0.0], 30.0)
    assert found.first_m[0, 0] == pytest.approx(1.0) and found.first_thickness_m[0, 0] == np.inf


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("angle_deg", [0.0, 30.0, -50.0, 70.0])
def test_the_mirrored_path_comes_back_to_the_wall_behind_the_robot(angle_deg, backend):
    """A pane at x = 6 m, a wall that ends at x = 0.05 m: 5 m there, 5.95 m back, both along the slanted ray."""
    cells = np.zeros((1200, 160), np.int8)
    cells[:, [0, 120]] = 100
    found = hits(GridMap(cells, CELL_M, np.zeros(3)), [1.0, 20.0, 0.0], np.radians(angle_deg), backend, 60.0)
    assert found.mirrored_m[0, 0] == pytest.approx((5.0 + 5.95) / np.cos(np.radians(angle_deg)), abs=1e-4)


@pytest.mark.parametrize("seed", range(15))
def test_a_slanted_pane_mirrors_along_its_true_normal(seed):
    """Not at its own staircase, and within what a normal from cells can tell of the path to a far wall."""
    rng = np.random.default_rng(seed)
    slant = rng.uniform(-0.4, 0.4)  # of the pane from the y axis; it goes through (6, 8)
    cells = np.zeros((320, 240), np.int8)
    y = np.arange(0.0, 16.0, 0.01)
    x = 6.0 - np.tan(slant) * (y - 8.0)
    cells[(y / CELL_M).astype(int), (x / CELL_M).astype(int)] = 100
    cells[:, 20] = 100  # ends at x = 1.05 m
    start = np.array([3.0, 8.0 + rng.uniform(-1, 1)])
    angle = slant + rng.uniform(-0.7, 0.7)
    found = hits(GridMap(cells, CELL_M, np.zeros(3)), [*start, 0.0], angle)
    u, n = np.array([np.cos(angle), np.sin(angle)]), -np.array([np.cos(slant), np.sin(slant)])
    t = (start - [6.0, 8.0]) @ n / -(u @ n)
    back = u - 2.0 * (u @ n) * n
    meets = start + t * u + back * ((start + t * u)[0] - 1.05) / -back[0]
    assert abs(np.degrees(wrap(found.normal_rad[0, 0] - np.arctan2(n[1], n[0])))) < 2.0
    assert found.mirrored_m[0, 0] == pytest.approx(t + np.linalg.norm(meets - start - t * u), abs=0.5)


def test_a_path_longer_than_max_range_is_not_mirrored():
    cells = np.zeros((400, 160), np.int8)
    cells[:, [0, 120]] = 100
    world = GridMap(cells, CELL_M, np.zeros(3))
    assert hits(world, [1.0, 10.0, 0.0], 0.0, max_range_m=10.94).mirrored_m[0, 0] == np.inf
    assert np.isfinite(hits(world, [1.0, 10.0, 0.0], 0.0, max_range_m=10.96).mirrored_m[0, 0])


@pytest.mark.parametrize(
    "draw",
    [
        pytest.param(lambda cells: cells.__setitem__((slice(49, 52), slice(49, 52)), 100), id="mullion"),
        pytest.param(
            lambda cells: (cells.__setitem__((50, slice(50, 90)), 100), cells.__setitem__((slice(50, 90), 50), 100)),
            id="corner",
        ),
    ],
)
def test_mullions_and_corners_have_no_normal_to_mirror_at(draw):
    cells = np.zeros((100, 100), np.int8)
    cells[:, 0] = cells[:, 99] = cells[0] = cells[99] = 100
    draw(cells)
    found = hits(GridMap(cells, CELL_M, np.zeros(3)), [1.0, 1.0 + 1e-4, 0.0], np.pi / 4)
    assert found.first_m[0, 0] == pytest.approx(1.5 * np.sqrt(2.0), abs=0.11)
    assert found.linearity[0, 0] < 0.9 and found.mirrored_m[0, 0] == np.inf


def test_a_speck_has_neither_normal_nor_linearity():
    cells = np.zeros((20, 20), np.int8)
    cells[10, 10] = 100
    found = hits(GridMap(cells, CELL_M, np.zeros(3)), [0.1, 0.52, 0.0], 0.0)
    assert np.isnan(found.normal_rad[0, 0]) and found.linearity[0, 0] == 0.0
    assert found.first_thickness_m[0, 0] == pytest.approx(0.05)  # along the ray


@pytest.mark.parametrize("thickness_cells", [1.5, 2.0, 3.0])
def test_normals_of_straight_walls_are_good_to_a_fraction_of_a_degree(thickness_cells):
    """Walls of random direction, cells whose centre is in the wall: median below 0.2, nine of ten below 0.7 degrees."""
    rng = np.random.default_rng(0)
    row, column = np.mgrid[:80, :80] + 0.5
    errors_deg = []
    for _ in range(60):
        normal_rad, offset = rng.uniform(0, np.pi), rng.uniform(-3, 3)
        across = (column - 40) * np.cos(normal_rad) + (row - 40) * np.sin(normal_rad) - offset
        cells = np.where(np.abs(across) <= thickness_cells / 2, 100, 0).astype(np.int8)
        found_rad, _ = RayCaster(GridMap(cells, 1.0, np.zeros(3))).normals()
        middle = found_rad.reshape(80, 80)[20:60, 20:60]  # the ends of a wall are no straight wall
        errors_deg.append(np.degrees(np.abs(wrap(2.0 * (middle[np.isfinite(middle)] - normal_rad)))) / 2.0)
    errors_deg = np.concatenate(errors_deg)
    assert np.median(errors_deg) < 0.2 and np.percentile(errors_deg, 90) < 0.7


@pytest.mark.parametrize("turned", [False, True], ids=["along x", "along y"])
@pytest.mark.parametrize("rows", [(31,), (29,), (29, 31)], ids=["right", "left", "both sides"])
@pytest.mark.parametrize("post_cells, limit_deg", [(1, 0.2), (2, 0.2), (4, 1.0)])
def test_posts_that_stick_out_do_not_turn_the_normal_of_a_wall(post_cells, limit_deg, rows, turned):
    """A glass wall with posts every 1.7 m, as wide as a frame (5 or 10 cm) or as a column."""
    cells = np.zeros((60, 240), np.int8)
    cells[30] = 100
    for start in range(20, 240 - post_cells, 34):
        cells[rows, start : start + post_cells] = 100
    found_rad, _ = RayCaster(GridMap(cells.T.copy() if turned else cells, CELL_M, np.zeros(3))).normals()
    flat = found_rad.reshape(240, 60).T if turned else found_rad.reshape(60, 240)
    off_deg = np.degrees(np.abs(wrap(2.0 * (flat[30, 20:220] - (0.0 if turned else np.pi / 2))))) / 2.0
    assert np.nanmax(off_deg) < limit_deg and np.isfinite(off_deg).mean() > 0.8  # the middle of a thick post has none


@pytest.mark.parametrize("map_from_grid", [(0.0, 0.0, 0.0), (-7.0, 3.0, 0.9), (2.0, 5.0, -2.5)])
@pytest.mark.parametrize("thickness_cells", [1.5, 2.0, 2.5])
@pytest.mark.parametrize("slant_deg", [8.0, 27.0, 61.0, 100.0, 152.0, -8.0])
def test_the_line_of_a_slanted_wall_is_where_the_wall_is(slant_deg, thickness_cells, map_from_grid):
    """From the centre of each of its cells, on either side of the line, the offset leads to the line."""
    row, column = np.mgrid[:80, :80] + 0.5
    normal = np.array([np.cos(np.radians(slant_deg)), np.sin(np.radians(slant_deg))])
    across = (np.stack([column, row], axis=-1) - 40.3) @ normal  # [cells]
    cells = np.where(np.abs(across) <= thickness_cells / 2, 100, 0).astype(np.int8)
    world = GridMap(cells, CELL_M, np.array(map_from_grid))
    caster = RayCaster(world)
    axis_rad, offset_m = caster.normals()[0], caster.wall_offsets_m()
    assert offset_m.shape == (6400,) and (np.isnan(offset_m) == np.isnan(axis_rad)).all()
    met = np.flatnonzero(np.isfinite(offset_m))
    met = met[np.all(np.abs(np.stack(np.divmod(met, 80)) - 39.5) < 20.0, axis=0)]  # far from the ends of the wall
    centres = world.centres(*np.divmod(met, 80))
    on_line = centres + offset_m[met, None] * np.stack([np.cos(axis_rad[met]), np.sin(axis_rad[met])], axis=-1)
    on_grid = compose(inverse(np.array(map_from_grid)), np.c_[on_line, np.zeros(len(met))])[:, :2] / CELL_M
    assert len(met) > 30 and np.abs((on_grid - 40.3) @ normal).max() < 0.2
    assert thickness_cells < 2.0 or (offset_m[met].min() < -0.2 * CELL_M and offset_m[met].max() > 0.2 * CELL_M)


def test_cells_inside_a_block_and_free_cells_have_no_line():
    cells = np.zeros((30, 30), np.int8)
    cells[10:20, 10:20] = 100
    offset_m = RayCaster(GridMap(cells, CELL_M, np.zeros(3))).wall_offsets_m().reshape(30, 30)
    assert np.isnan(offset_m[12:18, 12:18]).all() and np.isnan(offset_m[:10]).all()
    assert np.isfinite(offset_m[10, 14])


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("seed", range(4))
def test_surfaces_are_the_runs_of_the_slow_traversal(seed, backend):
    """Random blocks and walls; normals taken as they are, everything made from them worked out again."""
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((90, 110)) < 0.01, 100, 0).astype(np.int8)
    for _ in range(10):
        row, column, height, width = rng.integers([0, 0, 1, 1], [80, 100, 30, 8])
        cells[row : row + height, column : column + width] = 100
    world = GridMap(cells, CELL_M, np.zeros(3))
    max_range_m, max_thickness_m, min_linearity, min_gap_m = 4.0, 0.2, 0.9, 0.12
    caster = RayCaster(world, backend)
    axis_rad, linearity = caster.normals()

    def same_wall(passed, cell):
        """Posts and steps: not farther than 1.5 cells from the line of the wall that the ray has passed."""
        across = np.array([np.cos(axis_rad[passed]), np.sin(axis_rad[passed])])
        way = np.subtract(np.divmod(cell, 110), np.divmod(passed, 110))[::-1]
        return linearity[passed] >= min_linearity and abs(way @ across) <= 1.5

    poses = np.c_[rng.uniform(-0.5, 5.5, (60, 2)), rng.uniform(-np.pi, np.pi, 60)]
    angles_rad = rng.uniform(-np.pi, np.pi, 6)
    found = caster.cast_surfaces(poses, angles_rad, max_range_m, max_thickness_m, min_linearity, min_gap_m)
    for p, b in np.ndindex(len(poses), len(angles_rad)):
        direction = poses[p, 2] + angles_rad[b]
        expected_m, expected_thickness_m = np.full(3, np.inf), np.full(3, np.inf)
        for i, run in enumerate(
            slow_raycast.surfaces(
                world.occupied, *poses[p, :2] / CELL_M, direction, max_range_m / CELL_M, min_gap_m / CELL_M, same_wall
            )[:3]
        ):
            expected_m[i] = run.t_in * CELL_M
            straight = linearity[run.cells[0]] >= min_linearity
            cos = abs(np.cos(axis_rad[run.cells[0]] - direction)) if straight else 1.0
            if (run.t_out - run.t_in) * CELL_M * cos > max_thickness_m:
                break
            expected_thickness_m[i] = (run.t_out - run.t_in) * CELL_M * cos
        where = f"pose {poses[p]}, angle {angles_rad[b]}"
        got_m = [hits_m[p, b] for hits_m in (found.first_m, found.second_m, found.third_m)]
        got_thickness_m = [found.first_thickness_m[p, b], found.second_thickness_m[p, b]]
        assert got_m == pytest.approx(expected_m, abs=1e-8), where
        assert got_thickness_m == pytest.approx(expected_thickness_m[:2], abs=1e-5), where


@pytest.mark.parametrize("seed", range(3))
def test_paths_end_where_surfaces_are_as_far_as_one_looks(seed):
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((90, 110)) < 0.004, 100, 0).astype(np.int8)
    cells[:, 40:42], cells[60:62], cells[20, 50:] = 100, 100, 100
    caster = RayCaster(GridMap(cells, CELL_M, np.array([1.0, -2.0, 0.3])))
    axis_rad, linearity = caster.normals()
    poses = np.c_[rng.uniform(-0.5, 5.5, (40, 2)), rng.uniform(-np.pi, np.pi, 40)]
    angles_rad, reach_m = rng.uniform(-np.pi, np.pi, 30), rng.uniform(0.1, 6.0, 30)
    near = caster.cast_paths(poses, angles_rad, reach_m, 0.2, 0.9, 0.12)
    far = caster.cast_surfaces(poses, angles_rad, 9.0, 0.2, 0.9, 0.12)
    beam_rad = poses[:, 2:] + angles_rad
    for path, (range_m, cell) in enumerate(
        [
            (far.first_m, far.first_cell),
            (far.mirrored_m, far.mirrored_cell),
            (far.second_m, far.second_cell),
            (far.third_m, far.third_cell),
        ]
    ):
        seen = range_m <= reach_m
        assert seen.any() and not seen.all()
        np.testing.assert_array_equal(near.range_m[path], np.where(seen, range_m, np.inf))
        np.testing.assert_array_equal(near.cell[path], np.where(seen, cell, -1))
        along_rad = 2.0 * far.normal_rad + np.pi - beam_rad if path == 1 else beam_rad
        cos = np.where(seen & (linearity[cell] >= 0.9), np.abs(np.cos(along_rad - axis_rad[cell])), 1.0)
        np.testing.assert_allclose(near.cos_incidence[path], cos, atol=1e-5)


@pytest.mark.parametrize(
    "reach_m, text",
    [
        ([1.0], "reach must have the shape of the angles (2,), got (1,)"),
        ([1.0, 0.0], "reach must be finite and > 0 m, got 0.0 to 1.0"),
        ([1.0, np.inf], "reach must be finite and > 0 m, got 1.0 to inf"),
    ],
)
def test_a_reach_that_is_none_is_refused(reach_m, text):
    caster = RayCaster(GridMap(np.zeros((9, 9), np.int8), CELL_M, np.zeros(3)))
    with pytest.raises(ValueError, match=re.escape(text)):
        caster.cast_paths(np.zeros((1, 3)), np.zeros(2), np.array(reach_m))


def test_a_flat_ray_that_has_passed_a_wall_does_not_meet_its_posts():
    """At 4 degrees a ray comes out 0.7 m behind where it went in, and would meet a post that sticks out a cell."""
    cells = np.zeros((100, 400), np.int8)
    cells[50] = 100
    cells[51, 7:400:34] = 100
    cells[90] = 100
    starts = np.c_[np.linspace(0.3, 9.0, 30), np.full(30, 2.2), np.zeros(30)]
    found = RayCaster(GridMap(cells, CELL_M, np.zeros(3))).cast_surfaces(starts, np.radians([4.0, 10.0, 40.0]), 60.0)
    assert (found.first_cell // 400 == 50).all()
    assert np.isin(found.second_cell // 400, [90, -1]).all() and (found.second_cell[:, 2] // 400 == 90)[:20].all()


def test_what_stands_farther_than_the_steps_of_a_wall_is_another_surface():
    cells = np.zeros((100, 100), np.int8)
    cells[50] = cells[54] = 100
    found = hits(GridMap(cells, CELL_M, np.zeros(3)), [2.51, 1.0, 0.0], np.pi / 2)
    assert found.second_cell[0, 0] // 100 == 54


def test_behind_a_corner_without_normal_nothing_is_left_out():
    """A speck has no line: one three cells behind it is the next surface."""
    cells = np.zeros((100, 100), np.int8)
    cells[50, 40] = cells[50, 43] = 100
    found = hits(GridMap(cells, CELL_M, np.zeros(3)), [0.1, 2.52, 0.0], 0.0)
    assert [found.first_cell[0, 0] % 100, found.second_cell[0, 0] % 100] == [40, 43]


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_cell_where_the_mirrored_path_ends_is_reported(backend):
    """Head-on between two walls, each way: back to the wall behind the robot."""
    cells = np.zeros((400, 160), np.int8)
    cells[:, [10, 120]] = 100
    world = GridMap(cells, CELL_M, np.zeros(3))
    found = RayCaster(world, backend).cast_surfaces([[2.0, 10.02, 0.0]], [0.0, np.pi, np.pi / 2], 15.0)
    assert (found.mirrored_cell[0] % 160)[:2].tolist() == [10, 120]
    assert (found.mirrored_cell[0, :2] // 160 == 200).all()
    assert found.mirrored_cell[0, 2] == -1 and found.mirrored_m[0, 2] == np.inf


def test_threads_do_not_change_the_surfaces():
    rng = np.random.default_rng(0)
    world = GridMap(np.where(rng.random((100, 100)) < 0.05, 100, 0).astype(np.int8), CELL_M, np.zeros(3))
    poses = np.c_[rng.uniform(0, 5, (70, 2)), rng.uniform(-3, 3, 70)]
    one, two = (RayCaster(world, threads=n).cast_surfaces(poses, np.linspace(-3, 3, 40), 9.0) for n in (1, 2))
    for name, values in vars(one).items():
        np.testing.assert_array_equal(values, getattr(two, name), err_msg=name)


@pytest.mark.parametrize(
    "limits, text",
    [
        ({"max_thickness_m": -0.1}, "max_thickness must be >= 0 m, got -0.1"),
        ({"max_thickness_m": np.nan}, "max_thickness must be >= 0 m, got nan"),
        ({"min_linearity": 1.5}, r"min_linearity must be in \[0, 1\], got 1.5"),
        ({"min_gap_m": np.inf}, "min_gap must be finite and >= 0 m, got inf"),
    ],
)
def test_limits_out_of_bounds_are_refused_in_one_line(limits, text):
    with pytest.raises(ValueError, match=f"^ray caster: {text}$"):
        hits(three_walls(), [1.0, 10.0, 0.0], 0.0, **limits)


def test_the_walls_at_cells_are_those_of_the_whole_map():
    cells = np.where(np.random.default_rng(0).random((40, 30)) < 0.4, 100, 0).astype(np.int8)
    caster = RayCaster(GridMap(cells, CELL_M, np.array([1.0, 2.0, 0.5])))
    asked = np.arange(cells.size, dtype=np.int32).reshape(30, 40)
    for at_cells, everywhere in zip(caster.walls_at(asked), (*caster.normals(), caster.wall_offsets_m())):
        np.testing.assert_array_equal(at_cells, everywhere.reshape(30, 40))
    assert [float(each) for each in caster.walls_at(np.array([-1]))] == pytest.approx(
        [np.nan, 0.0, np.nan], nan_ok=True
    )


@pytest.mark.parametrize("cell", [-2, 1200])
def test_walls_at_cells_that_are_none_are_refused(cell):
    with pytest.raises(ValueError, match="cells must be of the grid, or -1"):
        RayCaster(GridMap(np.zeros((40, 30), np.int8), CELL_M, np.zeros(3))).walls_at(np.array([0, cell]))
