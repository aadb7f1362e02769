"""The smoother against a drive whose poses are known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.replay import smoother as smoother_module
from glass_nav.replay.smoother import Smoother
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import GridMap

ANGLES_RAD = np.linspace(-np.pi, np.pi, 90, endpoint=False)


def room() -> GridMap:
    """6 m by 4 m, with a pillar."""
    occupancy = np.zeros((80, 120), np.int8)
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
    occupancy[30:36, 70:76] = 100
    return GridMap(occupancy, 0.05, np.zeros(3))


def drive(count=40):
    """(S, 3) true poses."""
    share = np.linspace(0.0, 1.0, count)
    return np.stack([1.0 + 3.0 * share, 1.0 + 1.5 * share**2, 0.8 * share], axis=-1)


def smoothed(true, filtered, odometry, answer=np.isfinite):
    """The smoothed poses of a drive in the room; `answer` says which of the ranges return."""
    return listened(true, filtered, odometry, answer).smooth()


def listened(true, filtered, odometry, answer=np.isfinite, sure=None):
    """A smoother after a drive in the room; `sure` says of which poses the filter was."""
    grid_map, rng = room(), np.random.default_rng(0)
    sure = np.ones(len(true), bool) if sure is None else sure
    smoother = Smoother(DistanceField(grid_map))
    ranges_m = RayCaster(grid_map).cast(true, ANGLES_RAD, 20.0) + 0.025 + rng.normal(0.0, 0.01, (len(true), 90))
    for index, measured_m in enumerate(ranges_m):
        measured_m = np.where(answer(measured_m), measured_m, np.inf)
        scan = Scan(index * 10**8, measured_m, ANGLES_RAD, 0.05, 20.0, np.zeros(3))
        step = SimpleNamespace(scan=scan, odom_from_base=odometry[index])
        state = LocalizationState.LOCALIZED if sure[index] else LocalizationState.LOST
        smoother.listen(step, SimpleNamespace(map_from_base=filtered[index], state=state))
    return smoother


def off_m(poses, true):
    return np.hypot(*(poses - true)[:, :2].T)


def test_noise_of_the_filter_is_smoothed_away():
    true = drive()
    filtered = true + np.random.default_rng(1).normal(0.0, [0.05, 0.05, 0.02], true.shape)
    odometry = se2.compose(np.array([3.0, -2.0, 1.0]), true)  # exact, in its own frame
    found = smoothed(true, filtered, odometry)
    assert len(found) == len(true)
    assert off_m(found.poses, true).max() < 0.02 < off_m(filtered, true).mean()
    assert np.abs(angles.wrap(found.poses[:, 2] - true[:, 2])).max() < np.radians(0.7)


def test_a_step_of_odometry_that_is_far_off_gives_way_to_the_scans():
    true = drive()
    odometry = true.copy()
    odometry[20:, 0] += 0.7
    assert off_m(smoothed(true, true, odometry).poses, true).max() < 0.03


def test_where_no_beam_returns_odometry_leads_between_what_was_seen_before_and_after():
    true = drive()
    filtered = true.copy()
    filtered[15:25, :2] += 0.3
    blind = iter(range(len(true)))

    def answer(measured_m):
        return np.full(len(measured_m), not 15 <= next(blind) < 25)

    assert off_m(smoothed(true, filtered, true, answer).poses, true).max() < 0.03


def test_of_two_lidars_at_one_moment_the_first_counts():
    scan = Scan(5, np.full(90, 1.0), ANGLES_RAD, 0.05, 20.0, np.zeros(3))
    smoother = Smoother(DistanceField(room()))
    for x in (2.0, 3.0):
        step = SimpleNamespace(scan=scan, odom_from_base=np.zeros(3))
        estimate = SimpleNamespace(map_from_base=np.array([x, 2.0, 0.0]), state=LocalizationState.LOCALIZED)
        smoother.listen(step, estimate)
    assert smoother.smooth().stamps_ns.tolist() == [5]


def test_without_a_scan_there_is_nothing_to_smooth():
    with pytest.raises(ValueError, match="at least one scan"):
        Smoother(DistanceField(room())).smooth()


def a_filter_that_loses_its_way(true):
    """(S, 3) its poses and (S,) bool where it is sure: lost from scan 10 to 30, and 5 m off there."""
    sure = np.ones(len(true), bool)
    sure[10:30] = False
    return true + np.where(sure[:, None], 0.0, [5.0, 0.0, 0.0]), sure


def test_between_sure_poses_odometry_leads_and_the_covariance_says_how_far_it_can_be_trusted():
    true = drive()
    filtered, sure = a_filter_that_loses_its_way(true)
    found = listened(true, filtered, true, sure=sure).smooth_sure()
    assert off_m(found.trajectory.poses, true).max() < 0.03
    deviation_m = np.sqrt(found.covariance[:, 0, 0])
    assert max(deviation_m[5], deviation_m[35]) < deviation_m[20] < 0.1
    pose, covariance = found.at(int(found.trajectory.stamps_ns[20]) + 1)
    assert off_m(pose[None], true[[20]])[0] < 0.03
    np.testing.assert_array_equal(covariance, found.covariance[20])


def test_where_panes_were_found_scans_pull_that_the_filter_was_not_sure_of():
    true = drive()
    filtered, sure = a_filter_that_loses_its_way(true)
    drifting = true + np.linspace(0.0, 1.0, len(true))[:, None] * [0.2, 0.0, 0.0]
    smoother = listened(true, filtered, drifting, sure=sure)
    assert not smoother.is_sure
    without = smoother.smooth_sure()
    found = smoother.smooth_sure(with_panes=(DistanceField(room()), without))
    assert off_m(found.trajectory.poses, true)[15:25].max() < 0.02
    assert found.deviation_m[20] < 0.7 * without.deviation_m[20]


def test_the_covariance_is_that_of_the_whole_system():
    """The diagonal blocks of the inverse, against a dense one."""
    rng = np.random.default_rng(0)
    root = rng.normal(size=(4, 3, 3))
    diagonal = root @ np.swapaxes(root, 1, 2) + 8.0 * np.eye(3)
    beside = rng.normal(size=(3, 3, 3))
    dense = np.zeros((12, 12))
    for pose in range(4):
        dense[3 * pose : 3 * pose + 3, 3 * pose : 3 * pose + 3] = diagonal[pose]
    for pose in range(3):
        dense[3 * pose + 3 : 3 * pose + 6, 3 * pose : 3 * pose + 3] = beside[pose]
        dense[3 * pose : 3 * pose + 3, 3 * pose + 3 : 3 * pose + 6] = beside[pose].T
    inverse = np.linalg.inv(dense).reshape(4, 3, 4, 3)
    wanted = [inverse[pose, :, pose] for pose in range(4)]
    np.testing.assert_allclose(smoother_module._covariances(diagonal, beside), wanted, rtol=1e-4, atol=1e-6)


def test_odometry_that_contradicts_the_sure_poses_is_not_trusted_between_them():
    odometry = drive()
    true = odometry.copy()
    true[20:, 0] += 1.0  # it was carried, and the wheels did not turn
    filtered, sure = a_filter_that_loses_its_way(true)
    deviation_m = np.sqrt(listened(true, filtered, odometry, sure=sure).smooth_sure().covariance[:, 0, 0])
    assert deviation_m[20] > 0.3
    assert max(deviation_m[5], deviation_m[35]) < 0.03


@pytest.mark.parametrize(
    ("off", "used"), [pytest.param(0.0, True, id="where the robot was"), pytest.param(1.0, False, id="of another map")]
)
def test_a_reference_stands_in_where_no_pose_is_sure_if_it_agrees_where_one_is(off, used):
    true = drive()
    filtered, sure = a_filter_that_loses_its_way(true)
    drifting = true + np.linspace(0.0, 1.0, len(true))[:, None] * [0.2, 0.0, 0.0]
    smoother = listened(true, filtered, drifting, sure=sure)
    truth = Trajectory(np.arange(len(true)) * 10**8, true + [0.0, off, 0.0])
    without, with_truth = smoother.smooth_sure(), smoother.smooth_sure(truth)
    assert (off_m(with_truth.trajectory.poses, true)[15:25].max() < 0.02) == used
    assert np.array_equal(with_truth.trajectory.poses, without.trajectory.poses) == (not used)


def test_a_reference_alone_will_do_if_scans_fit_there_and_without_one_nothing_follows():
    true = drive()
    smoother = listened(true, true + 5.0, true, sure=np.zeros(len(true), bool))
    assert smoother.smooth_sure() is None
    found = smoother.smooth_sure(Trajectory(np.arange(len(true)) * 10**8, true))
    assert off_m(found.trajectory.poses, true).max() < 0.02
    assert smoother.smooth_sure(Trajectory(np.arange(len(true)) * 10**8, true + [1.0, 1.0, 0.5])) is None
    assert smoother.smooth_sure(Trajectory(np.arange(2) + 10**12, true[:2])) is None
