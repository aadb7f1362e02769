from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from geometry_msgs.msg import Twist, Vector3
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from glass_nav.msg import TrueBeams
from glass_nav.recording.bag_writer import BagWriter
from glass_nav.recording.messages import TRUE_BEAMS
from glass_nav.ros import conversions
from glass_nav.ros.simulator import frame_messages
from glass_nav.ros.simulator.frame_messages import FrameNames
from glass_nav.sensing import scan_placement
from glass_nav.sensing.mounting import Mounting
from glass_nav.sensing.scan import scan_from_fields
from glass_nav.simulation.lidar import TrueScan
from glass_nav.simulation.simulation import Frame, OdometrySample

STAMP_NS = 1_600_000_000_123_456_789
POSE = np.array([1.5, -2.0, 0.7])
LASER = np.array([0.12, 0.0, 0.1])
NAMES = FrameNames("m", "o", "b", "l")


@pytest.fixture
def frame():
    ranges_m = np.array([1.0, np.inf, -np.inf, np.nan, 2.5])
    scan = scan_from_fields(STAMP_NS, ranges_m, -0.5, 0.25, 0.1, 25.0, LASER)
    truth = TrueScan(
        ranges_m,
        np.array([1, 0, 0, 0, 3], np.uint8),
        np.array([1.01, np.nan, 0.05, np.nan, 2.49]),
        np.array([np.nan, 1.0, np.nan, np.nan, 1.25]),
        np.array([900.0, 0.0, 0.0, 0.0, 120.0]),
    )
    reading = OdometrySample(STAMP_NS, np.array([0.5, 0.25, -0.5]), np.array([0.4, 0.1, -0.2]))
    return Frame(STAMP_NS, POSE, reading.odom_from_base, scan, truth, (reading,), False)


def serialized(msg):
    raw = BytesIO()
    msg.serialize(raw)
    return raw.getvalue()


def over_the_wire(msg):
    """As a subscriber gets it."""
    return type(msg)().deserialize(serialized(msg))


def test_a_scan_comes_back_through_the_conversion_of_the_localization(frame):
    msg = over_the_wire(frame_messages.scan_msg(frame.scan, 0.1, "laser"))
    assert isinstance(msg, LaserScan)
    assert (msg.header.frame_id, msg.scan_time) == ("laser", pytest.approx(0.1))
    back = scan_placement.mounted(conversions.raw_scan_from_msg(msg), Mounting(LASER, 0.2))
    assert back.stamp_ns == STAMP_NS
    np.testing.assert_allclose(back.ranges_m, frame.scan.ranges_m)
    np.testing.assert_allclose(back.angles_rad, frame.scan.angles_rad, atol=1e-6)


def test_true_beams_keep_case_and_ways_beam_by_beam(frame):
    msg = over_the_wire(frame_messages.true_beams_msg(frame.stamp_ns, frame.truth, "laser"))
    assert list(msg.cases) == [1, 0, 0, 0, 3]
    np.testing.assert_allclose(msg.exact, frame.truth.exact_m, rtol=1e-6)
    np.testing.assert_allclose(msg.crossing, frame.truth.crossing_m, rtol=1e-6)
    assert conversions.ns_from_stamp(msg.header.stamp) == STAMP_NS


def test_poses_and_wheels_have_their_frames_and_stamps(frame):
    odometry = over_the_wire(frame_messages.odometry_msg(frame.odometry[0], NAMES))
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("o", "b")
    np.testing.assert_allclose(conversions.planar_from_pose(odometry.pose.pose), frame.odom_from_base)
    twist = odometry.twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (0.4, 0.1, -0.2)
    truth = over_the_wire(frame_messages.ground_truth_msg(frame, NAMES))
    assert truth.header.frame_id == "m"
    np.testing.assert_allclose(conversions.planar_from_pose(truth.pose), POSE)
    for msg in (odometry, truth):
        assert conversions.ns_from_stamp(msg.header.stamp) == STAMP_NS


def test_the_initial_pose_is_one_that_the_localization_takes(frame):
    guess = conversions.guess_from_msg(frame_messages.initial_pose_msg(frame, NAMES), "m")
    np.testing.assert_allclose(guess.map_from_base, POSE)
    np.testing.assert_allclose(np.sqrt(np.diag(guess.covariance)), frame_messages.START_DEVIATION)
    assert guess.stamp_ns == STAMP_NS


def test_a_velocity_command_must_be_finite():
    msg = Twist(Vector3(0.5, 0.1, 9.0), Vector3(8.0, 7.0, -1.0))
    np.testing.assert_array_equal(frame_messages.velocity_from_msg(msg), [0.5, 0.1, -1.0])
    with pytest.raises(ValueError) as caught:
        frame_messages.velocity_from_msg(Twist(Vector3(float("nan"), 0.1, 0.0), Vector3()))
    assert str(caught.value) == "a velocity must be finite, got linear.x nan, linear.y 0.1, angular.z 0.0"


def test_bags_name_the_message_as_ros_does():
    """The digest decides whether a player's TrueBeams reaches a subscriber."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    kind = BagWriter.KINDS["/true_beams"]
    store.register(get_types_from_msg(TRUE_BEAMS, kind))
    assert store.generate_msgdef(kind)[1] == TrueBeams._md5sum


def transform(parent, child, parent_from_child):
    return TFMessage([conversions.transform_stamped(STAMP_NS, parent, child, parent_from_child)])


def test_rosbag_reads_what_the_package_writes(frame, tmp_path):
    """So do `rosbag info` and `rosbag play`: each message comes out as the type of this machine."""
    rosbag = pytest.importorskip("rosbag")
    with BagWriter(tmp_path / "run.bag") as writer:
        writer.mounting(STAMP_NS, LASER)
        writer.odometry(STAMP_NS, frame.odom_from_base, frame.odometry[0].velocity)
        writer.scan(frame.scan, 0.1)
        writer.truth(STAMP_NS, POSE, frame.truth.case, frame.truth.exact_m, frame.truth.crossing_m)
    names = FrameNames()
    expected = {
        "/scan": frame_messages.scan_msg(frame.scan, 0.1, "laser"),
        "/true_beams": frame_messages.true_beams_msg(STAMP_NS, frame.truth, "laser"),
        "/odom": frame_messages.odometry_msg(frame.odometry[0], names),
        "/ground_truth": frame_messages.ground_truth_msg(frame, names),
        "/clock": Clock(conversions.stamp_from_ns(STAMP_NS)),
        "/tf": transform("odom", "base_link", frame.odom_from_base),
        "/tf_static": transform("base_link", "laser", LASER),
    }
    with rosbag.Bag(str(tmp_path / "run.bag")) as bag:
        read = {topic: (raw, stamp) for topic, raw, stamp in bag.read_messages(raw=True)}
        assert {topic: info.msg_type for topic, info in bag.get_type_and_topic_info().topics.items()} == {
            topic: msg._type for topic, msg in expected.items()
        }
    assert read.keys() == expected.keys()
    for topic, msg in expected.items():
        (kind, data, digest, *_), stamp = read[topic]
        assert (kind, digest) == (msg._type, msg._md5sum)
        assert data == serialized(msg), topic
        assert stamp == conversions.stamp_from_ns(STAMP_NS)
