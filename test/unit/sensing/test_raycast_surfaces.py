"""What lies behind the first surface, how thick it is, where it faces, and what it mirrors."""

from __future__ import annotations

import numpy as np
import pytest

import slow_raycast
from glass_nav.geometry.angles import wrap
from glass_nav.sensing.raycast import RayCaster, SurfaceHits
from glass_nav.world.grid_map import UNKNOWN, GridMap

CELL_M = 0.05
BACKENDS = ["exact", "mrpt"]


def three_walls(thickness_cells=(1, 2, 3), map_from_grid=(0.0, 0.0, 0.0)) -> GridMap:
    """Walls across the map that begin at 2, 4 and 6 m of 8 x 20 m."""
    cells = np.zeros((400, 160), np.int8)
    for start, thickness in zip((40, 80, 120), thickness_cells):
        cells[:, start:start + thickness] = 100
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


@pytest.mark.parametrize("min_gap_m, second_m", [pytest.param(0.16, 3.0, id="one surface"),
                                                 pytest.param(0.14, 1.2, id="two surfaces")])
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


@pytest.mark.parametrize("draw", [
    pytest.param(lambda cells: cells.__setitem__((slice(49, 52), slice(49, 52)), 100), id="mullion"),
    pytest.param(lambda cells: (cells.__setitem__((50, slice(50, 90)), 100),
                                cells.__setitem__((slice(50, 90), 50), 100)), id="corner")])
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


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("seed", range(4))
def test_surfaces_are_the_runs_of_the_slow_traversal(seed, backend):
    """Random blocks and walls; normals taken as they are, everything made from them worked out again."""
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((90, 110)) < 0.01, 100, 0).astype(np.int8)
    for _ in range(10):
        row, column, height, width = rng.integers([0, 0, 1, 1], [80, 100, 30, 8])
        cells[row:row + height, column:column + width] = 100
    world = GridMap(cells, CELL_M, np.zeros(3))
    max_range_m, max_thickness_m, min_linearity, min_gap_m = 4.0, 0.2, 0.9, 0.12
    caster = RayCaster(world, backend)
    axis_rad, linearity = caster.normals()
    poses = np.c_[rng.uniform(-0.5, 5.5, (60, 2)), rng.uniform(-np.pi, np.pi, 60)]
    angles_rad = rng.uniform(-np.pi, np.pi, 6)
    found = caster.cast_surfaces(poses, angles_rad, max_range_m, max_thickness_m, min_linearity, min_gap_m)
    for p, b in np.ndindex(len(poses), len(angles_rad)):
        direction = poses[p, 2] + angles_rad[b]
        expected_m, expected_thickness_m = np.full(3, np.inf), np.full(3, np.inf)
        for i, run in enumerate(slow_raycast.runs(world.occupied, *poses[p, :2] / CELL_M, direction,
                                                  max_range_m / CELL_M, min_gap_m / CELL_M)[:3]):
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


def test_threads_do_not_change_the_surfaces():
    rng = np.random.default_rng(0)
    world = GridMap(np.where(rng.random((100, 100)) < 0.05, 100, 0).astype(np.int8), CELL_M, np.zeros(3))
    poses = np.c_[rng.uniform(0, 5, (70, 2)), rng.uniform(-3, 3, 70)]
    one, two = (RayCaster(world, threads=n).cast_surfaces(poses, np.linspace(-3, 3, 40), 9.0) for n in (1, 2))
    for name, values in vars(one).items():
        np.testing.assert_array_equal(values, getattr(two, name), err_msg=name)


@pytest.mark.parametrize("limits, text", [
    ({"max_thickness_m": -0.1}, "max_thickness must be >= 0 m, got -0.1"),
    ({"max_thickness_m": np.nan}, "max_thickness must be >= 0 m, got nan"),
    ({"min_linearity": 1.5}, r"min_linearity must be in \[0, 1\], got 1.5"),
    ({"min_gap_m": np.inf}, "min_gap must be finite and >= 0 m, got inf")])
def test_limits_out_of_bounds_are_refused_in_one_line(limits, text):
    with pytest.raises(ValueError, match=f"^ray caster: {text}$"):
        hits(three_walls(), [1.0, 10.0, 0.0], 0.0, **limits)
