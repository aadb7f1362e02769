import numpy as np
import pytest

from glass_nav.geometry.trajectory import Trajectory


def path(*rows):
    return Trajectory(np.array([row[0] for row in rows]), np.array([row[1:] for row in rows], float))


def test_half_way_in_time_is_half_way_on_the_path():
    np.testing.assert_allclose(path((0, 0, 0, 0), (10, 2, 4, 1)).at(5), [1.0, 2.0, 0.5])


def test_yaw_goes_the_shorter_way_round():
    half = path((0, 0, 0, np.radians(170)), (10, 0, 0, np.radians(-170))).at(5)
    assert abs(abs(half[2]) - np.pi) < 1e-9


def test_beyond_the_ends_the_nearest_pose_holds_and_is_not_covered():
    trajectory = path((10, 1, 0, 0), (20, 2, 0, 0))
    assert trajectory.at(0)[0] == 1.0 and trajectory.at(99)[0] == 2.0
    assert list(trajectory.covers(np.array([0, 10, 15, 20, 21]))) == [False, True, True, True, False]
    assert trajectory.covers(21, slack_ns=1)


def test_a_single_pose_holds_everywhere():
    np.testing.assert_allclose(path((5, 1, 2, 3)).at(np.array([0, 5, 9])), [[1, 2, 3]] * 3)


def test_stamps_that_do_not_ascend_are_refused():
    with pytest.raises(ValueError, match="must ascend"):
        path((10, 0, 0, 0), (10, 1, 0, 0))


def test_as_many_poses_as_stamps():
    with pytest.raises(ValueError, match="expected stamps_ns"):
        Trajectory(np.array([1, 2]), np.zeros((3, 3)))


def test_no_pose_at_all_covers_nothing():
    empty = Trajectory(np.zeros(0, np.int64), np.zeros((0, 3)))
    assert not empty.covers(0)
    with pytest.raises(ValueError, match="empty"):
        empty.at(0)
