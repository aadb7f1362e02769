"""The lines that beams ended on: against rooms of lines, finite differences, and poses found again."""

from __future__ import annotations

import numpy as np
import pytest

from buildings import BASE_FROM_LASER, CELL_M, CORRIDOR, GLASS_ROOM, L_ROOM, RANGE_MAX_M, Building, off
from glass_nav.geometry import se2
from glass_nav.localization import beam_lines, reference_ranges
from glass_nav.localization.beam_lines import BeamLines
from glass_nav.localization.range_residuals import RangeResiduals
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.wall_thickness import wall_thickness

IN_THE_MIDDLE = RangeResiduals(depth_share=0.5, sigma_m=0.02)
ALL_ROUND = np.linspace(-np.pi, np.pi, 180, endpoint=False)
POSE = np.array([2.6, 1.3, 0.4])


def references_at(building, pose, scan):
    grid_map = building.grid_map()
    return reference_ranges.of(RayCaster(grid_map), wall_thickness(grid_map), pose[None], scan, 0.2, 0.9)


def lines_of(building, pose, ranges_m, case, found_at=None, angles_rad=ALL_ROUND, residuals=IN_THE_MIDDLE):
    """Lines found at a pose, or at another, for a scan measured at the first."""
    scan = Scan(0, np.asarray(ranges_m, float), angles_rad, 0.05, RANGE_MAX_M, BASE_FROM_LASER)
    at = pose if found_at is None else found_at
    case = np.broadcast_to(case, len(angles_rad)).astype(np.uint8)
    return beam_lines.of(scan, at, case, references_at(building, at, scan), residuals)


def measured(building, pose, passes=None):
    return building.measured(se2.compose(pose, BASE_FROM_LASER), ALL_ROUND, passes)


def room(building=L_ROOM, found_at=None, noise_m=0.0, seed=0):
    ranges_m, case = measured(building, POSE)
    return lines_of(building, POSE, ranges_m + np.random.default_rng(seed).normal(0.0, noise_m, 180), case, found_at)


def drawn(count=30, seed=0):
    """Any ends and lines: what they are of does not matter."""
    rng = np.random.default_rng(seed)
    axis_rad = rng.uniform(-np.pi, np.pi, count)
    return BeamLines(np.arange(count), rng.uniform(-5.0, 5.0, (count, 2)),
                     np.column_stack([np.cos(axis_rad), np.sin(axis_rad)]), rng.uniform(-4.0, 4.0, count))


# -- distances

def test_one_end_and_one_line_worked_by_hand():
    """The line x = 4 in map; the robot at (1, 2) looks along y, and the beam ends 2.5 m to its right: at x = 3.5."""
    lines = BeamLines(np.array([7]), np.array([[1.0, -2.5]]), np.array([[1.0, 0.0]]), np.array([4.0]))
    pose = np.array([1.0, 2.0, np.pi / 2])
    np.testing.assert_allclose(lines.across_m(pose[None]), [[-0.5]], atol=1e-12)
    np.testing.assert_allclose(lines.jacobian(pose), [[1.0, 0.0, -1.0]], atol=1e-12)  # turning left swings it back
    assert len(lines) == 1


