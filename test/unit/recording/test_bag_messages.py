"""Files that are no bags, damaged bags, and what can still be read of them."""

from __future__ import annotations

import itertools

import pytest
from opened_bags import refusal

from glass_nav.recording import bag_observer, messages
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, RecordingError, Refusal, Step


@pytest.mark.parametrize(
    "keep, text",
    [
        (0, "room.bag: is empty"),
        (7, "room.bag: is no ROS 1 bag"),
        (
            3000,
            "room.bag: cut short or never closed (its index is missing); `rosbag reindex room.bag` may save what it "
            "holds",
        ),
        (
            -1,
            "room.bag: cut short or never closed (its index is missing); `rosbag reindex room.bag` may save what it "
            "holds",
        ),
    ],
)
def test_a_bag_cut_short_is_refused_in_one_line(room_bag, keep, text):
    path = room_bag().write()
    path.write_bytes(path.read_bytes()[:keep])
    assert refusal(path) == text


def test_files_that_are_no_bags_are_refused_in_one_line(tmp_path):
    (tmp_path / "notes.txt").write_text("not a bag")
    assert refusal(tmp_path / "notes.txt").startswith("notes.txt: is not a bag")
    assert refusal(tmp_path / "absent.bag") == "absent.bag: does not exist"
    assert refusal(tmp_path).startswith(f"{tmp_path.name}: is a folder without metadata.yaml")


def test_a_damaged_bag_gives_what_comes_before_the_damage(room_bag):
    path = room_bag(scans=400, beams=720).write()
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 5000] = bytes(5000)
    path.write_bytes(content)
    entries = list(open_log(path))
    assert sum(isinstance(entry, Step) for entry in entries) > 50
    assert isinstance(entries[-1], Refusal)
    assert entries[-1].reason.startswith("the bag is damaged: only the first ")


def test_what_is_missing_because_of_damage_is_said_with_the_damage(room_bag):
    path = room_bag(static_laser=False, scans=400).write()
    content = bytearray(path.read_bytes())
    chunk = content.index(b"/tf")  # from the first message of tf on
    content[chunk + 3000 : chunk + 6000] = bytes(3000)
    path.write_bytes(content)
    entries = list(open_log(path))
    assert any(isinstance(entry, Refusal) for entry in entries)
    assert any(note.startswith("the bag is damaged: ") and "on /tf" in note for note in open_log(path).notes)
    assert ": no topic /nothing; it has " in refusal(path, LogOptions(ground_truth="/nothing"))
    assert "; the bag is damaged: " in refusal(path, LogOptions(ground_truth="/nothing"))


def test_rosbags_missing_is_said_in_one_line(room_bag, monkeypatch):
    path = room_bag().write()
    monkeypatch.setitem(__import__("sys").modules, "rosbags.highlevel", None)
    assert refusal(path).startswith("room.bag: reading bags needs the Python package rosbags (pip install rosbags): ")


def rewritten(path, change):
    """The bag with each connection changed: change(topic, kind, definition, md5) -> the same four."""
    from rosbags.rosbag1 import Reader, Writer

    changed = path.with_name("changed.bag")
    if changed.exists():
        changed.unlink()
    with Reader(path) as reader, Writer(changed) as writer:
        connections = {}
        for each in reader.connections:
            topic, kind, definition, md5 = change(each.topic, each.msgtype, messages.text_of(each), each.digest)
            connections[each.id] = writer.add_connection(topic, kind, msgdef=definition, md5sum=md5)
        for each, recorded_ns, raw in reader.messages():
            writer.write(connections[each.id], recorded_ns, raw)
    return changed


def test_standard_types_that_a_bag_does_not_define_are_read_all_the_same(room_bag):
    bare = rewritten(room_bag().write(), lambda topic, kind, definition, md5: (topic, kind, "", md5))
    same_steps(open_log(bare), open_log(bare.with_name("room.bag")))
    some = rewritten(
        bare.with_name("room.bag"),
        lambda topic, kind, definition, md5: (topic, kind, definition if topic == "/scan" else " \n", md5),
    )
    same_steps(open_log(some), open_log(bare.with_name("room.bag")))


@pytest.mark.parametrize("md5", ["*", "0123456789abcdef0123456789abcdef"])
def test_a_type_that_neither_the_bag_nor_noetic_defines_is_named(room_bag, md5):
    path = rewritten(
        room_bag().write(),
        lambda topic, kind, definition, known: (topic, kind, "", md5 if topic == "/scan" else known),
    )
    line = (
        f"changed.bag: /scan is sensor_msgs/LaserScan of md5 {md5}, which the bag does not define and ROS Noetic does not "
        "have; `rosbag record` writes definitions"
    )
    assert refusal(path) == line
    with pytest.raises(RecordingError) as err:
        bag_observer.observe([path])  # the doctor
    assert str(err.value) == f"{path.parent}/{line}"


def test_a_type_of_a_topic_that_is_not_needed_may_be_unknown(room_bag):
    path = rewritten(
        room_bag().write(),
        lambda topic, kind, definition, md5: (
            (topic, "robot_msgs/msg/Own", "", "*") if topic == "/ground_truth" else (topic, kind, definition, md5)
        ),
    )
    assert open_log(path).ground_truth is None
    assert len(list(open_log(path))) == 20


def test_a_definition_that_is_no_definition_is_reported(room_bag):
    path = rewritten(room_bag().write(), lambda topic, kind, definition, md5: (topic, kind, "no type: 3 of", md5))
    assert refusal(path).startswith("changed.bag: a message definition in it cannot be read: ")


def test_topics_without_a_slash_in_front_are_the_same_topics(room_bag):
    bag = room_bag(true_beams=(("/true_beams", "TrueBeams"),))
    bare = rewritten(bag.write(), lambda topic, kind, definition, md5: (topic.lstrip("/"), kind, definition, md5))
    same_steps(open_log(bare), open_log(bag.path))
    assert open_log(bare).notes == open_log(bag.path).notes  # with ground truth, true beams and tf_static
    for topic in ("scan", "/scan"):
        options = LogOptions(scan_topic=topic, odom_topic=None, ground_truth="ground_truth", true_beams="true_beams")
        recording = open_log(bare, options)
        assert recording.ground_truth is not None and recording.beam_truth is not None
    assert list(bag_observer.observe([bare]).scans) == ["/scan"]
    bag.path.unlink()
    odometry = room_bag(odometry="topic")
    bare = rewritten(odometry.write(), lambda topic, kind, definition, md5: (topic[1:], kind, definition, md5))
    for topic in ("odom", "/odom"):
        same_steps(open_log(bare, LogOptions(odom_topic=topic)), open_log(odometry.path))


def same_steps(recording, plain):
    for step, other in itertools.zip_longest(recording, plain):
        assert step.scan.stamp_ns == other.scan.stamp_ns
        assert step.scan.base_from_laser.tolist() == other.scan.base_from_laser.tolist()
        assert step.odom_from_base.tolist() == other.odom_from_base.tolist()
    assert recording.ground_truth.poses.tolist() == plain.ground_truth.poses.tolist()
