"""The kinds of bags that people have, made by the tools that they make them with: all read as the plain one does."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import List

import numpy as np
import pytest

from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import Recording, RecordingError

ROS2_BAGS = Path(__file__).resolve().parents[2] / "data" / "ros2"
needs_rosbag = pytest.mark.skipif(shutil.which("rosbag") is None, reason="no rosbag in PATH")


def ros(*command: str) -> str:
    """Runs a program of ROS 1, which has its own Python beside that of the tests."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if name != "PYTHONPATH" or sys.version_info[:2] == (3, 8) and os.path.exists("/opt/ros/noetic")
    }
    done = subprocess.run(
        command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


def same(recording: Recording, plain: Recording) -> None:
    assert len(recording) == len(plain)
    steps, plain_steps = list(recording), list(plain)
    assert len(steps) == len(plain_steps)
    for step, other in zip(steps, plain_steps):
        assert step.scan.stamp_ns == other.scan.stamp_ns
        np.testing.assert_array_equal(step.scan.ranges_m, other.scan.ranges_m)
        np.testing.assert_array_equal(step.scan.base_from_laser, other.scan.base_from_laser)
        np.testing.assert_array_equal(step.odom_from_base, other.odom_from_base)
    np.testing.assert_array_equal(recording.ground_truth.poses, plain.ground_truth.poses)
    assert recording.notes == plain.notes


@pytest.mark.long_run
@needs_rosbag
@pytest.mark.parametrize("option", ["--lz4", "--bz2"])
def test_a_bag_that_rosbag_compressed(room_bag, tmp_path, option):
    plain = room_bag().write()
    ros("rosbag", "compress", "-q", option, "--output-dir", str(tmp_path), str(plain))
    kept = plain.with_name("room.orig.bag")
    assert option[2:].encode() in plain.read_bytes()
    same(open_log(plain), open_log(kept))


@pytest.mark.long_run
@needs_rosbag
def test_a_run_that_was_recorded_in_parts(room_bag, tmp_path):
    plain = room_bag().write()
    parts = [tmp_path / name for name in ("room_0.bag", "room_1.bag", "room_2.bag")]
    cuts = [0.0, 1000.7, 1001.25, 1e9]  # /tf_static is in the first part only
    for part, begin, end in zip(parts, cuts[:-1], cuts[1:]):
        ros("rosbag", "filter", str(plain), str(part), f"{begin} <= t.to_sec() < {end}")
    assert "/tf_static" not in open_names(parts[1])
    for order in (parts, parts[::-1]):
        recording = open_log(order)
        same(recording, open_log(plain))
        assert recording.name == f"{order[0].name} and 2 more"


def open_names(path: Path) -> List[str]:
    from rosbags.rosbag1 import Reader

    with Reader(path) as reader:
        return list(reader.topics)


@pytest.mark.long_run
@needs_rosbag
def test_a_bag_that_was_never_closed_comes_with_advice_that_helps(room_bag, tmp_path):
    plain = room_bag().write()
    killed = tmp_path / "killed.bag"
    code = (
        "import os, rosbag\n"
        f"new = rosbag.Bag({str(killed)!r}, 'w', chunk_threshold=4096)\n"
        f"for topic, message, t in rosbag.Bag({str(plain)!r}).read_messages():\n    new.write(topic, message, t)\n"
        "os._exit(0)\n"
    )
    ros("/usr/bin/python3", "-c", code)
    with pytest.raises(RecordingError) as caught:
        open_log(killed)
    command = f"rosbag reindex {killed}"
    assert str(caught.value) == (
        f"{killed}: cut short or never closed (its index is missing); `{command}` may save what it holds"
    )
    with pytest.raises(RecordingError, match=r"killed\.bag: cut short or never closed"):
        open_log([plain, killed])
    ros(*command.split())
    saved, whole = list(open_log(killed)), list(open_log(plain))
    assert 15 <= len(saved) <= len(whole)  # what was not in the file yet is lost
    assert [step.scan.stamp_ns for step in saved] == [step.scan.stamp_ns for step in whole[: len(saved)]]


@pytest.mark.long_run
def test_a_bag_of_ros_2_in_sqlite3(room_bag, tmp_path):
    plain = room_bag(true_beams=[("/true_beams", "TrueBeams")]).write()
    subprocess.run(
        [
            str(Path(sys.executable).with_name("rosbags-convert")),
            *(["--src"] if sys.version_info >= (3, 10) else []),
            str(plain),
            "--dst",
            str(tmp_path / "room2"),
        ],
        check=True,
    )
    recording = open_log(tmp_path / "room2")
    same(recording, open_log(plain))
    assert len(list(recording.beam_truth)) == 20
    (database,) = (tmp_path / "room2").glob("*.db3")
    assert len(open_log(database)) == 20
    (tmp_path / "room2" / "metadata.yaml").unlink()
    for path, text in [
        (database, "a bag of ROS 2 needs metadata.yaml beside it (`ros2 bag reindex` writes it)"),
        (database.parent, "is a folder without metadata.yaml, so no bag of ROS 2 (`ros2 bag reindex` writes it)"),
    ]:
        with pytest.raises(RecordingError) as caught:
            open_log(path)
        assert str(caught.value) == f"{path}: {text}"


def test_a_bag_of_ros_2_in_mcap():
    """test/data/ros2/room_mcap: `rosbags-convert --dst-storage mcap` of a RoomBag(scans=4, beams=12)."""
    recording = open_log(ROS2_BAGS / "room_mcap")
    steps = list(recording)
    assert [step.scan.stamp_ns for step in steps] == [10**12 + 10**8 * number for number in range(4)]
    assert [len(step.scan) for step in steps] == [12] * 4
    assert recording.ground_truth is not None
    (file,) = (ROS2_BAGS / "room_mcap").glob("*.mcap")
    same(open_log(file), recording)


def test_parts_that_make_no_run_are_refused(room_bag, tmp_path):
    plain = room_bag().write()
    for paths, text in [
        ([plain, plain], f"{plain}, {plain}: a bag is named twice"),
        ([plain, tmp_path / "run.rawlog"], f"{tmp_path / 'run.rawlog'}: only bags can be parts of one run, got 2 logs"),
        ([plain, tmp_path / "no.bag"], f"{tmp_path / 'no.bag'}: does not exist"),
    ]:
        with pytest.raises(RecordingError) as caught:
            open_log(paths)
        assert str(caught.value) == text