def test_distances_are_those_of_end_points_in_the_map_from_lines():
    lines = drawn()
    rng = np.random.default_rng(1)
    poses = np.column_stack([rng.uniform(-3.0, 3.0, (20, 2)), rng.uniform(-np.pi, np.pi, 20)])
    expected = [[normal @ se2.transform_points(pose, end[None])[0] - offset
                 for end, normal, offset in zip(lines.ends_m, lines.normal, lines.offset_m)] for pose in poses]
    np.testing.assert_allclose(lines.across_m(poses), expected, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_the_jacobian_is_that_of_finite_differences(seed):
    lines = drawn(seed=seed)
    pose = np.random.default_rng(seed).uniform(-2.0, 2.0, 3)
    step = 1e-6 * np.eye(3)
    by_steps = ((lines.across_m(pose + step) - lines.across_m(pose - step)) / 2e-6).T
    np.testing.assert_allclose(lines.jacobian(pose), by_steps, atol=1e-7)


def test_some_of_the_lines_are_those_lines():
    lines = drawn()
    some = lines.only(np.array([4, 0, 9]))
    assert len(some) == 3 and some.beam.tolist() == [4, 0, 9]
    np.testing.assert_allclose(some.across_m(POSE[None]), lines.across_m(POSE[None])[:, [4, 0, 9]])


# -- lines in rooms

@pytest.mark.parametrize("building", [L_ROOM, GLASS_ROOM])
def test_at_the_true_pose_beams_end_on_their_lines(building):
    across_m = room(building).across_m(POSE[None])[0]
    assert len(across_m) > 170
    assert np.median(np.abs(across_m)) < 1e-3
    assert np.percentile(np.abs(across_m), 80) < 0.1 * CELL_M  # but for corners, which have no line
    assert np.abs(across_m).max() < 2.0 * CELL_M


def test_found_at_a_pose_nearby_they_are_the_same_lines():
    """And the true pose explains the scan better than the one they were found at."""
    nearby = POSE + [0.05, -0.04, 0.015]
    across_m = room(found_at=nearby).across_m(np.stack([POSE, nearby]))
    assert np.percentile(np.abs(across_m[0]), 85) < 0.1 * CELL_M
    assert np.median(np.abs(across_m[1])) > 0.02


def test_through_a_pane_beams_end_on_the_lines_of_the_room_behind():
    ranges_m, case = measured(GLASS_ROOM, POSE, np.ones(180, bool))
    lines = lines_of(GLASS_ROOM, POSE, ranges_m, case)
    behind = np.isin(lines.beam, np.flatnonzero(case == 3))
    assert behind.sum() > 20
    assert np.percentile(np.abs(lines.across_m(POSE[None])[0, behind]), 70) < 0.1 * CELL_M


def test_a_mirrored_beam_ends_on_the_image_of_its_wall_from_wherever_it_is_seen():
    """The path as a straight line to the image of the wall x = 0 in the pane x = 6, which is x = 12."""
    pose, angles_rad = np.array([4.0, 1.2, 0.0]), np.radians(np.linspace(-4.0, 4.0, 9)) - BASE_FROM_LASER[2]
    for moved in (pose, pose + [0.06, 0.05, 0.02]):
        laser = se2.compose(moved, BASE_FROM_LASER)
        unfolded_m = (12.0 - laser[0]) / np.cos(angles_rad + laser[2])
        lines = lines_of(GLASS_ROOM, moved, unfolded_m, 2, found_at=pose, angles_rad=angles_rad)
        assert len(lines) == 9
        assert np.abs(lines.across_m(moved[None])).max() < 0.2 * CELL_M
        np.testing.assert_allclose(np.abs(lines.normal[:, 0]), 1.0, atol=1e-3)


def test_beams_of_no_case_or_without_a_wall_have_no_line():
    ranges_m, case = measured(L_ROOM, POSE)
    case = case.astype(np.uint8)
    case[::3] = 0
    case[1] = 4  # in an empty room there is no third surface
    lines = lines_of(L_ROOM, POSE, ranges_m, case)
    assert lines.beam.tolist() == [beam for beam in range(180) if beam % 3 and beam != 1]
    assert len(lines_of(L_ROOM, POSE, ranges_m, 0)) == 0


def test_a_corner_is_met_where_it_is():
    """A post of one cell before the lidar has no normal: the line goes across the beam."""
    building = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)], walls=[(3, 2, 3, 2)])
    pose = np.array([0.9, 1.95, -0.2])  # the laser at y = 2 looks along x
    laser = se2.compose(pose, BASE_FROM_LASER)
    direction_rad = np.arctan2(2.0 - laser[1], 3.0 - laser[0])
    lines = lines_of(building, pose, [np.hypot(3.0 - laser[0], 2.0 - laser[1])], 1,
                     angles_rad=np.array([direction_rad - laser[2]]))
    assert len(lines) == 1
    np.testing.assert_allclose(np.abs(lines.normal[0] @ [np.cos(direction_rad), np.sin(direction_rad)]), 1.0)
    assert np.abs(lines.across_m(pose[None])).max() < CELL_M


