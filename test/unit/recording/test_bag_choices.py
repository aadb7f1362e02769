"""Which topics and frames of a bag are read, and what is said where something is missing."""

from __future__ import annotations

import numpy as np
import pytest
from opened_bags import refusal, steps

from glass_nav.recording import frames
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions


@pytest.mark.parametrize("odom_child", ["base_link", "/base_link", ""])
def test_the_base_is_the_frame_that_odometry_places(room_bag, odom_child):
    bag = room_bag(odometry="topic", odom_child=odom_child)
    np.testing.assert_allclose(steps(open_log(bag.write()))[0].scan.base_from_laser, bag.laser)
    taken = steps(open_log(bag.path, LogOptions(base_frame="base_link", odom_topic="odom")))
    np.testing.assert_allclose(taken[0].scan.base_from_laser, bag.laser)


def test_of_two_odometries_the_usual_name_wins(room_bag):
    assert "odometry from /odom" in open_log(room_bag(odometry="topic", odom_topics=("/odom", "/vo")).write()).notes


def test_an_odometry_without_one_pose_is_refused(room_bag, monkeypatch):
    path = room_bag(odometry="topic", laser_tf=False).write()
    monkeypatch.setattr(frames, "normalised", lambda quaternion: None)
    assert refusal(path) == "room.bag: /odom holds no pose that can be used"


def test_a_given_laser_pose_replaces_tf(room_bag):
    bag = room_bag(laser_tf=False)
    taken = steps(open_log(bag.write(), LogOptions(laser_pose=(0.4, 0.5, 0.6))))
    np.testing.assert_array_equal(taken[0].scan.base_from_laser, [0.4, 0.5, 0.6])


@pytest.mark.parametrize(
    "options, note",
    [
        (LogOptions(scan_topic="/rear"), "ground truth from /ground_truth"),
        (LogOptions(scan_topic="rear"), "ground truth from /ground_truth"),  # relative names, as in a launch file
        (LogOptions(), "scans from /scan"),
    ],
)
def test_of_several_lasers_one_is_chosen(room_bag, options, note):
    recording = open_log(room_bag(scan_topics=("/scan", "/rear")).write(), options)
    assert note in recording.notes
    assert len(recording) == 20


TOPICS = (
    "/ground_truth (geometry_msgs/PoseStamped), /scan (sensor_msgs/LaserScan), /tf (tf2_msgs/TFMessage), "
    "/tf_static (tf2_msgs/TFMessage)"
)


@pytest.mark.parametrize(
    "fields, options, text",
    [
        ({}, LogOptions(scan_topic="/front"), f"room.bag: no topic /front; it has {TOPICS}"),
        ({}, LogOptions(scan_topic="/tf"), "room.bag: /tf is tf2_msgs/TFMessage, expected sensor_msgs/LaserScan"),
        ({}, LogOptions(odom_topic="odom"), f"room.bag: no topic odom; it has {TOPICS}"),
        ({}, LogOptions(ground_truth="/truth"), f"room.bag: no topic /truth; it has {TOPICS}"),
        (
            {},
            LogOptions(ground_truth="/scan"),
            "room.bag: /scan is sensor_msgs/LaserScan, expected geometry_msgs/PoseStamped or "
            "geometry_msgs/PoseWithCovarianceStamped or nav_msgs/Odometry",
        ),
        ({}, LogOptions(ground_truth="true.txt"), "true.txt: no such file of poses, and no topic of room.bag"),
        (
            {"scan_topics": ("/front", "/rear")},
            LogOptions(),
            "room.bag: 2 topics of sensor_msgs/LaserScan (/front, /rear), choose one with --scan-topic",
        ),
        (
            {"scan_topics": ()},
            LogOptions(),
            "room.bag: no topic of sensor_msgs/LaserScan; it has "
            "/ground_truth (geometry_msgs/PoseStamped), /tf (tf2_msgs/TFMessage), /tf_static (tf2_msgs/TFMessage)",
        ),
        (
            {"odometry": "none", "ground_truth": False},
            LogOptions(),
            "room.bag: no odometry: no transform odom <- base_link or base_footprint in tf and no topic of "
            "nav_msgs/Odometry; it has /scan (sensor_msgs/LaserScan), /tf_static (tf2_msgs/TFMessage)",
        ),
        (
            {"odometry": "topic", "odom_topics": ("/left", "/right")},
            LogOptions(),
            "room.bag: 2 topics of nav_msgs/Odometry (/left, /right), choose one with --odom-topic",
        ),
        (
            {"odometry": "topic", "odom_topics": ("/true",)},
            LogOptions(ground_truth="/true"),
            "room.bag: no odometry: no transform odom <- base_link or base_footprint in tf and no topic of "
            "nav_msgs/Odometry; it has /ground_truth (geometry_msgs/PoseStamped), /scan (sensor_msgs/LaserScan), "
            "/tf_static (tf2_msgs/TFMessage), /true (nav_msgs/Odometry)",
        ),
        (
            {"laser": (float("nan"), 0.0, 0.0)},
            LogOptions(),
            "room.bag: no transform base_link <- laser for the laser on /scan; frames in tf: base_link, odom; "
            "say where it is with --laser-pose X Y YAW",
        ),
        (
            {},
            LogOptions(odom_frame="wheels"),
            "room.bag: no transform wheels <- base_link or base_footprint; frames in tf: base_link, laser, odom",
        ),
        (
            {"laser_tf": False},
            LogOptions(),
            "room.bag: no transform base_link <- laser for the laser on /scan; frames in tf: base_link, odom; "
            "say where it is with --laser-pose X Y YAW",
        ),
        (
            {"scan_fields": lambda index, fields: {**fields, "frame": ""}},
            LogOptions(),
            "room.bag: the scans on /scan have no frame_id; say where the laser is with --laser-pose X Y YAW",
        ),
    ],
)
def test_a_bag_that_lacks_something_is_refused_in_one_line(room_bag, fields, options, text):
    assert refusal(room_bag(**fields).write(), options) == text
