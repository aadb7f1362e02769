"""The first surface along a ray: both backends against a definition, a second implementation and each other."""

from __future__ import annotations

import numpy as np
import pytest
import slow_raycast

from glass_nav.geometry import se2
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world.grid_map import UNKNOWN, GridMap

ALIGNED = np.zeros(3)
EIGHT_WINDS = np.arange(8) * np.pi / 4


def grid_map(cells, resolution_m=0.25, map_from_grid=ALIGNED) -> GridMap:
    return GridMap(np.asarray(cells, np.int8), resolution_m, np.asarray(map_from_grid, float))


def scattered(rng, shape, share) -> np.ndarray:
    return np.where(rng.random(shape) < share, 100, 0)


def thin_walls(rng, shape) -> np.ndarray:
    """Straight walls one cell thick in all directions; slanted ones hold together by corners only."""
    cells = np.zeros(shape)
    for _ in range(6):
        ends = rng.uniform(0, 1, (2, 2)) * (np.array(shape) - 1)
        along = np.round(np.linspace(*ends, int(np.abs(ends[1] - ends[0]).max()) + 2)).astype(int)
        cells[along[:, 0], along[:, 1]] = 100
    return cells


def bordered(rng, shape) -> np.ndarray:
    cells = scattered(rng, shape, 0.005)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return cells


GRIDS = [
    pytest.param(lambda rng: scattered(rng, (40, 60), 0.1), id="scattered cells"),
    pytest.param(lambda rng: scattered(rng, (25, 33), 0.6), id="more wall than room"),
    pytest.param(lambda rng: thin_walls(rng, (70, 50)), id="walls one cell thick"),
    pytest.param(lambda rng: bordered(rng, (64, 64)), id="border of wall"),
    pytest.param(lambda rng: scattered(rng, (1, 30), 0.1), id="one row"),
    pytest.param(lambda rng: scattered(rng, (600, 700), 0.00005), id="beyond 255 cells"),
]


