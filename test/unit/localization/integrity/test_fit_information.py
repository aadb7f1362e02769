"""What one scan says about its pose: in rooms, in corridors, and where map and lidar disagree."""

from __future__ import annotations

import numpy as np
import pytest
from slow_scan_fit import SlowScanFit

from glass_nav.geometry import se2
from glass_nav.localization.integrity.fit_information import FREE_M, ScanFit
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.world.grid_map import GridMap

RESOLUTION_M = 0.05
LASER_M = np.zeros(2)


def map_of(walls, size_m=(20.0, 20.0), resolution_m=RESOLUTION_M):
    """Walls as (x0, y0, x1, y1) in metres, filled."""
    cells = np.zeros((round(size_m[1] / resolution_m), round(size_m[0] / resolution_m)), np.int8)
    for x0, y0, x1, y1 in walls:
        left, low, right, high = (round(value / resolution_m) for value in (x0, y0, x1, y1))
        cells[int(low) : int(max(high, low + 1)), int(left) : int(max(right, left + 1))] = 100
    return GridMap(cells, resolution_m, np.zeros(3))


ROOM = map_of([(5, 5, 12, 5), (5, 11, 12, 11), (5, 5, 5, 11), (12, 5, 12, 11)])
CORRIDOR = map_of([(0, 9, 20, 9), (0, 11, 20, 11)])
INSIDE = np.array([8.0, 8.0, 0.4])


def ends_in_room(pose, count=90, offset_m=0.5 * RESOLUTION_M, noise_m=0.0, rng=None, x=(5.0, 12.0), y=(5.0, 11.0)):
    """(B, 2) of beams all round in a box whose walls are the centres of the cells that start there."""
    angle = np.linspace(-np.pi, np.pi, count, endpoint=False) + pose[2]
    low, high = np.array([x[0], y[0]]) + offset_m, np.array([x[1], y[1]]) + offset_m
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    with np.errstate(divide="ignore"):
        ranges = np.min(np.where(unit > 0.0, (high - pose[:2]) / unit, (low - pose[:2]) / unit), axis=1)
    if rng is not None:
        ranges = ranges + rng.normal(0.0, noise_m, count)
    return se2.transform_points(se2.inverse(pose), pose[:2] + ranges[:, None] * unit)


def fit_of(grid_map, points_m, pose, matched=True, scans=1):
    fit = ScanFit(DistanceField(grid_map), grid_map.resolution_m)
    for _ in range(scans):
        found = fit.of(points_m, LASER_M, pose, 1.0, matched)
    return found


def deviations(found):
    return np.sqrt(np.diag(found.covariance))


def test_a_room_determines_its_pose():
    found = fit_of(ROOM, ends_in_room(INSIDE), INSIDE)
    assert np.all(deviations(found)[:2] < 0.03) and deviations(found)[2] < np.radians(0.5)
    assert found.share > 0.9
    np.testing.assert_allclose(found.offset, 0.0, atol=0.01)


def test_the_offset_is_how_far_the_pose_is_beside_the_best_fit():
    beside = np.array([0.04, -0.03, 0.01])
    found = fit_of(ROOM, ends_in_room(INSIDE), INSIDE + beside, matched=False)
    np.testing.assert_allclose(found.offset[:2], beside[:2], atol=0.015)
    assert found.offset[2] == pytest.approx(0.01, abs=0.004)


def test_a_corridor_leaves_the_pose_along_it_free():
    pose = np.array([10.0, 10.0, 0.3])
    points = ends_in_room(pose, x=(-100.0, 100.0), y=(9.0, 11.0))
    near = np.abs(se2.transform_points(pose, points)[:, 0] - 10.0) < 8.0
    along, across, _ = deviations(fit_of(CORRIDOR, points[near], pose))
    assert along > 0.5 * FREE_M and across < 0.03


def test_a_corridor_with_equal_doors_leaves_the_pose_at_any_of_them():
    """Niches every 0.4 m look alike: the fit is as good 0.4 m farther on, though it is sharp at each of them."""
    walls = [(0, 9, 20, 9), (0, 11, 20, 11)]
    niches = [(x, 11, x + 0.1, 11.2) for x in np.arange(0.2, 19.5, 0.4)]
    grid_map = map_of(walls + niches)
    pose = np.array([10.0, 10.0, 0.0])
    sides = [(10.0 + x, 9.0 + 0.025) for x in np.arange(-4.0, 4.0, 0.2)]
    jambs = [(x + 0.075, y) for x in np.arange(7.0, 13.0, 0.4) for y in (11.1, 11.15)]
    points = se2.transform_points(se2.inverse(pose), np.array(sides + jambs))
    assert deviations(fit_of(grid_map, points, pose))[0] > 0.2


