"""Many poses carried along, and which of them stay."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.hypotheses import pose_tracker
from glass_nav.hypotheses.pose_tracker import PoseTracker

POSES = np.array([[0.0, 0.0, 0.0], [5.0, 1.0, 1.5], [2.0, -3.0, -3.0]])


def tracking(poses=POSES, max_behind=10.0, max_poses=100):
    tracker = PoseTracker(max_behind, max_poses)
    tracker.add(np.asarray(poses, float))
    return tracker


@pytest.mark.parametrize("seed", range(5))
def test_all_poses_go_where_odometry_went(seed):
    tracker, rng = tracking(), np.random.default_rng(seed)
    odometry = rng.normal(0.0, 2.0, (4, 3))
    assert tracker.carry(odometry[0]) is None
    np.testing.assert_array_equal(tracker.poses, POSES)
    for pose in odometry[1:]:
        tracker.carry(pose)
    driven = se2.compose(se2.inverse(odometry[0]), odometry[-1])
    off = tracker.poses - se2.compose(POSES, driven)
    np.testing.assert_allclose(np.stack([off[:, 0], off[:, 1], np.sin(off[:, 2])]), 0.0, atol=1e-12)


def test_the_step_is_in_the_robots_frame_before_it():
    tracker = tracking()
    tracker.carry(np.array([1.0, 1.0, 0.5 * np.pi]))
    np.testing.assert_allclose(tracker.carry(np.array([1.0, 3.0, 0.5 * np.pi])), [2.0, 0.0, 0.0], atol=1e-12)


def test_the_best_of_poses_that_became_one_stays_and_the_best_comes_first():
    poses = [[1.0, 1.0, 0.5], [1.02, 1.0, 0.5 - 2.0 * np.pi], [1.0, 1.0, 2.0], [9.0, 9.0, 0.0]]
    tracker = tracking(poses)
    chosen = tracker.keep_distinct(np.array([1.0, 2.0, 5.0, -5.1]))
    assert chosen.tolist() == [2, 1]  # the last is more than 10 behind
    np.testing.assert_array_equal(tracker.poses, np.array(poses)[[2, 1]])


def test_a_pose_that_has_a_chance_by_another_measure_stays_behind_the_others():
    tracker = tracking()
    chosen = tracker.keep_distinct(np.array([0.0, -20.0, -20.0]), np.array([False, False, True]))
    assert chosen.tolist() == [0, 2]


def test_of_equal_poses_the_first_stays_and_no_more_than_allowed():
    tracker = tracking(max_poses=2)
    assert tracker.keep_distinct(np.zeros(3)).tolist() == [0, 1]
    assert len(tracker) == 2


def test_no_poses_at_all_are_no_trouble():
    tracker = PoseTracker(1.0, 10)
    tracker.carry(np.zeros(3))
    tracker.carry(np.ones(3))
    assert tracker.keep_distinct(np.zeros(0)).tolist() == [] and len(tracker) == 0


@pytest.mark.parametrize(
    "offset, same",
    [
        ([0.69, 0.0, 0.0], True),
        ([0.0, 0.71, 0.0], False),
        ([0.0, 0.0, 0.24], True),
        ([0.0, 0.0, -0.26], False),
        ([0.0, 0.0, 2.0 * np.pi], True),
    ],
)
def test_a_rival_is_somewhere_else_or_looks_elsewhere(offset, same):
    pose = np.array([1.0, 2.0, 3.1])
    assert pose_tracker.same_place((pose + offset)[None], pose)[0] == same
    assert pose_tracker.lead(pose, 3.0, (pose + offset)[None], np.array([1.0])) == (np.inf if same else 2.0)


def test_the_lead_is_over_the_best_rival_and_may_be_negative():
    scores = np.array([2.0, 1.0, 2.5])
    assert pose_tracker.lead(POSES[0], scores[0], POSES, scores) == -0.5
    assert pose_tracker.lead(POSES[0], scores[0], POSES[:1], scores[:1]) == np.inf
