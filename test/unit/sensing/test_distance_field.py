"""How far is the nearest wall: against distances worked out one by one, and slopes by small steps."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.sensing import distance_field
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.world.grid_map import GridMap

CELL_M = 0.1
TURNED = np.array([3.0, -2.0, 0.7])


def grid_map(occupied, origin=(0.0, 0.0, 0.0)):
    return GridMap(np.where(occupied, 100, 0).astype(np.int8), CELL_M, np.array(origin, float))


def scattered(seed, origin=(0.0, 0.0, 0.0)):
    return grid_map(np.random.default_rng(seed).random((25, 30)) < 0.03, origin)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), TURNED])
def test_at_cell_centres_it_is_the_distance_to_the_nearest_of_all_walls(seed, origin):
    there = scattered(seed, origin)
    centres = there.centres(*np.indices(there.occupied.shape)).reshape(-1, 2)
    walls = there.centres(*np.nonzero(there.occupied))
    nearest = np.linalg.norm(centres[:, None] - walls, axis=-1).min(axis=1)
    distance, _, _ = DistanceField(there, max_distance_m=50.0).at(centres[:, 0], centres[:, 1])
    np.testing.assert_allclose(distance, nearest, atol=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_the_distance_alone_is_the_one_with_its_gradient(seed):
    """Also outside the map, in any shape, and without touching what was given."""
    rng = np.random.default_rng(seed)
    field = DistanceField(scattered(seed, TURNED))
    x_m, y_m = rng.uniform(-3.0, 8.0, (2, 40, 7))
    given = x_m.copy(), y_m.copy()
    np.testing.assert_allclose(field.distance(x_m, y_m), field.at(x_m, y_m)[0], atol=1e-6)
    np.testing.assert_array_equal((x_m, y_m), given)
    np.testing.assert_array_equal(field.distance(x_m, y_m), field.distance(x_m, y_m))


def test_between_cell_centres_it_is_bilinear():
    # One wall cell with its centre at (1.05, 1.05). The four centres around (1.28, 1.17) lie (0.2 or 0.3, 0.1 or
    # 0.2) from it, and the point at 0.3 and 0.2 of the way between them.
    occupied = np.zeros((30, 30), bool)
    occupied[10, 10] = True
    lower = 0.7 * np.hypot(0.2, 0.1) + 0.3 * np.hypot(0.3, 0.1)
    upper = 0.7 * np.hypot(0.2, 0.2) + 0.3 * np.hypot(0.3, 0.2)
    distance, _, _ = DistanceField(grid_map(occupied)).at(np.array([1.28]), np.array([1.17]))
    np.testing.assert_allclose(distance, 0.8 * lower + 0.2 * upper, atol=1e-6)


def test_distances_are_cut():
    occupied = np.zeros((5, 60), bool)
    occupied[:, 0] = True
    distance, along_x, along_y = DistanceField(grid_map(occupied), max_distance_m=1.5).at(
        np.array([0.45, 4.0]), np.array([0.2, 0.2])
    )
    np.testing.assert_allclose(distance, [0.4, 1.5], atol=1e-6)
    np.testing.assert_allclose(along_x, [1.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(along_y, 0.0, atol=1e-6)


def test_without_a_wall_all_is_far_and_flat():
    distance, along_x, along_y = DistanceField(grid_map(np.zeros((4, 5), bool)), max_distance_m=1.2).at(
        np.array([0.1, 0.3, -5.0]), np.array([0.1, 0.2, 9.0])
    )
    np.testing.assert_allclose(distance, 1.2, rtol=1e-6)
    np.testing.assert_array_equal(along_x, 0.0)
    np.testing.assert_array_equal(along_y, 0.0)


@pytest.mark.parametrize("seed", range(5))
def test_the_slope_is_what_a_small_step_changes(seed):
    field = DistanceField(scattered(seed, TURNED), max_distance_m=50.0)
    rng = np.random.default_rng(seed)
    inside = CELL_M * (rng.integers(2, 20, (400, 2)) + rng.uniform(0.52, 1.48, (400, 2)))  # clear of the kinks
    x, y = se2.transform_points(TURNED, inside).T
    step = 1e-5
    _, along_x, along_y = field.at(x, y)
    by_x = (field.at(x + step, y)[0] - field.at(x - step, y)[0]) / (2.0 * step)
    by_y = (field.at(x, y + step)[0] - field.at(x, y - step)[0]) / (2.0 * step)
    np.testing.assert_allclose(along_x, by_x, atol=1e-3)
    np.testing.assert_allclose(along_y, by_y, atol=1e-3)


def test_outside_the_grid_walls_are_as_far_as_the_way_to_it_adds():
    """A beam that ends off the map fits nothing, even where a wall is drawn at the map's edge."""
    occupied = np.zeros((10, 10), bool)
    occupied[5, 9] = True
    field = DistanceField(grid_map(occupied), max_distance_m=3.0)
    x, y = np.array([1.45, 1.45, 2.15, 40.0, -40.0]), np.array([0.55, 1.45, 0.55, 0.55, 0.55])
    expected = np.minimum(np.hypot(x - 0.95, np.maximum(y - 0.95, 0.0) + np.array([0.0, 0.4, 0.0, 0.0, 0.0])), 3.0)
    np.testing.assert_allclose(field.distance(x, y), field.at(x, y)[0], atol=1e-6)
    assert np.all(np.abs(field.distance(x, y) - expected) < 0.2)  # half a cell, and up to the border across it
    assert np.all(field.distance(x[:3], y[:3]) > 0.4)


