"""The subcommand as a user calls it: what it prints, and its exit codes."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from glass_nav.cli import main as cli


@pytest.fixture
def doctor(capsys, tmp_path):
    """doctor(argument, ...): exit code, stdout, stderr."""

    def command(*arguments):
        code = cli.main(["doctor", *(str(argument) for argument in arguments)])
        captured = capsys.readouterr()
        return code, captured.out, captured.err.replace(f"{tmp_path}/", "")

    return command


def noisy(index, fields):
    rng = np.random.default_rng(index)
    return {**fields, "ranges": fields["ranges"] + rng.normal(0.0, 0.005, len(fields["ranges"]))}


def test_a_good_bag_is_0_and_told_in_figures(doctor, room_bag, room_map):
    code, out, err = doctor(room_bag(scans=60, beams=180, scan_fields=noisy).write(), "--map", room_map)
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "seen     /scan: 60 scans, 10 Hz, 180 beams over 358 deg, 0.05 to 10 m, frame 'laser'; nothing met is "
        "written as "
        "nothing: all beams answer",
        "seen     tf odom -> base_link: 20 Hz for 6 s, 3.0 m; frames: base_link, laser, odom",
        "seen     map: 122 x 82 cells of 0.05 m",
        "",
        "no fault found",
    ]


def test_a_fault_is_1_with_what_to_do(doctor, room_bag):
    code, out, _ = doctor(room_bag(scan_fields=lambda index, fields: {**fields, "stamp_ns": 0}).write())
    assert code == 1
    lines = out.splitlines()
    at = lines.index("finding  stamps-zero: /scan: 20 of 20 scans have the stamp 0")
    assert lines[at + 1].startswith("  to do  the driver must stamp each scan")
    assert lines[-1].endswith(" finding" if sum(line.startswith("finding") for line in lines) == 1 else " findings")


def test_the_parts_of_a_run_are_one(doctor, room_bag, tmp_path):
    room_bag(scans=8, beams=180, scan_fields=noisy).write().rename(tmp_path / "a_0.bag")
    rest = room_bag(beams=180, scan_fields=lambda index, fields: noisy(index, fields) if index >= 8 else None).write()
    code, out, _ = doctor(tmp_path / "a_0.bag", rest)
    assert "/scan: 20 scans" in out


def test_a_damaged_bag_is_a_finding(doctor, room_bag):
    path = room_bag(scans=400, beams=720).write()
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 5000] = bytes(5000)
    path.write_bytes(content)
    code, out, _ = doctor(path)
    assert code == 1
    assert "finding  bag-damaged: the bag is damaged: " in out


@pytest.mark.parametrize(
    "arguments, code, line",
    [
        ([], 2, "glass_nav doctor: give a bag, or --live to listen to the robot"),
        (["x.bag", "--live"], 2, "glass_nav doctor: give a bag, or --live to listen to the robot, not both"),
        (["--live", "--seconds", "0"], 2, "glass_nav doctor: --seconds must be > 0, got 0.0"),
        (["absent.bag"], 3, "glass_nav doctor: absent.bag: does not exist"),
        (["x.bag", "--map", "no.yaml"], 3, "glass_nav doctor: no.yaml: cannot be read: No such file or directory"),
    ],
)
def test_what_cannot_be_examined_is_one_line(doctor, arguments, code, line):
    told, out, err = doctor(*arguments)
    assert (told, out, err) == (code, "", line + "\n")


@pytest.mark.skipif(not Path("/usr/lib/python3/dist-packages/rospy").exists(), reason="no ROS for this Python")
@pytest.mark.skipif(sys.version_info < (3, 9), reason="the Python 3.8 of these tests has no ROS")
def test_without_a_roscore_live_says_so(doctor, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")
    code, _, err = doctor("--live", "--seconds", "1")
    assert code == 3
    assert err.splitlines() == [
        "glass_nav doctor: listening for 1 s; let the robot drive, with a turn",
        "glass_nav doctor: no roscore at http://localhost:1: start the robot, or set ROS_MASTER_URI",
    ]


def test_without_ros_what_needs_it_says_so(capsys, monkeypatch):
    monkeypatch.setattr("glass_nav.cli.params.READER", "glass_nav.ros.no_such_module")
    assert cli.main(["params", "--from-amcl", "x.launch"]) == 3
    err = capsys.readouterr().err
    assert err.startswith("glass_nav params: this needs ROS: ")
    assert err.endswith("; source its setup.bash\n")
