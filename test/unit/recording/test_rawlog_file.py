"""The small rawlogs are written by test/data/mrpt/make.cpp, which says what is in them."""

from __future__ import annotations

import gzip
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, RecordingError, Refusal, Step

RAWLOGS = Path(__file__).resolve().parents[2] / "data" / "mrpt"
DEMO = Path("/usr/share/mrpt/datasets/uwb_ro-localization_demo.rawlog")  # apt: mrpt-common


def refusal(path, options=LogOptions()):
    with pytest.raises(RecordingError) as caught:
        open_log(path, options)
    text = str(caught.value)
    assert "\n" not in text
    return text.replace(f"{path.parent}/", "")


def test_movements_between_frames_add_up_to_odometry():
    recording = open_log(RAWLOGS / "paired.rawlog")
    steps = list(recording)
    assert [step.scan.stamp_ns for step in steps] == [10**12, 1001 * 10**9, 1002 * 10**9, 1003 * 10**9]
    c, s = np.cos(0.5), np.sin(0.5)
    np.testing.assert_allclose(
        [step.odom_from_base for step in steps],
        [[0, 0, 0], [1, 0, 0.5], [1 + c, s, 1.0], [1 + c + np.cos(1.0), s + np.sin(1.0), 1.5]],
        atol=1e-9,
    )
    scan = steps[1].scan
    np.testing.assert_allclose(scan.angles_rad, np.radians([-90, -45, 0, 45, 90]), atol=1e-6)
    np.testing.assert_allclose(scan.ranges_m, [2.0, 2.125, np.inf, 2.375, 2.5])  # MRPT: no answer
    np.testing.assert_allclose(scan.base_from_laser, [0.1, 0, 0], atol=1e-7)
    assert (scan.range_min_m, scan.range_max_m) == (0.0, 20.0)
    assert recording.notes == ["scans of sensor 'laser', odometry from the actions"]
    assert recording.ground_truth is None


def test_frames_without_times_get_some_in_their_order():
    recording = open_log(RAWLOGS / "paired_without_times.rawlog")
    assert [step.scan.stamp_ns for step in recording] == [0, 10**8, 2 * 10**8, 3 * 10**8]
    assert "the scans have no times: 0.1 s between them assumed" in recording.notes


@pytest.mark.parametrize("sensor, pose, first_angle", [("front", [0.2, 0.1, 0.5], -90), ("rear", [-0.2, 0, np.pi], 90)])
def test_single_observations_are_joined_by_their_times(sensor, pose, first_angle):
    recording = open_log(RAWLOGS / "observations.rawlog", LogOptions(scan_topic=sensor))
    steps = list(recording)
    # readings at -0.5, 0.5, 1.5 and 2.5 s of 0..3 m, and at 3 s of 4 m
    np.testing.assert_allclose(
        [step.odom_from_base for step in steps],
        [[0.5, 0, 0.05], [1.5, 0, 0.15], [2.5, 0, 0.25], [4, 0, 0.4]],
        atol=1e-9,
    )
    x, y, yaw = steps[0].scan.base_from_laser
    assert (x, y) == (pytest.approx(pose[0], abs=1e-6), pytest.approx(pose[1], abs=1e-6))
    assert np.cos(yaw - pose[2]) == pytest.approx(1.0)
    assert np.degrees(steps[0].scan.angles_rad[0]) == pytest.approx(first_angle)  # rear hangs upside down
    assert recording.notes == [f"scans of sensor '{sensor}', odometry from CObservationOdometry"]


def test_a_given_laser_pose_replaces_the_recorded_one():
    recording = open_log(RAWLOGS / "paired.rawlog", LogOptions(laser_pose=(1.0, 2.0, 3.0)))
    assert next(iter(recording)).scan.base_from_laser.tolist() == [1.0, 2.0, 3.0]


def test_the_ground_truth_beside_a_rawlog_is_found(tmp_path):
    path = tmp_path / "drive.rawlog"
    shutil.copy(RAWLOGS / "paired.rawlog", path)
    (tmp_path / "drive_GT.txt").write_text("0 1 2 0.5\n1 2 3 0.5\n")
    truth = open_log(path).ground_truth
    assert truth.stamps_ns.tolist() == [1001 * 10**9, 1002 * 10**9]
    assert open_log(path, LogOptions(ground_truth="none")).ground_truth is None
    (tmp_path / "tum.txt").write_text("1000 7 8 0 0 0 0 1\n")
    assert open_log(path, LogOptions(ground_truth=str(tmp_path / "tum.txt"))).ground_truth.poses[0, 0] == 7.0


def test_the_file_may_be_compressed_or_not(tmp_path):
    raw = gzip.decompress((RAWLOGS / "paired.rawlog").read_bytes())
    (tmp_path / "plain.rawlog").write_bytes(raw)
    assert len(list(open_log(tmp_path / "plain.rawlog"))) == 4


