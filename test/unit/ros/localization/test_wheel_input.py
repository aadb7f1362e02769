"""Messages of encoders, of whatever type, become the node's odometry."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32, Int32MultiArray, String

from glass_nav.ros import conversions
from glass_nav.ros.localization import wheel_input
from glass_nav.ros.localization.params import LocalizationParams
from glass_nav.ros.localization.wheel_input import WheelTransforms
from glass_nav.sensing.scan_placement import NoTransform
from glass_nav.sensing.wheel_odometry import WheelParams

MS = 1_000_000


class Log:
    def __init__(self):
        self.lines = []

    def error(self, text, period_s=5.0):
        self.lines.append(text)

    warn = error


class Broadcaster:
    sent = []

    def sendTransform(self, transform):
        self.sent.append(transform)


def packed(msg, kind):
    buffer = io.BytesIO()
    msg.serialize(buffer)
    any_msg = rospy.AnyMsg()
    any_msg.deserialize(buffer.getvalue())
    any_msg._connection_header = {"type": kind}
    return any_msg


def wheels(monkeypatch, log, publish=False, **fields):
    monkeypatch.setattr(wheel_input.tf2_ros, "TransformBroadcaster", Broadcaster)
    p = LocalizationParams(wheels=WheelParams(**fields))
    return WheelTransforms(replace(p, node=replace(p.node, publish_wheel_tf=publish)), None, log)


def joints(stamp_ns, left, right):
    msg = JointState(name=["right_wheel_joint", "left_wheel_joint"], position=[right, left])
    msg.header.stamp = conversions.stamp_from_ns(stamp_ns)
    return packed(msg, "sensor_msgs/JointState")


def test_joint_states_are_odometry_and_go_out_as_tf_if_asked(monkeypatch):
    Broadcaster.sent = []
    robot = wheels(monkeypatch, Log(), publish=True, wheel_topics=("joint_states",))
    assert not robot.has_odometry()
    for step in range(3):
        robot._take(0, joints(1_000 * MS + step * 20 * MS, 0.1 * step, 0.1 * step))
    assert robot.has_odometry() and robot.odometry_name == "/joint_states"
    np.testing.assert_allclose(robot.odom_from_base(1_030 * MS), [0.015, 0.0, 0.0], atol=1e-9)
    (first, last) = Broadcaster.sent
    assert (last.header.frame_id, last.child_frame_id) == ("odom", "base_link")
    assert last.transform.translation.x == pytest.approx(0.02) and first.header.stamp < last.header.stamp
    with pytest.raises(NoTransform):
        robot.odom_from_base(2_000 * MS)
    robot.restart()
    assert not robot.has_odometry()


def test_numbers_without_a_stamp_are_of_the_time_at_which_they_come(monkeypatch):
    now = [rospy.Time(5)]
    monkeypatch.setattr(wheel_input.rospy.Time, "now", lambda: now[0])
    both = wheels(monkeypatch, Log(), wheel_topics=("ticks",), wheel_left_scale_m=1e-3, wheel_right_scale_m=1e-3)
    one_each = wheels(monkeypatch, Log(), wheel_topics=("l", "r"), wheel_left_scale_m=1.0, wheel_right_scale_m=1.0)
    for step in range(2):
        now[0] = rospy.Time(5 + step)
        both._take(0, packed(Int32MultiArray(data=[100 * step, 300 * step]), "std_msgs/Int32MultiArray"))
        for number in range(2):
            one_each._take(number, packed(Float32(data=0.5 * step), "std_msgs/Float32"))
    assert both.odom_from_base(6_000 * MS)[2] == pytest.approx(0.2 / 0.4)
    np.testing.assert_allclose(one_each.odom_from_base(6_000 * MS), [0.5, 0.0, 0.0])


def test_what_cannot_be_used_is_reported(monkeypatch):
    log = Log()
    robot = wheels(monkeypatch, log, wheel_topics=("joint_states",))
    robot._take(0, packed(String(data="fast"), "std_msgs/String"))
    robot._take(0, packed(String(data="fast"), "nobody_msgs/Wheels"))
    assert log.lines[0].startswith("wheel counts not used: joint_states: a String holds no counts of wheels")
    assert log.lines[1].startswith("wheel counts not used: nobody_msgs/Wheels is not installed")
    for step, count in enumerate((0.0, 0.1, -900.0)):
        robot._take(0, joints(step * 20 * MS + MS, count, 0.1 * step))
    assert log.lines[2] == "an encoder restarted (left 1, right 0 times): its wheel is assumed to have stood still"


def test_another_distance_between_the_wheels_holds_from_now_on(monkeypatch):
    robot = wheels(monkeypatch, Log(), wheel_topics=("joint_states",))
    p = LocalizationParams()
    robot.reconfigure(
        replace(p, localizer=replace(p.localizer, odometry=replace(p.localizer.odometry, wheel_base_m=0.8)))
    )
    for step in range(2):
        robot._take(0, joints(1_000 * MS + step * 20 * MS, 0.0, 0.1 * step))
    assert robot.odom_from_base(1_020 * MS)[2] == pytest.approx(0.01 / 0.8)