def poses_around(rng, world: GridMap, count) -> np.ndarray:
    """(P, 3) poses in the map and up to a fifth of its size outside; anywhere, on cell centres and on corners."""
    height, width = world.occupancy.shape
    column_row = rng.uniform(-0.2, 1.2, (count, 2)) * [width, height]
    column_row[count // 2 :] = np.floor(column_row[count // 2 :] * 2.0) / 2.0
    yaw = np.where(rng.random(count) < 0.5, rng.choice(EIGHT_WINDS, count), rng.uniform(-np.pi, np.pi, count))
    return se2.compose(world.map_from_grid, np.c_[column_row * world.resolution_m, yaw])


def assert_as_slow(world: GridMap, caster: RayCaster, poses, angles_rad, max_range_m, stops=None):
    hits = caster.cast_first(poses, angles_rad, max_range_m)
    in_grid = se2.compose(se2.inverse(world.map_from_grid), poses)
    for p, (x, y, yaw) in enumerate(in_grid):
        for b, angle in enumerate(angles_rad):
            t, cells = slow_raycast.first_hit(
                world.occupied,
                x / world.resolution_m,
                y / world.resolution_m,
                yaw + angle,
                max_range_m / world.resolution_m,
                stops,
            )
            where = f"pose {poses[p]}, angle {angle}"
            assert hits.range_m[p, b] == pytest.approx(t * world.resolution_m, abs=1e-8), where
            assert hits.cell[p, b] in cells, where


@pytest.mark.long_run
@pytest.mark.parametrize("backend", ["exact", "mrpt"])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("make", GRIDS)
def test_a_ray_meets_what_the_slow_traversal_meets(make, seed, backend):
    rng = np.random.default_rng(seed)
    world = grid_map(make(rng))
    poses = poses_around(rng, world, 40)
    angles_rad = np.concatenate([EIGHT_WINDS[:3], rng.uniform(-np.pi, np.pi, 5)])
    assert_as_slow(world, RayCaster(world, backend), poses, angles_rad, 1000.0)


@pytest.mark.parametrize("seed", range(4))
def test_the_place_of_the_map_is_applied(seed):
    rng = np.random.default_rng(seed)
    world = grid_map(scattered(rng, (50, 40), 0.05), 0.05, [*rng.uniform(-600, 600, 2), rng.uniform(-np.pi, np.pi)])
    column_row = rng.uniform(-0.2, 1.2, (60, 2)) * [40, 50]
    poses = se2.compose(world.map_from_grid, np.c_[column_row * 0.05, rng.uniform(-np.pi, np.pi, 60)])
    assert_as_slow(world, RayCaster(world), poses, rng.uniform(-np.pi, np.pi, 6), 30.0)


@pytest.mark.parametrize("backend", ["exact", "mrpt"])
def test_unknown_cells_are_passed_or_stop_the_ray(backend):
    cells = np.zeros((9, 40))
    cells[:, 20:23], cells[:, 30] = UNKNOWN, 100
    world = grid_map(cells)
    poses = np.array([[0.6, 1.1, 0.0]])
    assert RayCaster(world, backend).cast(poses, [0.0], 50.0)[0, 0] == pytest.approx(30 * 0.25 - 0.6)
    assert RayCaster(world, backend, unknown="stop").cast(poses, [0.0], 50.0)[0, 0] == np.inf


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("backend", ["exact", "mrpt"])
def test_rays_that_stop_at_unknown_cells_agree_with_the_slow_traversal(seed, backend):
    rng = np.random.default_rng(seed)
    world = grid_map(np.where(rng.random((50, 50)) < 0.03, UNKNOWN, scattered(rng, (50, 50), 0.05)), 0.05)
    poses = np.c_[rng.uniform(-0.5, 3.0, (60, 2)), rng.uniform(-np.pi, np.pi, 60)]
    assert_as_slow(
        world,
        RayCaster(world, backend, unknown="stop"),
        poses,
        rng.uniform(-np.pi, np.pi, 6),
        5.0,
        stops=world.occupancy < 0,
    )


@pytest.mark.parametrize("backend", ["exact", "mrpt"])
@pytest.mark.parametrize(
    "direction_rad, expected_m",
    [
        pytest.param(0.0, 250 - 0.1, id="east"),
        pytest.param(np.pi / 2, 150 - 0.1, id="north"),
        pytest.param(np.pi, np.inf, id="west, out of the map"),
    ],
)
def test_a_range_far_beyond_255_cells_is_exact(backend, direction_rad, expected_m):
    cells = np.zeros((700, 1100), np.int8)
    cells[600, :] = cells[:, 1000] = 100
    ranges_m = RayCaster(grid_map(cells), backend).cast([[0.1, 0.1, direction_rad]], [0.0], 1e4)
    assert ranges_m[0, 0] == pytest.approx(expected_m, abs=1e-9)


@pytest.mark.parametrize("backend", ["exact", "mrpt"])
@pytest.mark.parametrize("mirror", [False, True])
def test_nothing_slips_through_cells_that_touch_at_corners(backend, mirror):
    """Rays at exactly 45 degrees through the corners of a diagonal wall."""
    cells = np.eye(40) * 100
    if mirror:
        cells = cells[:, ::-1]
    world = grid_map(cells)
    corners = np.array([[10.0, 20.0], [5.0, 15.0], [12.0, 18.0]]) * 0.25
    poses = np.c_[corners if not mirror else [10.0, 0.0] - corners * [1, -1], np.zeros(3)]
    toward = -np.pi / 4 if not mirror else -3 * np.pi / 4
    hits = RayCaster(world, backend).cast(poses, [toward], 100.0)
    assert hits[:, 0] == pytest.approx(np.sqrt(0.5) * np.array([10, 10, 6]) * 0.25, abs=1e-9)


@pytest.mark.parametrize("aside_cells", [1e-10, 3e-9, 1e-8, 1.1e-7, 1.3e-7, 1e-6])
def test_rays_that_pass_close_by_corners(aside_cells):
    """Aimed at corners of cells and a little aside: a corner, almost one, or none, whichever way it is found."""
    rng = np.random.default_rng(5)
    world = grid_map(scattered(rng, (40, 60), 0.15))
    corners = np.floor(rng.uniform(0, 1, (300, 2)) * [60, 40])
    yaw = rng.uniform(-np.pi, np.pi, 300)
    ahead = np.c_[np.cos(yaw), np.sin(yaw)]
    aside = rng.choice([-aside_cells, aside_cells], (300, 1)) * np.c_[-ahead[:, 1], ahead[:, 0]]
    column_row = corners + aside - rng.uniform(0, 5, (300, 1)) * ahead
    assert_as_slow(world, RayCaster(world), np.c_[column_row * world.resolution_m, yaw], [0.0], 20.0)


def test_a_map_of_more_than_a_million_cells_in_a_row():
    cells = np.zeros((2, 2**20 + 8), np.int8)
    cells[:, -1] = 100
    ranges_m = RayCaster(grid_map(cells)).cast([[0.1, 0.1, 0.0], [9.0, 0.3, 1e-7]], [0.0], 1e6)
    assert ranges_m[:, 0] == pytest.approx((2**20 + 7) * 0.25 - np.array([0.1, 9.0]), abs=1e-6)


@pytest.mark.parametrize("backend", ["exact", "mrpt"])
def test_a_ray_that_starts_in_a_wall_meets_it_at_zero(backend):
    hits = RayCaster(grid_map(np.full((5, 5), 100)), backend).cast_first([[0.6, 0.6, 0.3]], EIGHT_WINDS, 9.0)
    assert (hits.range_m == 0.0).all() and (hits.cell == 2 * 5 + 2).all()


@pytest.mark.parametrize("max_range_m, met", [(2.0, True), (1.999, False)])
@pytest.mark.parametrize("backend", ["exact", "mrpt"])
def test_max_range_is_where_the_ray_ends(backend, max_range_m, met):
    cells = np.zeros((4, 20))
    cells[:, 8] = 100
    hits = RayCaster(grid_map(cells), backend).cast_first([[0.0, 0.5, 0.0]], [0.0], max_range_m)
    assert np.isfinite(hits.range_m[0, 0]) == met and (hits.cell[0, 0] == 2 * 20 + 8) == met


@pytest.mark.parametrize("seed", range(3))
def test_simulate_scan_ray_agrees_within_its_step_where_it_cannot_leak(seed):
    """Walls four cells thick: MRPT's own answer, untouched, is late by less than one step of 0.8 cell."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((120, 160))
    for row, column in zip(rng.integers(5, 110, 12), rng.integers(5, 150, 12)):
        cells[row : row + 6, column : column + 6] = 100
    cells[:4], cells[-4:], cells[:, :4], cells[:, -4:] = 100, 100, 100, 100
    world = grid_map(cells, 0.05)
    rows, columns = np.nonzero(world.free)
    picked = rng.integers(len(rows), size=200)
    poses = np.c_[world.centres(rows[picked], columns[picked]), rng.uniform(-np.pi, np.pi, 200)]
    angles_rad = np.linspace(-np.pi, np.pi, 16)
    caster = RayCaster(world)
    late_m = caster.simulate_scan_ray_raw(poses, angles_rad, 20.0) - caster.cast(poses, angles_rad, 20.0)
    # The sampled ray also drifts aside (its steps are rounded) and so cuts or misses corners of blocks now and then.
    assert np.mean((late_m > -0.01) & (late_m <= 0.8 * 0.05 + 0.01)) > 0.98


@pytest.mark.parametrize("backend", ["exact", "mrpt"])
def test_threads_do_not_change_the_result(backend):
    rng = np.random.default_rng(0)
    world = grid_map(scattered(rng, (80, 80), 0.05))
    poses, angles_rad = np.c_[rng.uniform(0, 20, (100, 2)), rng.uniform(-3, 3, 100)], np.linspace(-3, 3, 30)
    one, two = (RayCaster(world, backend, threads=n).cast_first(poses, angles_rad, 30.0) for n in (1, 2))
    assert (one.range_m == two.range_m).all() and (one.cell == two.cell).all()


@pytest.mark.parametrize("poses, beams", [(0, 5), (5, 0), (0, 0)])
def test_no_rays_give_an_empty_result(poses, beams):
    caster = RayCaster(grid_map(np.zeros((3, 3))))
    assert caster.cast(np.zeros((poses, 3)), np.zeros(beams), 1.0).shape == (poses, beams)
    assert caster.cast_surfaces(np.zeros((poses, 3)), np.zeros(beams), 1.0).mirrored_m.shape == (poses, beams)


@pytest.mark.parametrize(
    "poses, angles_rad, max_range_m, text",
    [
        ([[0, 0, 0], [0, np.nan, 0]], [0.0], 1.0, r"pose 1 is not finite: \[ 0. nan  0.\]"),
        ([[np.inf, 0, 0]], [0.0], 1.0, r"pose 0 is not finite"),
        ([[0, 0, 0]], [0.0, np.nan], 1.0, r"angle 1 is not finite: nan"),
        ([0, 0, 0], [0.0], 1.0, r"poses must have shape \(P, 3\), got \(3,\)"),
        ([[0, 0]], [0.0], 1.0, r"poses must have shape \(P, 3\), got \(1, 2\)"),
        ([[0, 0, 0]], [[0.0]], 1.0, r"angles must have shape \(B,\), got \(1, 1\)"),
        ([[0, 0, 0]], [0.0], 0.0, r"max_range must be finite and > 0 m, got 0.0"),
        ([[0, 0, 0]], [0.0], np.nan, r"max_range must be finite and > 0 m, got nan"),
        ([[0, 0, 0]], [0.0], np.inf, r"max_range must be finite and > 0 m, got inf"),
    ],
)
def test_rays_that_cannot_be_cast_are_refused_in_one_line(poses, angles_rad, max_range_m, text):
    caster = RayCaster(grid_map(np.zeros((3, 3))))
    for cast in (caster.cast, caster.cast_first, caster.cast_surfaces, caster.simulate_scan_ray_raw):
        with pytest.raises(ValueError, match=f"^ray caster: {text}") as error:
            cast(poses, angles_rad, max_range_m)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "options, text",
    [
        ({"backend": "fast"}, "backend must be one of exact, mrpt, got 'fast'"),
        ({"unknown": "wall"}, "unknown must be one of pass, stop, got 'wall'"),
        ({"threads": 0}, "threads must be a whole number >= 1, got 0"),
        ({"threads": 1.5}, "threads must be a whole number >= 1, got 1.5"),
    ],
)
def test_options_that_do_not_exist_are_refused_in_one_line(options, text):
    with pytest.raises(ValueError, match=f"^ray caster: {text}$"):
        RayCaster(grid_map(np.zeros((3, 3))), **options)


def test_a_pose_beyond_all_maps_meets_nothing():
    caster = RayCaster(grid_map(np.full((3, 3), 100)))
    assert (caster.cast([[1e300, -1e300, 0.5], [-1e9, 0.3, 0.0]], EIGHT_WINDS, 9.0) == np.inf).all()


def test_the_map_is_the_one_given():
    world = grid_map(np.zeros((3, 3)))
    assert RayCaster(world).grid_map is world


@pytest.mark.parametrize("backend", ["exact", "mrpt"])
def test_pymrpt_sees_the_same_walls(backend):
    """The official Python binding of MRPT, where it is packaged; its scan holds samples up to one step late."""
    try:
        from mrpt.pymrpt import mrpt  # Debian 13, ros-noetic-python-mrpt
    except ImportError:
        pymrpt = pytest.importorskip("pymrpt", reason="the official pymrpt is not installed")
        mrpt = pymrpt.mrpt
    cells = np.zeros((100, 120))
    cells[:4], cells[-4:], cells[:, :4], cells[:, -4:], cells[40:50, 60:70] = 100, 100, 100, 100, 100
    world = grid_map(cells, 0.05)
    grid = mrpt.maps.COccupancyGridMap2D(0.0, 6.0, 0.0, 5.0, 0.05)
    for (row, column), percent in np.ndenumerate(cells):
        grid.setCell(column, row, 0.0 if percent else 1.0)
    scan = mrpt.obs.CObservation2DRangeScan()
    scan.aperture, scan.maxRange, scan.rightToLeft = 2.0 * np.pi, 20.0, True
    grid.laserScanSimulator(scan, mrpt.poses.CPose2D(2.0, 2.0, 0.3), 0.5, 181, 0.0, 1, 0.0)
    theirs_m = np.array([scan.getScanRange(i) for i in range(181)])
    ours_m = RayCaster(world, backend).cast([[2.0, 2.0, 0.3]], np.linspace(-np.pi, np.pi, 181), 16.0)[0]
    assert np.median(np.abs(theirs_m - ours_m)) < 0.05
    assert np.mean(np.abs(theirs_m - ours_m) < 0.1) > 0.95


@pytest.mark.parametrize("make", GRIDS)
@pytest.mark.parametrize("unknown", ["pass", "stop"])
def test_a_redrawn_map_is_as_a_new_one(make, unknown):
    rng = np.random.default_rng(7)
    before = np.asarray(make(rng), np.int8)
    caster = RayCaster(grid_map(before, map_from_grid=(1.0, -2.0, 0.3)), unknown=unknown)
    caster.normals()
    cells = before
    for _ in range(3):
        cells = cells.copy()
        row, column = (int(rng.integers(0, size)) for size in cells.shape)
        cells[row : row + int(rng.integers(1, 9)), column : column + int(rng.integers(1, 9))] = rng.choice([0, 100, -1])
        world = grid_map(cells, map_from_grid=(1.0, -2.0, 0.3))
        caster.redraw(world)
        fresh = RayCaster(world, unknown=unknown)
        assert caster.grid_map is world
        poses, angles_rad = poses_around(rng, world, 40), np.linspace(-np.pi, np.pi, 31)
        np.testing.assert_array_equal(caster.cast(poses, angles_rad, 90.0), fresh.cast(poses, angles_rad, 90.0))
        for ours, theirs in zip(
            (*caster.normals(), caster.wall_offsets_m()), (*fresh.normals(), fresh.wall_offsets_m())
        ):
            np.testing.assert_array_equal(ours, theirs)


def test_a_map_of_other_cells_is_no_redrawn_one():
    caster = RayCaster(grid_map(np.zeros((3, 4))))
    with pytest.raises(ValueError, match="ray caster: a redrawn map must have the cells 3 4 0.250000 .* got 3 5 0.25"):
        caster.redraw(grid_map(np.zeros((3, 5))))