def test_of_posts_along_a_bridge_a_scan_that_fits_in_part_may_have_met_any():
    """The linearized fit is sharp at each of them, and the heading is less certain."""
    posts = [(x, 11.0, x + 0.05, 11.05) for x in np.arange(2.0, 18.0, 0.5)]
    pose = np.array([10.0, 10.0, 0.0])
    ends = [(x + 0.025, 11.025) for x, *_ in posts if abs(x - 10.0) < 3.0]
    ends += [(10.0 + x, 9.025) for x in np.arange(-1.0, 1.0, 0.1)]
    angle = np.arctan2(*(np.array(ends) - pose[:2]).T[::-1])
    points = se2.transform_points(se2.inverse(pose), np.array(ends)[np.argsort(angle)])
    assert deviations(fit_of(map_of([(0, 9, 20, 9), *posts]), points, pose, matched=0.3))[0] > 0.2


def test_errors_of_a_wall_do_not_average_out_over_beams():
    """Twice as many beams see the same walls: the pose is not known any better."""
    rng = np.random.default_rng(1)
    few, many = (
        deviations(fit_of(ROOM, ends_in_room(INSIDE, count, 0.5 * RESOLUTION_M, 0.01, rng), INSIDE, scans=30))
        for count in (90, 360)
    )
    np.testing.assert_allclose(many[:2], few[:2], rtol=0.5)


def test_nor_do_they_over_scans():
    points = ends_in_room(INSIDE)
    once, often = (deviations(fit_of(ROOM, points, INSIDE, scans=scans)) for scans in (200, 400))
    np.testing.assert_allclose(often, once, rtol=0.3)


def test_where_map_and_lidar_disagree_the_pose_is_known_less():
    """Walls that stand a decimetre away from where they are drawn, each in its own direction."""
    right = deviations(fit_of(ROOM, ends_in_room(INSIDE), INSIDE, scans=40))
    shifted = ends_in_room(INSIDE, x=(4.92, 12.08), y=(5.08, 10.94))
    wrong = deviations(fit_of(ROOM, shifted, INSIDE, scans=40))
    assert np.all(wrong[:2] > 2.0 * right[:2])


@pytest.mark.parametrize("yaw", [0.1, 1.0, -2.5])
def test_the_covariance_turns_with_the_map_and_not_with_the_robot(yaw):
    one = fit_of(ROOM, ends_in_room(INSIDE), INSIDE).covariance
    turned = np.append(INSIDE[:2], yaw)
    other = fit_of(ROOM, ends_in_room(turned), turned).covariance
    np.testing.assert_allclose(np.diag(other), np.diag(one), rtol=0.5)


def test_beams_that_end_at_no_wall_say_nothing():
    nowhere = ends_in_room(INSIDE, x=(7.0, 9.0), y=(7.0, 9.0))
    found = fit_of(ROOM, nowhere, INSIDE)
    assert found.share < 0.05 and np.all(deviations(found)[:2] > 0.5)


@pytest.mark.parametrize("seed", range(10))
def test_the_compiled_fit_agrees_with_numpy(seed):
    """Over scans that are learnt from, with noise, a pose beside the best one, and beams that end elsewhere."""
    rng = np.random.default_rng(seed)
    grid_map = ROOM if seed % 2 else CORRIDOR
    field = DistanceField(grid_map)
    compiled, slow = (kind(field, RESOLUTION_M, square=seed % 4 > 1) for kind in (ScanFit, SlowScanFit))
    for matched in rng.uniform(size=12) < 0.7:
        pose = INSIDE + rng.normal(0.0, [0.5, 0.3, 0.5])
        points_m = ends_in_room(
            pose, int(rng.integers(1, 91)), noise_m=0.03, rng=rng, y=(5.0, 11.0) if seed % 2 else (9.0, 11.0)
        )
        points_m[rng.uniform(size=len(points_m)) < 0.1] *= 0.6
        pose = pose + rng.normal(0.0, [0.03, 0.03, 0.01])
        laser_m, beam_share = rng.normal(0.0, 0.2, 2), float(rng.uniform(0.1, 1.0))
        found, expected = (each.of(points_m, laser_m, pose, beam_share, matched) for each in (compiled, slow))
        np.testing.assert_allclose(found.covariance, expected.covariance, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(found.offset, expected.offset, rtol=1e-6, atol=1e-9)
        assert found.share == pytest.approx(expected.share)
