"""A running robot: another node that sends a transform is named, as long as it goes on."""

from __future__ import annotations

import pytest

from glass_nav.sensing.transform_senders import TransformSenders

HERE, THERE = (0.0,) * 7, (1.0,) * 7
LINE = "comes from /amcl and /other: the robot jumps between their answers; stop one of them"


@pytest.mark.parametrize("static", [False, True])
def test_a_second_map_to_odom_is_named(static):
    senders = TransformSenders("odom", "base_link")
    assert senders.hear("map", "odom", HERE, "/amcl", False, 1.0) is None
    assert senders.hear("map", "odom", THERE, "/other", static, 1.1) == f"tf map -> odom {LINE}"
    assert senders.hear("map", "odom", HERE, "/amcl", False, 100.0) == (f"tf map -> odom {LINE}" if static else None)


def test_a_static_transform_that_came_first_counts():
    senders = TransformSenders("odom", "base_link")
    senders.hear("/map", "/odom", HERE, "/other", True, 0.0)
    assert senders.hear("map", "odom", THERE, "/amcl", False, 500.0) == f"tf map -> odom {LINE}"


def test_another_parent_of_the_frame_is_the_same_fault():
    senders = TransformSenders("odom", "base_link")
    senders.hear("map", "odom", HERE, "/amcl", False, 1.0)
    assert senders.hear("world", "odom", HERE, "/other", False, 1.0) == f"tf map -> odom or world -> odom {LINE}"


@pytest.mark.parametrize("child", ["base_link", "base_footprint"])
def test_two_senders_of_odometry_are_named(child):
    senders = TransformSenders("odom", "base_link")
    senders.hear("odom", child, HERE, "/wheels", False, 1.0)
    assert senders.hear("odom", child, THERE, "/ekf", False, 1.0) == (
        f"tf odom -> {child} comes from /ekf and /wheels: the robot jumps between their answers; stop one of them"
    )


def test_what_does_no_harm_is_not_said():
    senders = TransformSenders("odom", "base_link")
    for now_s, sender in ((1.0, "/amcl"), (20.0, "/amcl_restarted"), (0.5, "/amcl")):  # time jumped back
        assert senders.hear("map", "odom", HERE, sender, False, now_s) is None
    for sender in ("/state_publisher", "/another"):
        assert senders.hear("base_footprint", "base_link", HERE, sender, True, 1.0) is None
        assert senders.hear("base_link", "wheel", HERE, sender, False, 1.0) is None
