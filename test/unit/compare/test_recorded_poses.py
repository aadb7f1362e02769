from __future__ import annotations

import numpy as np

from glass_nav.compare import recorded_poses
from glass_nav.geometry.trajectory import Trajectory

SECOND_NS = 10**9


def test_a_recorded_pose_is_carried_on_by_odometry():
    """A robot drives 1 m a second along its x axis; its odometry thinks that it started at (10, 0)."""
    stamps_ns = np.arange(6) * SECOND_NS
    odometry = Trajectory(stamps_ns, np.array([[10.0 + second, 0.0, 0.0] for second in range(6)]))
    half_pi = np.pi / 2
    poses = Trajectory(np.array([1, 4]) * SECOND_NS + SECOND_NS // 2, np.array([[0.0, 0.0, half_pi], [7.0, 7.0, 0.0]]))
    found, map_from_base = recorded_poses.carried(poses, odometry, stamps_ns)
    assert found.tolist() == [False, False, True, True, True, True]
    np.testing.assert_allclose(
        map_from_base[2:], [[0.0, 0.5, half_pi], [0.0, 1.5, half_pi], [0.0, 2.5, half_pi], [7.5, 7.0, 0.0]], atol=1e-12
    )
    assert np.isnan(map_from_base[:2]).all()


def test_a_recorded_pose_from_before_the_odometry_is_of_no_use():
    odometry = Trajectory(np.arange(2) * SECOND_NS, np.zeros((2, 3)))
    found, _ = recorded_poses.carried(
        Trajectory(np.array([-SECOND_NS]), np.zeros((1, 3))), odometry, odometry.stamps_ns
    )
    assert not found.any()
