"""A bag that is written comes back through our reader and through rosbags; only a whole one gets its name."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from glass_nav.recording import bag_writer
from glass_nav.recording.bag_writer import BagWriter
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import RecordingError, Step
from glass_nav.sensing.scan import scan_from_fields

REPO = Path(__file__).resolve().parents[3]
START_NS = 1_600_000_000 * 10**9
LASER = np.array([0.12, 0.02, 0.3])
SCANS, READINGS, BEAMS = 4, 5, 31


def odometry(index):
    return np.array([0.1 * index, -0.02 * index, 0.03 * index])


def ranges(index):
    values = np.linspace(1.0, 5.0, BEAMS) + index
    values[:3] = np.inf, -np.inf, np.nan
    return values.astype(np.float32)


def truth(index):
    return (
        np.array([1.0 + index, 2.0, 3.0]),
        (np.arange(BEAMS) % 5).astype(np.uint8),
        np.where(np.arange(BEAMS) % 5, 1.5 + index, np.nan),
        np.full(BEAMS, 0.25 + index),
    )


@pytest.fixture
def bag(tmp_path):
    """The path of a bag of 4 scans, 0.1 s apart, with 5 readings of the wheels for each."""
    path = tmp_path / "run.bag"
    with BagWriter(path) as writer:
        assert not path.exists()
        writer.mounting(START_NS, LASER)
        for index in range(SCANS):
            stamp_ns = START_NS + 100_000_000 * index
            for reading in range(READINGS):
                step = READINGS * index + reading
                writer.odometry(
                    stamp_ns - 20_000_000 * (READINGS - 1 - reading), odometry(step), np.array([0.5, 0.25, 0.125])
                )
            scan = scan_from_fields(
                stamp_ns, ranges(index), -1.5, 0.1, 0.1, 25.0, LASER, intensities=np.arange(BEAMS) + index
            )
            writer.scan(scan, 0.1)
            writer.truth(stamp_ns, *truth(index))
    return path


def messages(path):
    """Topic -> messages, as rosbags reads them with what the bag itself says about their types."""
    from rosbags.highlevel import AnyReader

    read = {}
    with AnyReader([path]) as reader:
        for connection, stamp_ns, raw in reader.messages():
            read.setdefault(connection.topic, []).append((stamp_ns, reader.deserialize(raw, connection.msgtype)))
    return read


def test_our_reader_takes_it_as_a_robots(bag):
    recording = open_log(bag)
    assert recording.notes[:3] == [
        "scans from /scan",
        "odometry from tf odom <- base_link",
        "ground truth from /ground_truth",
    ]
    steps = list(recording)
    assert len(steps) == len(recording) == SCANS
    for index, step in enumerate(steps):
        assert isinstance(step, Step)
        assert step.scan.stamp_ns == START_NS + 100_000_000 * index
        np.testing.assert_array_equal(step.scan.ranges_m.astype(np.float32), ranges(index))
        np.testing.assert_array_equal(step.scan.intensities, np.arange(BEAMS) + index)
        np.testing.assert_allclose(step.scan.angles_rad, -1.5 + 0.1 * np.arange(BEAMS), atol=1e-6)
        np.testing.assert_allclose(step.scan.base_from_laser, LASER, atol=1e-9)
        np.testing.assert_allclose(step.odom_from_base, odometry(READINGS * index + READINGS - 1), atol=1e-9)
    np.testing.assert_allclose(recording.ground_truth.poses, [[1.0 + index, 2.0, 3.0] for index in range(SCANS)])


def test_the_truth_has_the_stamps_of_the_scans(bag):
    read = messages(bag)
    for topic in ("/scan", "/ground_truth", "/true_beams"):
        stamps = [(message.header.stamp.sec, message.header.stamp.nanosec) for _, message in read[topic]]
        assert stamps == [(1_600_000_000, 100_000_000 * index) for index in range(SCANS)]
    for index, (_, message) in enumerate(read["/true_beams"]):
        _, case, exact_m, crossing_m = truth(index)
        assert message.header.frame_id == "laser"
        np.testing.assert_array_equal(message.cases, case)
        np.testing.assert_array_equal(message.exact, exact_m.astype(np.float32))
        np.testing.assert_array_equal(message.crossing, crossing_m.astype(np.float32))
    assert {message.header.frame_id for _, message in read["/ground_truth"]} == {"map"}


def test_wheels_time_and_transforms_are_those_of_a_real_robot(bag):
    read = messages(bag)
    assert {topic: len(of_topic) for topic, of_topic in read.items()} == {
        "/scan": SCANS,
        "/ground_truth": SCANS,
        "/true_beams": SCANS,
        "/odom": SCANS * READINGS,
        "/tf": SCANS * READINGS,
        "/clock": SCANS * READINGS,
        "/tf_static": 1,
    }
    _, last = read["/odom"][-1]
    assert (last.header.frame_id, last.child_frame_id) == ("odom", "base_link")
    assert (last.twist.twist.linear.x, last.twist.twist.linear.y, last.twist.twist.angular.z) == (0.5, 0.25, 0.125)
    for stamp_ns, message in read["/clock"]:
        assert message.clock.sec * 10**9 + message.clock.nanosec == stamp_ns
    ((_, static),) = read["/tf_static"]
    assert [(each.header.frame_id, each.child_frame_id) for each in static.transforms] == [("base_link", "laser")]


def test_static_transforms_are_latched(bag):
    assert b"latching=1" in bag.read_bytes()


def test_the_message_is_the_one_that_the_package_has():
    lines = [line.partition("#")[0].strip() for line in (REPO / "msg" / "TrueBeams.msg").read_text().splitlines()]
    written = [re.sub(r"\s+", " ", line) for line in lines if line]
    assert bag_writer.TRUE_BEAMS.splitlines() == written


def test_an_error_leaves_nothing_and_keeps_what_was_there(tmp_path):
    path = tmp_path / "run.bag"
    path.write_bytes(b"older")
    with pytest.raises(ValueError, match="^no more$"), BagWriter(path) as writer:
        writer.mounting(START_NS, LASER)
        raise ValueError("no more")
    assert path.read_bytes() == b"older"
    assert list(tmp_path.iterdir()) == [path]


def test_an_older_bag_and_what_was_left_of_one_are_replaced(tmp_path):
    path = tmp_path / "run.bag"
    path.write_bytes(b"older")
    writer = BagWriter(path)
    writer._growing.write_bytes(b"left by a process that was killed")
    with writer:
        writer.mounting(START_NS, LASER)
    assert path.read_bytes().startswith(b"#ROSBAG V2.0\n")
    assert list(tmp_path.iterdir()) == [path]


def test_where_nothing_can_be_written_it_says_so(tmp_path):
    with pytest.raises(RecordingError) as caught, BagWriter(tmp_path / "no" / "run.bag"):
        pass
    assert str(caught.value) == f"{tmp_path}/no/run.bag: cannot be written: No such file or directory"
    with pytest.raises(RecordingError) as caught, BagWriter(tmp_path):
        pass
    assert str(caught.value) == f"{tmp_path}: is a folder, a bag is a file"


def test_without_rosbags_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.rosbag1", None)
    with pytest.raises(RecordingError, match=r"writing bags needs the Python package rosbags \(pip install rosbags\)"):
        BagWriter(tmp_path / "run.bag").__enter__()
