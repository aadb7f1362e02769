"""Files that hold one scan: what rostopic writes, tables, and what is neither."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.recording import scan_file
from glass_nav.recording.recording import RecordingError

MESSAGE = """header:
  seq: 7
  stamp: {secs: 12, nsecs: 5}
  frame_id: "laser"
angle_min: -0.5
angle_max: 0.5
angle_increment: 0.25
time_increment: 0.0
scan_time: 0.1
range_min: 0.1
range_max: 10.0
ranges: [1.0, nan, inf, 2.5, 0.05]
intensities: []
---
"""


def test_what_rostopic_writes_is_a_scan(tmp_path):
    path = tmp_path / "scan.yaml"
    path.write_text(MESSAGE)
    scan = scan_file.load(path, (0.1, 0.2, 0.3))
    np.testing.assert_array_equal(scan.ranges_m, [1.0, np.nan, np.inf, 2.5, -np.inf])
    np.testing.assert_allclose(scan.angles_rad, [-0.5, -0.25, 0.0, 0.25, 0.5])
    assert (scan.range_min_m, scan.range_max_m) == (0.1, 10.0)
    assert scan.base_from_laser.tolist() == [0.1, 0.2, 0.3]


def test_a_range_max_that_is_no_limit_is_the_longest_range(tmp_path):
    path = tmp_path / "scan.yaml"
    path.write_text(MESSAGE.replace("range_max: 10.0", "range_max: inf"))
    scan = scan_file.load(path)
    np.testing.assert_array_equal(scan.ranges_m, [1.0, np.nan, np.inf, 2.5, -np.inf])
    assert scan.range_max_m == pytest.approx(2.51)


@pytest.mark.parametrize("head", ["", "angle_rad,range_m\n", "# of a robot\n"])
def test_a_table_of_angles_and_ranges_is_a_scan(tmp_path, head):
    path = tmp_path / "scan.csv"
    path.write_text(head + "-0.5, 1.0\n0.0, inf\n\n0.1; 0\n0.5,2.0  # far\n0.6, nan\n")
    scan = scan_file.load(path)
    np.testing.assert_array_equal(scan.ranges_m, [1.0, np.inf, np.nan, 2.0, np.nan])
    assert scan.angles_rad.tolist() == [-0.5, 0.0, 0.1, 0.5, 0.6]
    assert scan.range_max_m > 2.0 and scan.base_from_laser.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "name, text, line",
    [
        ("a.yaml", "[1, 2", "is not yaml"),
        ("a.yaml", "angle_min: 1", "must hold the fields of a LaserScan, with a list of ranges"),
        ("a.yaml", "ranges: [1.0]", "lacks angle_min, angle_increment, range_min, range_max"),
        ("a.yaml", MESSAGE.replace("2.5", "far"), "range 3 must be a number, got 'far'"),
        ("a.yaml", MESSAGE.replace("2.5", "true"), "range 3 must be a number, got True"),
        ("a.yaml", MESSAGE.replace("range_max: 10.0", "range_max: [1]"), "range_max must be a number, got [1]"),
        ("a.yaml", MESSAGE.replace("range_max: 10.0", "range_max: 0"), "range_max must be finite and > 0 m, got 0.0"),
        ("a.csv", "angle,range\n", "no beams, a scan needs at least 1"),
        ("a.csv", "0.1,1\nfar,2\n", "line 2 must be an angle [rad] and a range [m], got 'far,2'"),
        ("a.csv", "0.1\n", "line 1 must be an angle [rad] and a range [m], got '0.1'"),
        ("a.csv", "nan,1\n", "line 1 must be an angle [rad] and a range [m], got 'nan,1'"),
    ],
)
def test_what_holds_no_scan_is_refused_in_one_line(tmp_path, name, text, line):
    (tmp_path / name).write_text(text)
    with pytest.raises(RecordingError) as refused:
        scan_file.load(tmp_path / name)
    assert str(refused.value).startswith(f"{tmp_path / name}: {line}")


def test_a_picture_is_no_scan(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(RecordingError, match="is no text"):
        scan_file.load(tmp_path / "a.csv")
