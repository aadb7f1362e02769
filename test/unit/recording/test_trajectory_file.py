from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording import trajectory_file
from glass_nav.recording.recording import RecordingError


def test_tum_files_come_back_to_the_nanosecond(tmp_path):
    stamps = np.array([0, 1_700_000_000_123_456_789, 1_700_000_000_123_456_790])
    poses = np.array([[1.0, -2.0, 3.1], [0.5, 0.25, -3.1], [0.0, 0.0, 0.0]])
    trajectory_file.save_tum(tmp_path / "way.tum", Trajectory(stamps, poses))
    back = trajectory_file.load(tmp_path / "way.tum")
    np.testing.assert_array_equal(back.stamps_ns, stamps)
    np.testing.assert_allclose(back.poses, poses, atol=1e-6)


def test_tum_files_may_be_unsorted_with_comments_and_short_or_scientific_stamps(tmp_path):
    (tmp_path / "way.txt").write_text(
        "# stamp x y z qx qy qz qw\n2.5 2 0 0 0 0 0 1\n\n1 1 0 0 0 0 0 1\n"
        "1.5e9,3,0,0,0,0,0,1\n2.5 9 9 9 0 0 0 1\n-0.25 0 0 0 0 0 0 1\n"
    )
    back = trajectory_file.load(tmp_path / "way.txt")
    assert back.stamps_ns.tolist() == [-250_000_000, 1_000_000_000, 2_500_000_000, 1_500_000_000_000_000_000]
    assert back.poses[:, 0].tolist() == [0.0, 1.0, 2.0, 3.0]


def test_a_row_of_mrpt_belongs_to_the_scan_after_its_index(tmp_path):
    (tmp_path / "way_GT.txt").write_text("0 0 0 0\n1 1 0 0.1\n2 2 0 7.0\n9 9 9 9\n")
    back = trajectory_file.load(tmp_path / "way_GT.txt", np.array([100, 200, 300, 400]))
    assert back.stamps_ns.tolist() == [200, 300, 400]
    np.testing.assert_allclose(back.poses, [[0, 0, 0], [1, 0, 0.1], [2, 0, 7.0 - 2 * np.pi]])


@pytest.mark.parametrize(
    "text, stamps, reason",
    [
        ("", None, "holds no poses"),
        ("# only words\n", None, "holds no poses"),
        (
            "1 2 3\n1 2 3 4 5\n",
            None,
            "a row of poses has 8 columns (TUM: stamp x y z qx qy qz qw) or 4 (MRPT: index x y yaw), got 3, 5",
        ),
        ("1 2 3 0 0 0 0 0\n", None, "line 1: the quaternion has no direction"),
        ("1 2 3 0 0 0 0 1\n2 x 3 0 0 0 0 1\n", None, "line 2: could not convert string to float: 'x'"),
        ("1 nan 3 0 0 0 0 1\n", None, "line 1: a pose must be finite, got nan 3 0 0 0 0 1"),
        ("soon 2 3 0 0 0 0 1\n", None, "line 1: could not convert string to float: 'soon'"),
        ("0 0 0 0\n", None, "its rows have an index and no stamp, which fits a rawlog only; give a TUM file"),
        ("8 0 0 0\n", np.array([100]), "none of its 1 rows belongs to one of 1 scans"),
    ],
)
def test_other_files_are_refused_in_one_line(tmp_path, text, stamps, reason):
    path = tmp_path / "way.txt"
    path.write_text(text)
    with pytest.raises(RecordingError) as caught:
        trajectory_file.load(path, stamps)
    assert str(caught.value) == f"{path}: {reason}"


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="absent.txt: cannot be read: No such file or directory$"):
        trajectory_file.load(tmp_path / "absent.txt")
    (tmp_path / "bytes.txt").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RecordingError, match="bytes.txt: cannot be read: 'utf-8' codec"):
        trajectory_file.load(tmp_path / "bytes.txt")
