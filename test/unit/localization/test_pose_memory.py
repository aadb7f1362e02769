"""What is kept of a pose for the next start, and what is not."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.localization import saved_pose
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.pose_memory import PoseMemory
from glass_nav.localization.saved_pose import PoseFile

DIGEST = "0123456789abcdef"
MAP_FROM_ODOM, ODOM_FROM_BASE = np.array([1.0, 2.0, 0.5]), np.array([4.0, -1.0, 1.0])


def no_beams():
    raise AssertionError("nobody looks at the beams")


def estimate(state, second=1, ahead_m=0.0):
    return Estimate(
        second * 1_000_000_000,
        se2.compose(MAP_FROM_ODOM, ODOM_FROM_BASE + [ahead_m, 0.0, 0.0]),
        np.diag([0.01, 0.02, 0.003]),
        MAP_FROM_ODOM,
        no_beams,
        np.zeros((1, 3)),
        state,
        "why",
        True,
        confidence=0.9,
    )


@pytest.fixture
def path(tmp_path):
    return tmp_path / "pose.yaml"


def kept(path, *states):
    """A memory that was given these states, a second each, and saved nothing by itself."""
    memory = PoseMemory(PoseFile(pose_file=str(path)), lambda saved: None, pytest.fail)
    for second, state in enumerate(states):
        memory.take(estimate(state, second), DIGEST, rate_hz=0.0, now_s=float(second))
    return memory


@pytest.mark.parametrize("state", ["LOST", "GLOBAL_SEARCH", "UNKNOWN"])
def test_the_pose_of_a_robot_that_gets_lost_is_kept_as_that_of_a_lost_one(path, state):
    kept(path, "LOCALIZED", "UNCERTAIN", state, state)
    saved = saved_pose.load(path)
    assert (saved.state, saved.map_digest, saved.stamp_ns) == (state, DIGEST, 1_000_000_000)  # of when it was known
    np.testing.assert_allclose(saved.map_from_base, se2.compose(MAP_FROM_ODOM, ODOM_FROM_BASE))
    np.testing.assert_allclose(saved.odom_from_base, ODOM_FROM_BASE)


def test_a_robot_that_never_knew_where_it_was_leaves_the_file_alone(path):
    path.write_text("what was there")
    kept(path, "UNKNOWN", "GLOBAL_SEARCH", "LOST").save()
    assert path.read_text() == "what was there"


def test_a_robot_that_is_lost_when_the_node_ends_saves_no_pose(path):
    kept(path, "LOCALIZED", "LOST").save()
    assert saved_pose.load(path).state == "LOST"


def test_poses_are_kept_at_the_rate_and_the_file_is_written_when_the_robot_has_moved(path):
    kept_ns = []
    memory = PoseMemory(PoseFile(pose_file=str(path)), lambda saved: kept_ns.append(saved.stamp_ns), pytest.fail)
    written_ns = []
    for second, ahead_m in [(1, 0.0), (2, 0.0), (3, 0.0), (4, 0.0), (5, 1.0), (7, 1.0), (35, 1.0)]:
        memory.take(estimate("LOCALIZED", second, ahead_m), DIGEST, rate_hz=0.5, now_s=float(second))
        written_ns.append(saved_pose.load(path).stamp_ns if path.exists() else None)
    assert [stamp_ns // 10**9 for stamp_ns in kept_ns] == [2, 4, 7, 35]
    assert [stamp_ns and stamp_ns // 10**9 for stamp_ns in written_ns] == [None, 2, 2, 2, 2, 7, 7]
    memory.take(estimate("LOCALIZED", 38, 1.0), DIGEST, rate_hz=0.5, now_s=38.0)
    assert saved_pose.load(path).stamp_ns == 38 * 10**9  # 30 s after the last one


def test_what_cannot_be_kept_is_a_line_and_no_end(tmp_path):
    def fail(saved) -> None:
        raise OSError("connection refused")

    lines = []
    folder = tmp_path / "gone"
    folder.mkdir()
    memory = PoseMemory(PoseFile(pose_file=str(folder / "pose.yaml")), fail, lines.append)
    folder.rmdir()
    memory.take(estimate("LOCALIZED"), DIGEST, rate_hz=0.0, now_s=1.0)
    memory.save()
    assert lines[0] == "the pose is not saved: no parameter server (connection refused)"
    assert lines[1].startswith(f"the pose is not saved in {folder / 'pose.yaml'}: ")


def test_without_a_file_the_pose_is_kept_all_the_same():
    kept_poses = []
    memory = PoseMemory(PoseFile(), kept_poses.append, pytest.fail)
    memory.take(estimate("LOCALIZED"), DIGEST, rate_hz=0.0, now_s=1.0)
    memory.save()
    assert [saved.state for saved in kept_poses] == ["LOCALIZED"]
