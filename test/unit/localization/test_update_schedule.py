"""Which scans move the particles, and which cannot be used."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.localization.localizer_params import Schedule
from glass_nav.localization.update_schedule import UpdateSchedule
from glass_nav.sensing.scan import Scan, ScanError

START = np.array([3.0, -1.0, 0.5])
RULE = Schedule(update_min_d=0.2, update_min_a=0.3)


def scan(stamp_s=1.0, lidar="front"):
    return Scan(int(stamp_s * 1e9), np.ones(3), np.zeros(3), 0.05, 10.0, np.zeros(3), lidar)


def updated(*lidars):
    schedule = UpdateSchedule()
    for lidar in lidars:
        schedule.updated(lidar, START)
    return schedule


def test_the_first_scan_is_due_and_there_is_nothing_to_move_from():
    assert UpdateSchedule().is_due("front", START, RULE)
    assert UpdateSchedule().step_to(START) is None


@pytest.mark.parametrize(
    "step, due",
    [
        pytest.param([0.0, 0.0, 0.0], False, id="stands"),
        pytest.param([0.19, 0.0, 0.29], False, id="moved too little"),
        pytest.param([0.0, 0.21, 0.0], True, id="drove"),
        pytest.param([0.0, 0.0, -0.31], True, id="turned"),
    ],
)
def test_a_scan_is_due_after_enough_distance_or_turn(step, due):
    assert updated("front").is_due("front", START + step, RULE) == due


def test_each_lidar_has_its_own_update():
    schedule = updated("front")
    assert schedule.is_due("rear", START, RULE)
    schedule.updated("rear", START)
    assert not schedule.is_due("rear", START, RULE)


@pytest.mark.parametrize("again", [UpdateSchedule.request, UpdateSchedule.restart])
def test_a_request_and_a_new_start_make_scans_due_while_the_robot_stands(again):
    schedule = updated("front", "rear")
    again(schedule)
    assert schedule.is_due("front", START, RULE) and schedule.is_due("rear", START, RULE)


def test_the_step_is_in_the_robots_frame_at_the_last_update():
    ahead = START + [np.cos(0.5), np.sin(0.5), 0.1]
    np.testing.assert_allclose(updated("front").step_to(ahead), [1.0, 0.0, 0.1], atol=1e-12)


def test_time_may_not_run_backwards_for_one_lidar_but_between_two():
    schedule = UpdateSchedule()
    schedule.admit(scan(2.0), START)
    schedule.admit(scan(1.5, "rear"), START)
    schedule.restart()
    with pytest.raises(ScanError, match=r"^scan at 1.900 s: time runs backwards, the last scan was at 2.000 s$"):
        schedule.admit(scan(1.9), START)


@pytest.mark.parametrize("odometry", [np.array([0.0, np.nan, 0.0]), np.zeros(2)])
def test_odometry_that_is_no_pose_is_refused_and_leaves_the_stamp_alone(odometry):
    schedule = UpdateSchedule()
    with pytest.raises(ScanError, match="^scan at 2.000 s: odometry must be finite x, y, yaw, got"):
        schedule.admit(scan(2.0), odometry)
    schedule.admit(scan(1.0), START)


def test_the_period_is_that_of_all_lidars_together():
    schedule = UpdateSchedule()
    periods = []
    for stamp_s, lidar in ((1.0, "front"), (1.1, "rear"), (1.2, "front"), (1.15, "rear")):
        schedule.admit(scan(stamp_s, lidar), START)
        periods.append(schedule.period_s)
    assert periods[0] is None
    assert periods[1:] == pytest.approx([0.1, 0.1, 0.0])