def test_a_rawlog_cut_short_gives_what_it_holds_and_says_so(tmp_path):
    raw = gzip.decompress((RAWLOGS / "paired.rawlog").read_bytes())
    (tmp_path / "cut.rawlog").write_bytes(raw[: len(raw) * 2 // 3])
    recording = open_log(tmp_path / "cut.rawlog")
    assert 0 < len(list(recording)) < 4
    assert recording.notes[0].startswith("reading stopped early: the file ends within object ")


def test_damage_within_the_compressed_file_ends_the_reading(tmp_path):
    raw = b"".join((RAWLOGS / f"{name}.rawlog").read_bytes() for name in ("paired", "observations"))
    raw = gzip.decompress(raw)
    packed = bytearray(gzip.compress(raw * 50 + np.random.default_rng(0).bytes(10_000)))
    packed[2000:2400] = bytes(400)
    (tmp_path / "bad.rawlog").write_bytes(packed)
    recording = open_log(tmp_path / "bad.rawlog", LogOptions(scan_topic="laser"))
    assert 0 < len(list(recording)) < 50 * 4
    assert recording.notes[0].startswith("reading stopped early: the file ")


def test_bytes_that_make_no_text_do_no_harm(tmp_path):
    raw = gzip.decompress((RAWLOGS / "paired.rawlog").read_bytes())
    (tmp_path / "bad.rawlog").write_bytes(raw.replace(b"CActionCollection", b"CActionColle\xfftion"))
    assert refusal(tmp_path / "bad.rawlog").startswith(
        "bad.rawlog: holds no odometry; it holds 1 CObservation2DRangeScan, 1 CSensoryFrame; "
        "the file has object 2 damaged ("
    )


@pytest.mark.parametrize(
    "name, options, text",
    [
        ("absent.rawlog", LogOptions(), "absent.rawlog: does not exist"),
        (
            "no_odometry.rawlog",
            LogOptions(),
            "no_odometry.rawlog: holds no odometry; it holds 4 CObservation2DRangeScan",
        ),
        (
            "no_scans.rawlog",
            LogOptions(),
            "no_scans.rawlog: holds no CObservation2DRangeScan; it holds 1 CObservationComment",
        ),
        (
            "observations.rawlog",
            LogOptions(),
            "observations.rawlog: has scans of 2 sensors ('front', 'rear'), choose one with --scan-topic",
        ),
        (
            "observations.rawlog",
            LogOptions(scan_topic="top"),
            "observations.rawlog: no sensor 'top'; sensors with scans: 'front', 'rear'",
        ),
    ],
)
def test_a_rawlog_that_lacks_something_is_refused_in_one_line(name, options, text):
    assert refusal(RAWLOGS / name, options) == text


@pytest.mark.parametrize(
    "content, text",
    [
        (b"", "log.rawlog: is empty or cut short"),
        (b"\x1f\x8b\x08\x00\x00", "log.rawlog: is empty or cut short"),
        (b"words and more words, but no objects at all" * 10, "log.rawlog: is no rawlog: it "),
    ],
)
def test_files_that_are_no_rawlogs_are_refused_in_one_line(tmp_path, content, text):
    (tmp_path / "log.rawlog").write_bytes(content)
    assert refusal(tmp_path / "log.rawlog").startswith(text)


def test_nothing_goes_to_stderr(tmp_path):
    """By a process of its own: MRPT would write past Python's sys.stderr."""
    raw = gzip.decompress((RAWLOGS / "paired.rawlog").read_bytes())
    (tmp_path / "cut.rawlog").write_bytes(raw[:200])
    program = (
        "import sys; from glass_nav.recording.log_file import open_log\n"
        "for path in sys.argv[1:]:\n"
        "    try: open_log(path)\n"
        "    except ValueError as err: print(err)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "cut.rawlog"), str(tmp_path)], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_scans_that_cannot_be_used_are_refused_one_by_one():
    from glass_nav.recording.rawlog_file import _Entries  # a file with these faults cannot be written by MRPT

    good = {
        "stamps_ns": np.array([5, 4, -1, 6, 7, 8]) * 10**9,
        "beams": np.full(6, 2),
        "ranges_m": np.ones(12, np.float32),
        "valid": np.ones(12, np.uint8),
        "first_angle_rad": np.zeros(6),
        "angle_step_rad": np.array([0.1, 0.1, 0.1, 0.1, 0.0, 0.1]),
        "range_max_m": np.full(6, 9.0),
        "sensor_pose": np.zeros((6, 6)),
        "odometry_index": np.full(6, -1),
        "odometry": np.zeros((0, 3)),
    }
    good["sensor_pose"][3, 5] = np.pi / 2
    entries = list(_Entries(good, np.arange(6), None, LogOptions()))
    assert isinstance(entries[0], Step) and isinstance(entries[5], Step)
    assert [entry.reason for entry in entries if isinstance(entry, Refusal)] == [
        "time runs backwards",
        "the scan has no time",
        "the laser is tilted by 90 degrees; level within 20 degrees is needed, upright or upside down",
        "angle_increment must be finite and not 0 rad, got 0.0",
    ]


@pytest.mark.skipif(not DEMO.exists(), reason="no rawlogs of apt's mrpt-common")
def test_the_demo_log_of_mrpt_is_read_whole():
    recording = open_log(DEMO)
    steps = list(recording)
    assert (len(steps), len(recording.ground_truth)) == (343, 342)
    way = np.array([step.odom_from_base for step in steps])
    length = np.hypot(*np.diff(way[:, :2], axis=0).T).sum()
    assert length == pytest.approx(108.0, rel=0.05)  # as the log's own ground truth has it