@pytest.mark.parametrize("depth_share", [0.0, 0.5, 1.0])
def test_the_line_is_as_deep_in_a_thick_wall_as_beams_end(depth_share):
    """A wall five cells thick from x = 5.0 on; the face of its cells is half a cell before that."""
    thick = [(5 + CELL_M * cell, 0, 5 + CELL_M * cell, 4) for cell in range(5)]
    building = Building([(-1, 0), (9, 0), (9, 4), (-1, 4)], walls=thick)
    pose, angles_rad = np.array([1.0, 2.0, 0.0]), np.radians([-25.0, 0.0, 10.0])
    laser = se2.compose(pose, BASE_FROM_LASER)
    ends_x = 5.0 - 0.5 * CELL_M + depth_share * 5 * CELL_M
    lines = lines_of(building, pose, (ends_x - laser[0]) / np.cos(angles_rad + laser[2]), 1, angles_rad=angles_rad,
                     residuals=RangeResiduals(depth_share, 0.02))
    assert np.abs(lines.across_m(pose[None])).max() < 0.1 * CELL_M


# -- a better pose

@pytest.mark.parametrize("wrong", [[0.0, 0.0, 0.0], [0.05, -0.04, 0.015], [-0.06, 0.05, -0.02]])
@pytest.mark.parametrize("building", [L_ROOM, GLASS_ROOM])
def test_a_pose_nearby_is_put_right(building, wrong):
    start = POSE + wrong
    lines = room(building, found_at=start, noise_m=0.01)
    pose, information = beam_lines.refined(lines, start, 0.02)
    way_m, turn_rad = off(pose, POSE)
    assert way_m < 0.008 and turn_rad < np.radians(0.25)
    np.testing.assert_allclose(information, information.T)
    assert np.linalg.eigvalsh(information).min() > 10.0


def test_beams_that_met_something_else_do_not_move_the_pose():
    """A fifth of them ends half a metre too early: somebody stands there, or a case was wrong."""
    start = POSE + [0.03, 0.02, 0.01]
    ranges_m, case = measured(L_ROOM, POSE)
    ranges_m = np.where(np.arange(180) < 36, ranges_m - 0.5, ranges_m)
    pose, _ = beam_lines.refined(lines_of(L_ROOM, POSE, ranges_m, case, found_at=start), start, 0.02)
    way_m, turn_rad = off(pose, POSE)
    assert way_m < 0.01 and turn_rad < np.radians(0.3)


def test_where_no_wall_says_how_far_along_it_is_the_pose_stays_there():
    """In the middle of a corridor longer than the lidar sees."""
    true, start = np.array([30.0, 1.0, 0.0]), np.array([30.2, 1.05, 0.01])
    ranges_m, case = measured(CORRIDOR, true)
    case = np.where(ranges_m < RANGE_MAX_M, case, 0)
    pose, information = beam_lines.refined(lines_of(CORRIDOR, true, ranges_m, case, found_at=start), start, 0.02)
    assert abs(pose[0] - 30.2) < 0.02
    assert abs(pose[1] - 1.0) < 0.01 and abs(pose[2]) < np.radians(0.3)
    assert information[0, 0] < 0.01 * information[1, 1]


def test_the_heading_found_is_wrapped():
    start = np.array([2.6, 1.3, np.pi - 0.005])
    true = np.array([2.6, 1.3, -np.pi + 0.005])
    ranges_m, case = measured(L_ROOM, true)
    pose, _ = beam_lines.refined(lines_of(L_ROOM, true, ranges_m, case, found_at=start), start, 0.02)
    assert -np.pi <= pose[2] <= np.pi and off(pose, true)[1] < np.radians(0.3)


def test_without_lines_the_pose_stays():
    ranges_m, _ = measured(L_ROOM, POSE)
    pose, information = beam_lines.refined(lines_of(L_ROOM, POSE, ranges_m, 0), POSE, 0.02)
    np.testing.assert_allclose(pose, POSE)
    np.testing.assert_array_equal(information, np.zeros((3, 3)))


def test_lines_hold_for_poses_near_the_one_they_were_found_at():
    there = np.array([1.0, 2.0, np.pi - 0.01])
    turned = there + [0.0, 0.0, 0.02 - 2.0 * np.pi]  # across the seam
    poses = np.stack([there, there + [0.1, 0.1, 0.0], there + [2.0, 0.0, 0.0], turned, there + [0.0, 0.0, 1.0]])
    assert beam_lines.near(poses, there).tolist() == [True, True, False, True, False]
