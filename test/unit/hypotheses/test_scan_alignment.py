"""Does a scan slide to where it was taken, and stay where no wall holds it?"""

from __future__ import annotations

import numpy as np
import pytest
from buildings import BASE_FROM_LASER, CORRIDOR, GLASS_ROOM, L_ROOM, off

from glass_nav.geometry import se2
from glass_nav.hypotheses import scan_alignment
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster


@pytest.fixture(scope="module")
def l_room():
    return DistanceField(L_ROOM.grid_map())


@pytest.fixture(scope="module")
def corridor():
    return DistanceField(CORRIDOR.grid_map())


def somewhere(rng):
    """A pose in the L-shaped room and starts 0.2 m and up to 8 degrees away from it, all round."""
    true = np.array([rng.uniform(1.0, 4.0), rng.uniform(0.8, 2.3), rng.uniform(-np.pi, np.pi)])
    bearing = np.linspace(-np.pi, np.pi, 12, endpoint=False)
    turn = np.radians(8.0) * np.resize([-1.0, 1.0, 0.5], 12)
    return true, true + np.column_stack([0.2 * np.cos(bearing), 0.2 * np.sin(bearing), turn])


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("noise_m", [0.0, 0.01, 0.03])
def test_a_scan_slides_to_where_it_was_taken(l_room, seed, noise_m):
    rng = np.random.default_rng(seed)
    true, starts = somewhere(rng)
    points = L_ROOM.scan(true, rng=rng, noise_m=noise_m).points_in_base()
    aligned = scan_alignment.align(l_room, points, starts)
    for pose in aligned.poses:
        way_m, turn_rad = off(pose, true)
        assert way_m < 0.01 and turn_rad < np.radians(0.3), (way_m, np.degrees(turn_rad))


@pytest.mark.parametrize("seed", range(4))
def test_a_scan_of_the_ray_caster_fits_half_a_cell_before_the_walls(l_room, seed):
    """The caster's beams end at the near boundary of the cells, the field is 0 in their middle."""
    rng = np.random.default_rng(seed)
    true, starts = somewhere(rng)
    angles_rad = np.linspace(-np.pi, np.pi, 180, endpoint=False)
    from_laser = se2.compose(true, BASE_FROM_LASER)
    ranges_m = RayCaster(L_ROOM.grid_map()).cast(from_laser[None], angles_rad, 12.0)[0]
    bearing = angles_rad + BASE_FROM_LASER[2]
    points = BASE_FROM_LASER[:2] + ranges_m[:, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])
    for pose in scan_alignment.align(l_room, points, starts).poses:
        way_m, turn_rad = off(pose, true)
        assert way_m < 0.025 and turn_rad < np.radians(0.3)


@pytest.mark.parametrize("seed", range(4))
def test_people_before_the_walls_do_not_pull(l_room, seed):
    rng = np.random.default_rng(seed)
    true, starts = somewhere(rng)
    scan = L_ROOM.scan(true, rng=rng)
    scan.ranges_m[20:50] *= 0.5  # a sixth of the beams
    for pose in scan_alignment.align(l_room, scan.points_in_base(), starts).poses:
        way_m, turn_rad = off(pose, true)
        assert way_m < 0.03 and turn_rad < np.radians(0.5)


@pytest.mark.parametrize("seed", range(4))
def test_glass_does_not_mislead_where_the_rooms_behind_are_mapped(seed):
    rng = np.random.default_rng(seed)
    true = np.array([4.0, 1.6, 0.3])
    points = GLASS_ROOM.scan(true, rng=rng, glass_share=0.5).points_in_base()
    aligned = scan_alignment.align(DistanceField(GLASS_ROOM.grid_map()), points, true + [[0.15, -0.1, 0.1]])
    way_m, turn_rad = off(aligned.poses[0], true)
    assert way_m < 0.01 and turn_rad < np.radians(0.3)


def corridor_points(true, rng):
    """End points up to 8 m away: no end of the corridor is in sight."""
    scan = CORRIDOR.scan(true, rng=rng)
    return scan.points_in_base()[scan.ranges_m < 8.0]


@pytest.mark.parametrize("seed", range(4))
def test_along_a_featureless_corridor_nothing_is_known_and_nothing_moves(corridor, seed):
    rng = np.random.default_rng(seed)
    true = np.array([30.0, 0.9, 0.4])
    points = corridor_points(true, rng)
    start = true + np.array([0.2, 0.15, 0.08])
    aligned = scan_alignment.align(corridor, points, start[None])
    along, across, turn = np.abs(aligned.poses[0] - true)
    assert across < 0.01 and turn < np.radians(0.3)
    assert along == pytest.approx(0.2, abs=0.05)  # the turn moves the robot a little; the walls do not
    information = aligned.information[0]
    assert information[0, 0] < 1e-3 * information[1, 1]
    variance = np.linalg.inv(information + 1e-6 * np.eye(3))
    assert variance[0, 0] > 1e3 * variance[1, 1]


