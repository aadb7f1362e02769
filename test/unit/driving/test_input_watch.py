"""When the robot may be driven by what was heard last, and what is missing if not."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.driving.driver_params import DriverRules
from glass_nav.driving.input_watch import InputNames, InputWatch, Odometry
from glass_nav.vocabulary import LocalizationState

RULES = DriverRules(scan_timeout_s=0.6, odometry_timeout_s=0.5, status_timeout_s=3.0)
TURNED = np.array([10.0, 5.0, np.pi / 2.0])  # map_from_odom


@pytest.fixture
def watch():
    """Everything was heard at 100 s."""
    heard = InputWatch(RULES, InputNames())
    heard.take_scan(100_000_000_000)
    heard.take_poses(Odometry(100_000_000_000, np.array([2.0, 1.0, 0.0])), TURNED)
    heard.take_localization(LocalizationState.LOCALIZED, "", 100.0)
    return heard


def test_with_everything_heard_it_may_drive_and_knows_its_pose(watch):
    assert watch.no_input(100.4, "") is None and watch.no_pose(100.4) is None
    np.testing.assert_allclose(watch.map_from_base, [9.0, 7.0, np.pi / 2.0])


def test_a_scan_is_used_once_and_an_older_one_never(watch):
    assert not watch.take_scan(100_000_000_000) and not watch.take_scan(99_000_000_000)
    assert watch.take_scan(100_100_000_000) and watch.scan_ns == 100_100_000_000


def test_it_tells_how_far_the_robot_came_between_two_poses(watch):
    assert watch.take_poses(Odometry(1, np.array([5.0, 5.0, 1.0])), None) == pytest.approx(5.0)
    assert watch.take_poses(None, None) == 0.0
    np.testing.assert_array_equal(watch.odom_from_base, [5.0, 5.0, 1.0])
    assert InputWatch(RULES, InputNames()).take_poses(Odometry(1, np.ones(3)), None) == 0.0  # the first one


def test_what_is_missing_is_reported(watch):
    assert InputWatch(RULES, InputNames()).no_input(100.0, "no scan used yet") == "no scan used yet"
    assert watch.no_input(100.7, "") == "the last scan is 0.7 s old"
    watch.take_scan(100_500_000_000)
    assert watch.no_input(100.6, "") == "no transform odom <- base_link for 0.6 s"
    watch.odometry = None
    assert watch.no_input(100.6, "") == "no transform odom <- base_link"


def test_what_keeps_the_pose_from_being_known_is_reported(watch):
    assert InputWatch(RULES, InputNames(localization="/status")).no_pose(0.0) == "no word on /status"
    assert watch.no_pose(103.1) == "the localization is silent for 3.1 s"
    watch.take_localization(LocalizationState.LOST, "", 103.0)
    assert watch.no_pose(103.1) == "the localization is LOST"
    watch.take_localization(LocalizationState.LOST, "too few inliers", 103.0)
    assert watch.no_pose(103.1) == "the localization is LOST: too few inliers"
    watch.take_localization(LocalizationState.UNCERTAIN, "", 103.0)
    assert watch.no_pose(103.1) is None
    watch.take_poses(None, None)
    assert watch.no_pose(103.1) == "no transform map <- odom" and watch.map_from_base is None


def test_surfaces_are_preferred_while_they_come_and_the_localization_says_localized(watch):
    assert not watch.prefers_surfaces(100.1)  # none came
    watch.take_surfaces(100.0)
    assert watch.prefers_surfaces(100.1)
    assert watch.prefers_surfaces(100.25)
    assert not watch.prefers_surfaces(100.35)  # late: scan stands in, before the last one used is 0.6 s old
    watch.take_surfaces(103.5)
    assert not watch.prefers_surfaces(103.5)  # the localization is silent
    watch.take_localization(LocalizationState.UNCERTAIN, "", 103.5)
    assert not watch.prefers_surfaces(103.5)


def test_it_forgets_everything(watch):
    watch.take_surfaces(100.0)
    watch.reset()
    assert watch.scan_ns == 0 and watch.odom_from_base is None and watch.map_from_base is None
    assert watch.localization is None and not watch.prefers_surfaces(100.0)
    assert not watch.localization_is_silent(200.0)
