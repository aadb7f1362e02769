"""Does a scan show that the robot was moved without driving?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from buildings import CORRIDOR, L_ROOM, loop_drive

from glass_nav.geometry import se2
from glass_nav.localization.integrity import scan_continuity
from glass_nav.localization.integrity.scan_continuity import ScanContinuity
from glass_nav.sensing.scan import one_of_each_piece


def observed(building, poses, odom=None, changed=None, tracked=None):
    """What is said after each scan of a drive; changed: index -> the scan that is given instead; tracked: as odom."""
    odom = poses if odom is None else odom
    rng = np.random.default_rng(0)
    continuity = ScanContinuity()
    breaks = []
    for index, (pose, moved) in enumerate(zip(poses, odom)):
        scan = building.scan(pose, index, rng)
        breaks.append(
            continuity.observe(
                scan if changed is None else changed(index, scan),
                np.asarray(moved),
                (odom if tracked is None else tracked)[index],
            )
        )
    return breaks


def test_a_drive_has_no_break():
    assert not any(observed(L_ROOM, loop_drive(60)))


def test_a_robot_that_was_carried_away_is_noticed_with_the_second_scan():
    drive = loop_drive(40)
    there = [
        se2.compose(se2.compose(drive[20], [0.8, 0.7, 1.0]), se2.compose(se2.inverse(drive[20]), p)) for p in drive
    ]
    breaks = observed(L_ROOM, [*drive[:20], *there[20:]], odom=drive)
    assert breaks.index(True) == 21 and sum(breaks) == 1


def test_what_odometry_missed_and_the_tracked_pose_followed_is_no_break():
    drive = loop_drive(40)
    slipped = [se2.compose(pose, [0.5, 0.3, 0.8]) if index >= 20 else pose for index, pose in enumerate(drive)]
    assert any(observed(L_ROOM, drive, odom=slipped))
    assert not any(observed(L_ROOM, drive, odom=slipped, tracked=drive))


def test_one_scan_of_a_crowd_is_no_break():
    rng = np.random.default_rng(1)

    def crowd(index, scan):
        return replace(scan, ranges_m=rng.uniform(0.3, 0.8, len(scan))) if index == 20 else scan

    assert not any(observed(L_ROOM, loop_drive(40), changed=crowd))


@pytest.mark.parametrize("metres", [0.4, 0.7, 1.1])
def test_a_person_who_comes_near_and_stays_is_no_break(metres):
    def beside_a_person(index, scan):
        hidden = np.abs(scan.angles_rad - 0.5) < np.arctan2(0.25, metres)
        near = np.where(hidden, np.fmin(scan.ranges_m, metres), scan.ranges_m)
        return replace(scan, ranges_m=near) if 20 <= index < 30 else scan

    assert not any(observed(L_ROOM, loop_drive(40), changed=beside_a_person))


def test_along_a_plain_corridor_nothing_tells():
    poses = [np.array([x, 1.0, 0.0]) for x in np.arange(4.0, 8.0, 0.1)]
    carried = [pose + [1.0, 0.0, 0.0] if index >= 20 else pose for index, pose in enumerate(poses)]

    def near(_, scan):
        return scan.limited(-1.0, 2.5)

    assert not any(observed(CORRIDOR, carried, odom=poses, changed=near))


def test_scans_that_are_far_apart_or_empty_or_of_another_lidar_are_not_compared():
    drive = loop_drive(30)
    far = [se2.compose(pose, np.array([3.0 * index, 0.0, 0.0])) for index, pose in enumerate(drive)]
    assert not any(observed(L_ROOM, drive, odom=far))
    assert not any(observed(L_ROOM, drive, changed=lambda _, scan: replace(scan, ranges_m=np.full(len(scan), np.inf))))
    turned = [pose + [0.0, 0.0, float(index)] for index, pose in enumerate(drive)]
    assert not any(observed(L_ROOM, drive, odom=turned, changed=lambda index, scan: replace(scan, lidar=str(index))))


@pytest.mark.parametrize("bearing", [0.0, np.pi - 0.01, -np.pi + 0.01])
def test_a_post_that_was_not_there_contradicts_and_so_does_one_that_has_gone(bearing):
    before = L_ROOM.scan(np.array([2.0, 1.5, 0.3]))
    hit = np.abs(np.mod(before.angles_rad - bearing + np.pi, 2.0 * np.pi) - np.pi) < 0.2
    after = replace(before, ranges_m=np.where(hit, 0.5, before.ranges_m))
    one, other = scan_continuity.Sweep(before), scan_continuity.Sweep(after)
    share = scan_continuity.contradictions(one, other, np.zeros(3))
    assert share == scan_continuity.contradictions(other, one, np.zeros(3))
    pieces = len(one_of_each_piece(before)) + len(one_of_each_piece(after))
    assert 1 <= round(share * pieces) <= 4  # of the post, which is 0.2 m wide, however many beams met it
    assert scan_continuity.contradictions(one, one, np.zeros(3)) == 0.0