@pytest.mark.parametrize("yaw", [0.0, 0.9, -2.5])
def test_the_information_does_not_depend_on_the_robots_heading(l_room, yaw):
    """It is of x and y in map: the same points, seen by a robot that is turned, say the same."""
    true = np.array([2.0, 1.5, 0.0])
    points = L_ROOM.scan(true).points_in_base()
    straight = scan_alignment.align(l_room, points, true[None], iterations=1)
    turned = scan_alignment.align(
        l_room, se2.transform_points(np.array([0.0, 0.0, -yaw]), points), (true + [0.0, 0.0, yaw])[None], iterations=1
    )
    np.testing.assert_allclose(turned.information, straight.information, rtol=1e-3, atol=1e-3 * 180)
    np.testing.assert_allclose(turned.poses - [0.0, 0.0, yaw], straight.poses, atol=1e-6)


def test_of_a_wall_ahead_every_beam_tells_the_way_to_it(l_room):
    """Worked by hand: B points on the wall x = 6 m tell x with J = 1 each, and y with 0."""
    points = np.column_stack([np.full(10, 2.0), np.linspace(-0.5, 0.5, 10)])
    aligned = scan_alignment.align(l_room, points + [0.02, 0.0], np.array([[4.0, 1.5, 0.0]]), iterations=0)
    # 0.02 m off at a scale of 0.06 m: each weighs (0.06^2 / (0.06^2 + 0.02^2))^2 = 0.81.
    information = aligned.information[0]
    assert information[0, 0] == pytest.approx(8.1, rel=1e-3)
    np.testing.assert_allclose(information[1], 0.0, atol=1e-3)
    # A turn moves a point at y ahead of the wall by -y along x.
    assert information[2, 2] == pytest.approx(0.81 * np.sum(points[:, 1] ** 2), rel=1e-3)
    assert aligned.fit[0] == pytest.approx(0.01 / (0.01 + 0.0004), rel=1e-4)


def test_poses_are_refined_each_on_its_own(l_room):
    true, starts = somewhere(np.random.default_rng(5))
    points = L_ROOM.scan(true).points_in_base()
    together = scan_alignment.align(l_room, points, starts)
    for index, start in enumerate(starts):
        alone = scan_alignment.align(l_room, points, start[None])
        np.testing.assert_allclose(together.poses[index], alone.poses[0], atol=1e-9)
        np.testing.assert_allclose(together.fit[index], alone.fit[0], atol=1e-9)


def test_the_starts_are_not_touched_and_headings_go_round(l_room):
    true = np.array([2.0, 1.5, np.pi - 0.01])
    starts = true + [[0.1, 0.0, 0.05]]
    before = starts.copy()
    aligned = scan_alignment.align(l_room, L_ROOM.scan(true).points_in_base(), starts)
    np.testing.assert_array_equal(starts, before)
    assert -np.pi <= aligned.poses[0, 2] < np.pi
    assert off(aligned.poses[0], true)[1] < np.radians(0.3)


def test_the_fit_is_best_where_the_scan_was_taken(l_room):
    true, starts = somewhere(np.random.default_rng(6))
    points = L_ROOM.scan(true).points_in_base()
    fit = scan_alignment.fit(l_room, points, np.vstack([true, starts, [[2.0, 1.5, true[2] + np.pi]]]))
    assert fit[0] == pytest.approx(1.0, abs=0.02)
    assert np.all(fit[1:] < fit[0])
    assert fit.argmin() == len(fit) - 1


def test_an_aligned_pose_has_the_information_and_the_fit_of_where_it_ended(l_room):
    true, starts = somewhere(np.random.default_rng(7))
    points = L_ROOM.scan(true).points_in_base()
    aligned = scan_alignment.align(l_room, points, starts, last_scale_m=0.06)
    there = scan_alignment.at(l_room, points, aligned.poses, 0.06)
    np.testing.assert_array_equal(there.information, aligned.information)
    np.testing.assert_array_equal(there.fit, aligned.fit)


def test_far_from_all_walls_nothing_moves(l_room):
    points = np.array([[0.1, 0.0], [0.0, 0.1]])
    start = np.array([[50.0, 50.0, 1.0]])
    aligned = scan_alignment.align(l_room, points, start)
    np.testing.assert_allclose(aligned.poses, start, atol=1e-9)
    np.testing.assert_allclose(aligned.information, 0.0, atol=1e-12)
