"""A pose over a reboot: believed where time, map and odometry agree, refused in one line where not."""

from __future__ import annotations

import math
import os
from dataclasses import replace

import numpy as np
import pytest
import yaml

from glass_nav.geometry import se2
from glass_nav.localization import saved_pose
from glass_nav.localization.saved_pose import PoseFile, SavedPose, SavedPoseError

SECOND_NS = 1_000_000_000
START_NS = 1_700_000_000 * SECOND_NS
POSE, ODOM = np.array([12.0, -3.0, 2.0]), np.array([40.0, 7.0, -1.0])
SAVED = SavedPose(START_NS, POSE, np.diag([0.01, 0.02, 0.003]), ODOM, "0123456789abcdef", "LOCALIZED")
LIMITS = PoseFile(pose_file_max_age_s=3600.0, pose_file_max_speed_m_s=1.0)


def resumed(odom=ODOM, after_s=100.0, saved=SAVED, digest=SAVED.map_digest):
    return saved_pose.resumed(saved, START_NS + round(after_s * SECOND_NS), digest, odom, LIMITS)


def test_what_is_written_is_read_again(tmp_path):
    path = tmp_path / "pose.yaml"
    saved_pose.save(path, SAVED)
    read = saved_pose.load(path)
    for field in ("map_from_base", "covariance", "odom_from_base"):
        np.testing.assert_array_equal(getattr(read, field), getattr(SAVED, field))
    assert (read.stamp_ns, read.map_digest, read.state) == (SAVED.stamp_ns, SAVED.map_digest, SAVED.state)
    assert os.listdir(tmp_path) == ["pose.yaml"]  # nothing else is left behind


def test_a_write_that_fails_leaves_the_file_before(tmp_path, monkeypatch):
    path = tmp_path / "pose.yaml"
    saved_pose.save(path, SAVED)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        saved_pose.save(path, replace(SAVED, state="UNCERTAIN"))
    assert saved_pose.load(path).state == "LOCALIZED"
    assert os.listdir(tmp_path) == ["pose.yaml"]


def test_a_robot_that_stood_is_where_it_was():
    pose, covariance, why = resumed()
    np.testing.assert_allclose(pose, POSE, atol=1e-12)
    assert np.all(np.diag(covariance) >= np.diag(SAVED.covariance) + np.array([0.1, 0.1, 0.05]) ** 2)
    assert why == "100 s old; odometry says that it moved by 0.00 m since"


def test_a_robot_that_drove_on_while_nobody_looked_is_moved_on_by_odometry():
    step = np.array([3.0, 4.0, 0.7])
    pose, covariance, why = resumed(se2.compose(ODOM, step))
    np.testing.assert_allclose(pose, se2.compose(POSE, step), atol=1e-9)
    assert covariance[0, 0] >= (0.1 * 5.0) ** 2  # and it is less sure
    assert "moved by 5.00 m" in why


@pytest.mark.parametrize("since_reboot", [np.zeros(3), np.array([0.2, 0.1, -0.2])])
def test_odometry_that_began_anew_leaves_the_robot_where_it_stood(since_reboot):
    pose, _, why = resumed(since_reboot)
    np.testing.assert_allclose(pose, se2.compose(POSE, since_reboot), atol=1e-9)
    assert "odometry restarted" in why


@pytest.mark.parametrize(
    "given, text",
    [
        pytest.param(dict(after_s=3700.0), "it is 3700 s old, ~pose_file_max_age_s is 3600 s", id="too old"),
        pytest.param(dict(after_s=-60.0), "it is of 60 s after the first scan", id="from the future"),
        pytest.param(
            dict(digest="fedcba9876543210"),
            "it is of map 0123456789abcdef, the map in use is fedcba9876543210",
            id="another map",
        ),
        pytest.param(dict(saved=replace(SAVED, state="LOST")), "the robot was LOST when it was written", id="lost"),
        pytest.param(
            dict(saved=replace(SAVED, state="GLOBAL_SEARCH")),
            "the robot was GLOBAL_SEARCH when it was written",
            id="searching",
        ),
        pytest.param(
            dict(odom=se2.compose(ODOM, np.array([30.0, 0.0, 0.0])), after_s=10.0),
            "odometry is 30.00 m away from where it was 10.0 s before, more than ~pose_file_max_speed_m_s = 1 m/s "
            "allows",
            id="odometry leapt",
        ),
    ],
)
def test_what_is_not_to_be_believed_is_refused(given, text):
    with pytest.raises(SavedPoseError) as err:
        resumed(**given)
    assert str(err.value) == text


@pytest.mark.parametrize(
    "change, text",
    [
        ({"stamp_ns": "now"}, "its stamp_ns must be int, got 'now'"),
        ({"state": None}, "its state must be str, got None"),
        ({"map_from_base": [1.0, 2.0]}, "its map_from_base must be finite numbers (3,), got [1.0, 2.0]"),
        (
            {"odom_from_base": [1.0, 2.0, math.nan]},
            "its odom_from_base must be finite numbers (3,), got [1.0, 2.0, nan]",
        ),
        ({"odom_from_base": {"x": 1}}, "its odom_from_base must be finite numbers (3,), got {'x': 1}"),
        ({"covariance": [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}, "its covariance must be symmetric"),
        ({"covariance": [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}, "not negative, got [[-1.0"),
    ],
)
def test_a_file_that_somebody_changed_is_refused(tmp_path, change, text):
    path = tmp_path / "pose.yaml"
    saved_pose.save(path, SAVED)
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), **change}))
    with pytest.raises(SavedPoseError) as err:
        saved_pose.load(path)
    assert text in str(err.value) and "\n" not in str(err.value)


@pytest.mark.parametrize(
    "content, text",
    [
        (b"[1, 2", "it cannot be read"),
        (b"\xff\xfe", "it cannot be read"),
        (b"", "it must hold names and values, got NoneType"),
    ],
)
def test_a_file_that_is_none_is_refused(tmp_path, content, text):
    path = tmp_path / "pose.yaml"
    path.write_bytes(content)
    with pytest.raises(SavedPoseError, match=text):
        saved_pose.load(path)


def test_no_file_is_no_fault(tmp_path):
    with pytest.raises(FileNotFoundError):
        saved_pose.load(tmp_path / "pose.yaml")


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(pose_file="/nowhere/pose.yaml"), "~pose_file must lie in a folder that exists, got '/nowhere/pose.yaml'"),
        (dict(pose_file_max_age_s=0.0), "~pose_file_max_age_s must be > 0 and finite, got 0.0"),
        (dict(pose_file_max_speed_m_s=float("inf")), "~pose_file_max_speed_m_s must be > 0 and finite, got inf"),
    ],
)
def test_limits_that_are_none_are_refused(values, text):
    with pytest.raises(ValueError) as err:
        PoseFile(**values)
    assert str(err.value) == text


def test_the_users_home_may_be_written_short():
    assert PoseFile(pose_file="~/pose.yaml").path == PoseFile().path.home() / "pose.yaml"