def test_a_beam_does_not_end_deep_inside_what_is_drawn_solid():
    occupied = np.zeros((40, 60), bool)
    occupied[:, 20:] = True  # solid from x = 2 m on
    field = DistanceField(grid_map(occupied))
    distance, along_x, _ = field.at(np.array([2.05, 2.35, 4.35]), np.array([2.0, 2.0, 2.0]))
    np.testing.assert_allclose(distance[:2], 0.0, atol=1e-6)  # a wall drawn as thick as walls are
    assert distance[2] > 1.5  # 2 m inside: some way out
    assert along_x[2] > 0.9


def test_a_map_of_walls_alone_is_all_wall():
    distance, _, _ = DistanceField(grid_map(np.ones((6, 6), bool))).at(np.array([0.3]), np.array([0.3]))
    np.testing.assert_array_equal(distance, 0.0)


@pytest.mark.parametrize("rows", [1, 7, 24])
def test_made_in_strips_it_is_the_same(monkeypatch, rows):
    there = scattered(1, TURNED)
    points = there.centres(*np.indices(there.occupied.shape)).reshape(-1, 2).T
    whole = DistanceField(there, max_distance_m=0.5).distance(*points)
    monkeypatch.setattr(distance_field, "_STRIP_ROWS", rows)
    np.testing.assert_array_equal(DistanceField(there, max_distance_m=0.5).distance(*points), whole)


def test_log_weights_are_those_of_the_distances():
    """Against numpy, one distance after the other."""
    rng = np.random.default_rng(5)
    occupancy = np.where(rng.uniform(size=(60, 80)) < 0.02, 100, 0).astype(np.int8)
    field = DistanceField(GridMap(occupancy, 0.05, np.array([-1.0, 0.5, 0.3])))
    points_m = rng.uniform(-2.0, 2.0, (70, 2))
    poses = np.column_stack([rng.uniform(-2.0, 3.0, (25, 2)), rng.uniform(-np.pi, np.pi, 25)])
    sigma_m, z_hit, z_rand = 0.04, 0.95, 0.05
    ends_m = se2.transform_points(poses[:, None], points_m)
    square = np.minimum((field.distance(ends_m[..., 0], ends_m[..., 1]) / sigma_m) ** 2, 100.0)
    expected = np.log(z_hit * np.exp(-0.5 * square) + z_rand).sum(axis=1)
    log_w = field.log_weights(points_m, poses, sigma_m, z_hit, z_rand)
    np.testing.assert_allclose(log_w, expected, atol=1e-5 * len(points_m))
    assert np.ptp(log_w) > 1.0


@pytest.mark.parametrize("sigma_m", [0.02, 0.2])
def test_log_weights_of_poses_close_together_are_those_of_each_alone(sigma_m):
    """A cloud of particles in the map, at its border, and with one that is no pose."""
    rng = np.random.default_rng(6)
    field = DistanceField(scattered(6, TURNED))
    points_m = rng.uniform(-0.8, 0.8, (40, 2))
    for middle in ([1.5, 1.2, 0.1], [0.1, 1.2, 0.1], [1.5, 2.4, 0.1]):
        poses = se2.compose(TURNED, np.array(middle) + rng.normal(0.0, [0.03, 0.03, 0.02], (70, 3)))
        poses[5, 2] = np.nan
        together = field.log_weights(points_m, poses, sigma_m, 0.9, 0.1)
        alone = np.concatenate([field.log_weights(points_m, pose[None], sigma_m, 0.9, 0.1) for pose in poses])
        np.testing.assert_allclose(np.delete(together, 5), np.delete(alone, 5), atol=1e-3)


def test_in_blocks_points_are_as_one_by_one():
    """In the map, outside of it, and what is no point."""
    rng = np.random.default_rng(7)
    field = DistanceField(scattered(7, TURNED))
    x_m, y_m = rng.uniform(-3.0, 8.0, (2, 150))
    x_m[70] = np.nan
    together = np.array(field.at(x_m, y_m))
    alone = np.array([field.at(x, y) for x, y in zip(x_m, y_m)]).T
    np.testing.assert_array_equal(together, alone)
