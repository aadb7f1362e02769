"""Files that are no bags, damaged bags, and what can still be read of them."""

from __future__ import annotations

import pytest
from opened_bags import refusal

from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, Refusal, Step


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
    assert refusal(tmp_path / "notes.txt").startswith("notes.txt: cannot be read: ")
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
