"""Encoder counts -> odometry: the same as tf's, whatever the messages and however the counts arrive."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from glass_nav import params
from glass_nav.geometry import angles, wheel_steps
from glass_nav.params import ParamError
from glass_nav.sensing import wheel_odometry
from glass_nav.sensing.scan_placement import NoTransform
from glass_nav.sensing.wheel_odometry import Counts, WheelOdometry, WheelParams

ONE, TWO = WheelParams(("joint_states",)), WheelParams(("left", "right"))
MS = 1_000_000
BASE_M = 0.4


def joints(left, right):
    return SimpleNamespace(name=["arm", "right_wheel_joint", "left_wheel_joint"], position=[9.0, right, left])


# -- what messages say


def test_messages_of_three_kinds_hold_counts():
    assert wheel_odometry.counts(joints(1.0, 2.0), 0, ONE) == Counts(1.0, 2.0)
    assert wheel_odometry.counts(SimpleNamespace(name=["arm"], position=[0.1]), 0, ONE) == Counts(None, None)
    assert wheel_odometry.counts(SimpleNamespace(data=np.array([3, 4], np.int32)), 0, ONE) == Counts(3.0, 4.0)
    assert wheel_odometry.counts(SimpleNamespace(data=np.int16(5)), 0, TWO) == Counts(5.0, None)
    assert wheel_odometry.counts(SimpleNamespace(data=6), 1, TWO) == Counts(None, 6.0)


@pytest.mark.parametrize(
    "message, p", [({"data": "12"}, TWO), ({"data": [1, 2, 3]}, ONE), ({"data": 1}, ONE), ({"pose": 1}, ONE)]
)
def test_other_messages_are_refused(message, p):
    with pytest.raises(ValueError, match="holds no counts of wheels: allowed are a JointState or an array of two"):
        wheel_odometry.counts(SimpleNamespace(**message), 0, p)


@pytest.mark.parametrize(
    "kind, wraps",
    [("std_msgs/Int16", 65536), ("std_msgs/msg/Int32MultiArray", 2**32), ("std_msgs/Float64", 0), ("x/JointState", 0)],
)
def test_counters_wrap_as_their_type_does(kind, wraps):
    assert wheel_odometry.wraps_at(kind) == wraps


@pytest.mark.parametrize(
    "given, line",
    [
        ({"wheel_topics": ["a", "b", "c"]}, "must be one topic, or two: left, right; got ['a', 'b', 'c']"),
        ({"wheel_topics": ["a", "a"]}, "must be one topic, or two: left, right; got ['a', 'a']"),
        ({"wheel_topics": [""]}, "must name topics, got ['']"),
        ({"wheel_joints": ["a"]}, "must be the joints of the left and the right wheel, got ['a']"),
        ({"wheel_left_scale_m": 0.0}, "must be finite and not 0, got 0.0"),
    ],
)
def test_parameters_that_mean_nothing_are_refused(given, line):
    with pytest.raises(ParamError) as refused:
        params.load(WheelParams, given, "/robot")
    assert line in str(refused.value)


# -- odometry


def arcs(count=40):
    """Stamps [ns], and how far each wheel has rolled [m]: an arc, then back."""
    stamps_ns = np.arange(count) * 20 * MS + 1_700_000_000_000_000_000
    left_m, right_m = np.cumsum(np.r_[np.full(count // 2, 0.01), np.full(count - count // 2, -0.008)]), 0.0
    right_m = left_m + 0.05 * np.sin(np.arange(count) / 7.0)
    return stamps_ns, left_m, right_m


def expected(left_m, right_m):
    return wheel_steps.followed(np.zeros(3), np.diff(left_m), np.diff(right_m), BASE_M)


def test_counts_of_a_joint_state_are_integrated_one_by_one_and_at_once():
    stamps_ns, left_m, right_m = arcs()
    live, read = WheelOdometry(ONE, BASE_M), WheelOdometry(ONE, BASE_M, None)
    told = [wheel_odometry.counts(joints(a / 0.1, b / 0.1), 0, ONE) for a, b in zip(left_m, right_m)]
    news = [live.add(int(stamp_ns), each) for stamp_ns, each in zip(stamps_ns, told)]
    read.add_all(stamps_ns.tolist(), told, [0] * len(told))
    for odometry in (live, read):
        np.testing.assert_allclose(odometry.trajectory.poses[1:], expected(left_m, right_m), atol=1e-9)
        np.testing.assert_array_equal(odometry.trajectory.stamps_ns, stamps_ns)
    assert [len(each) for each in news] == [0] + [1] * (len(stamps_ns) - 1)
    half_way = live.odom_from_base(int(stamps_ns[3]) + 10 * MS)
    np.testing.assert_allclose(half_way, 0.5 * (live.trajectory.poses[3] + live.trajectory.poses[4]), atol=1e-9)


def test_wheels_that_report_at_different_times_are_interpolated():
    stamps_ns = np.arange(0, 2_000 * MS, 20 * MS)
    odometry = WheelOdometry(TWO, BASE_M)
    for stamp_ns in stamps_ns.tolist():
        odometry.add(stamp_ns, Counts(stamp_ns * 1e-9 * 2.0, None))
        odometry.add(stamp_ns + 7 * MS, Counts(None, (stamp_ns + 7 * MS) * 1e-9 * 4.0))
    at_ns = int(odometry.trajectory.stamps_ns[-1])
    since_s = (at_ns - int(odometry.trajectory.stamps_ns[0])) * 1e-9
    whole = wheel_steps.step_of(0.2 * since_s, 0.4 * since_s, BASE_M)  # one arc, at constant speed
    np.testing.assert_allclose(odometry.odom_from_base(at_ns), whole, atol=1e-6)


def test_a_counter_that_wraps_goes_on_and_one_that_starts_over_stood():
    odometry = WheelOdometry(WheelParams(("l", "r"), wheel_left_scale_m=1e-3, wheel_right_scale_m=1e-3), BASE_M)
    for step, count in enumerate((32_700, 32_760, -32_716)):  # 60 ticks each
        odometry.add(step * 20 * MS, Counts(count, count), 2**16)
    assert odometry.trajectory.poses[-1][0] == pytest.approx(0.12)
    assert odometry.resets == (0, 0)
    odometry.add(60 * MS, Counts(0.0, -32_706.0), 0)
    assert odometry.resets == (1, 0)
    assert abs(odometry.trajectory.poses[-1][0] - 0.125) < 1e-3


def test_what_was_not_told_is_not_known():
    odometry = WheelOdometry(ONE, BASE_M)
    with pytest.raises(NoTransform, match="no counts of both wheels on joint_states at 1.000 s"):
        odometry.odom_from_base(1_000 * MS)
    odometry.add(1_000 * MS, Counts(0.0, None))
    odometry.add(1_000 * MS, Counts(None, 0.0))
    odometry.add(1_000 * MS, Counts(5.0, 5.0))  # the same stamp again
    odometry.add(900 * MS, Counts(7.0, float("nan")))
    np.testing.assert_array_equal(odometry.odom_from_base(1_000 * MS), np.zeros(3))
    with pytest.raises(NoTransform):
        odometry.odom_from_base(1_001 * MS)
    odometry.restart()
    assert not len(odometry.trajectory)


def test_the_past_is_forgotten_only_while_a_robot_runs():
    live, read = WheelOdometry(ONE, BASE_M, kept_ns=100 * MS), WheelOdometry(ONE, BASE_M, None)
    for step in range(50):
        for odometry in (live, read):
            odometry.add(step * 10 * MS, Counts(0.1 * step, 0.1 * step))
    assert (len(live.trajectory), len(read.trajectory)) == (11, 50)
    np.testing.assert_allclose(live.trajectory.poses[-1], read.trajectory.poses[-1])
    assert read.odom_from_base(int(49 * 10 * MS + wheel_odometry.SLACK_NS))[0] == pytest.approx(0.49)
    assert abs(angles.wrap(live.trajectory.poses[-1][2])) < 1e-9
