"""What is kept of a pose for the next start, and what is not. The parameter server's part is in the rostests."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.localization import saved_pose
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.localization.localizer import BeamCases, Estimate
from glass_nav.localization.saved_pose import PoseFile
from glass_nav.ros.localization.pose_memory import PoseMemory
from glass_nav.ros.log_throttle import LogThrottle

DIGEST = "0123456789abcdef"
MAP_FROM_ODOM, ODOM_FROM_BASE = np.array([1.0, 2.0, 0.5]), np.array([4.0, -1.0, 1.0])


def estimate(state, second=1):
    none = np.zeros(0)
    return Estimate(
        second * 1_000_000_000,
        se2.compose(MAP_FROM_ODOM, ODOM_FROM_BASE),
        np.diag([0.01, 0.02, 0.003]),
        MAP_FROM_ODOM,
        BeamCases(none.astype(np.uint8), none, none, none),
        SurfaceScan(none, none.astype(bool), True),
        np.zeros((1, 3)),
        state,
        "why",
        0.9,
        True,
        confidence=0.9,
    )


@pytest.fixture
def path(tmp_path):
    return tmp_path / "pose.yaml"


def kept(path, *states):
    """A memory that was given these states, a second each, and saved nothing by itself."""
    memory = PoseMemory(PoseFile(pose_file=str(path)), LogThrottle())
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
