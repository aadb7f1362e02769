"""A bag scan by scan: each with its odometry and mounting, or refused with a reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from opened_bags import steps

from glass_nav.geometry import se2
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, Refusal


@pytest.mark.parametrize("odometry", ["tf", "topic"])
@pytest.mark.parametrize("static_laser", [True, False])
@pytest.mark.parametrize("frame_prefix", ["", "/"])
def test_scans_come_with_the_odometry_at_their_stamps(room_bag, odometry, static_laser, frame_prefix):
    bag = room_bag(odometry=odometry, static_laser=static_laser, frame_prefix=frame_prefix)
    recording = open_log(bag.write())
    taken = steps(recording)
    true = bag.poses(bag.stamps_ns)
    assert [step.scan.stamp_ns for step in taken] == bag.stamps_ns.tolist()
    np.testing.assert_allclose([step.odom_from_base for step in taken], true - [*true[0, :2], 0.0], atol=1e-9)
    np.testing.assert_allclose(taken[3].scan.base_from_laser, bag.laser, atol=1e-9)
    assert len(recording) == bag.scans
    assert recording.name == "room.bag"
    assert recording.notes == [
        "scans from /scan",
        "odometry from tf odom <- base_link" if odometry == "tf" else "odometry from /odom",
        "ground truth from /ground_truth",
    ]


def test_odometry_is_interpolated_between_its_stamps(room_bag):
    def late(index, fields):
        return {**fields, "stamp_ns": fields["stamp_ns"] + 25_000_000}

    bag = room_bag(scan_fields=late)
    taken = steps(open_log(bag.write()))
    true = bag.poses(bag.stamps_ns + 25_000_000)
    np.testing.assert_allclose(
        [step.odom_from_base for step in taken], true - [*bag.poses(bag.stamps_ns[:1])[0, :2], 0.0], atol=2e-4
    )


@pytest.mark.parametrize("roll", [pytest.param(0.0, id="level"), pytest.param(np.pi, id="upside down")])
def test_scan_points_lie_on_the_walls_however_the_laser_is_mounted(room_bag, roll):
    bag = room_bag(laser=(0.1, -0.2, 0.7), laser_roll=roll)
    for step, true in zip(steps(open_log(bag.write())), bag.poses(bag.stamps_ns)):
        assert bag.distance_to_wall(se2.transform_points(true, step.scan.points_in_base())).max() < 1e-4


def turning(step_s):
    """Scans whose ranges are of one moment, and which say that their beams were step_s apart."""
    return lambda index, fields: {**fields, "time_increment": step_s}


@pytest.mark.parametrize("odometry", ["tf", "topic"])
def test_a_scan_that_takes_a_while_is_deskewed_by_odometry(room_bag, odometry):
    step_s = 0.001
    bag = room_bag(scan_fields=turning(step_s), odometry=odometry)
    recording = open_log(bag.write())
    assert recording.notes[-1] == "ground truth from /ground_truth"
    assert "a sweep of the lidar takes 59 ms: scans are deskewed by odometry" in recording.notes
    raw = steps(open_log(bag.path, LogOptions(deskew=False)))[5].scan
    scan = steps(recording)[5].scan
    # As the bag was written, the robot turns by 0.4 rad/s and drives at 0.5 m/s.
    beam = 50
    np.testing.assert_allclose(scan.as_measured(scan.ranges_m), raw.ranges_m, atol=1e-6)
    then = bag.poses(np.array([bag.stamps_ns[5], bag.stamps_ns[5] + 50_000_000]))
    laser = se2.compose(then[1], np.array(bag.laser))
    bearing = raw.angles_rad[beam] + laser[2]
    end = laser[:2] + raw.ranges_m[beam] * np.array([np.cos(bearing), np.sin(bearing)])
    np.testing.assert_allclose(se2.transform_points(then[0], scan.points_in_base()[beam]), end, atol=1e-3)


def test_a_time_that_no_lidar_takes_is_said_and_not_used(room_bag):
    recording = open_log(room_bag(scan_fields=turning(1.0)).write())
    assert ("scans are not deskewed: time_increment 1 s times 60 beams is 59 s, allowed 0.15 s") in recording.notes
    assert all(step.scan.origins_m is None for step in steps(recording))


def test_a_lidar_without_range_max_is_used_up_to_the_longest_range_so_far(room_bag):
    bag = room_bag(scan_fields=lambda index, fields: {**fields, "range_max": np.inf})
    recording = open_log(bag.write())
    assert recording.notes[-2].startswith("range_max of lidar 'laser' is inf m, which is no limit: the longest range")
    limits_m = [step.scan.range_max_m for step in steps(recording)]
    assert limits_m == sorted(limits_m) and limits_m[-1] < 7.0  # the room's diagonal is 6.6 m
    assert [step.scan.range_max_m for step in steps(recording)] == limits_m  # the second time as the first
    given = open_log(bag.path, LogOptions(laser_max_range=25.0))
    assert {step.scan.range_max_m for step in steps(given)} == {25.0}
    assert not [note for note in given.notes if "range_max" in note]


def test_two_lidars_on_one_topic_are_told_apart_by_frame(room_bag):
    def rear_is_late(index, fields):
        if index % 2 == 0:
            return fields
        return {**fields, "frame": "base_link", "stamp_ns": fields["stamp_ns"] - 150_000_000}

    taken = steps(open_log(room_bag(scan_fields=rear_is_late).write()))
    assert [step.scan.lidar for step in taken[:4]] == ["laser", "base_link", "laser", "base_link"]
    assert taken[3].scan.stamp_ns < taken[2].scan.stamp_ns  # each by its own clock
    np.testing.assert_allclose(taken[3].scan.base_from_laser, 0.0, atol=1e-12)


def test_a_laser_on_its_side_is_refused_scan_by_scan(room_bag):
    bag = room_bag(laser_roll=np.pi / 2)
    assert {entry.reason for entry in open_log(bag.write())} == {
        "the laser is tilted by 90 degrees; level within 20 degrees is needed, upright or upside down"
    }


def test_a_recording_can_be_read_again(room_bag):
    recording = open_log(room_bag().write())
    again = recording.in_memory()
    assert len(list(recording)) == len(list(recording)) == len(list(again)) == len(again) == 20
    assert again.ground_truth is recording.ground_truth


def test_a_compressed_bag_reads_the_same(room_bag):
    bag = room_bag(compressed=True)
    assert len(steps(open_log(bag.write()))) == bag.scans


def one_bad_scan(**changes):
    return lambda index, fields: {**fields, **changes} if index == 3 else fields


@pytest.mark.parametrize(
    "changes, reason",
    [
        ({"angle_increment": 0.0}, "angle_increment must be finite and not 0 rad, got 0.0"),
        ({"angle_min": float("nan")}, "angle_min must be finite, got nan"),
        ({"range_max": 0.0}, "range_max must be finite and > 0 m, got 0.0"),
        ({"range_min": -1.0}, "range_min must be in [0, range_max = 10.0) m, got -1.0"),
        ({"ranges": []}, "no ranges, a scan needs at least 1"),
        ({"frame": "elsewhere"}, "no transform base_link <- elsewhere"),
        ({"stamp_ns": 1_000_000_000_000 - 10**12}, "time runs backwards"),
        ({"stamp_ns": 1_000_000_000_000 + 10**11}, "no transform odom <- base_link at that time"),
    ],
)
def test_a_bad_scan_is_refused_and_the_rest_is_used(room_bag, changes, reason):
    entries = list(open_log(room_bag(scan_fields=one_bad_scan(**changes)).write()))
    assert [entry.reason for entry in entries if isinstance(entry, Refusal)] == [reason]
    assert isinstance(entries[3], Refusal)
    assert len(entries) == 20


def test_no_odometry_at_the_time_of_a_scan_refuses_it(room_bag):
    bag = room_bag(odometry="topic", scan_fields=one_bad_scan(stamp_ns=1_000_000_000_000 + 10**11))
    assert [entry.reason for entry in open_log(bag.write()) if isinstance(entry, Refusal)] == [
        "no odometry at that time"
    ]


def test_ranges_that_are_no_numbers_are_taken_as_rep_117_says(room_bag):
    def odd(index, fields):
        ranges = fields["ranges"].copy()
        ranges[:4] = np.nan, np.inf, -np.inf, 0.0
        return {**fields, "ranges": ranges}

    ranges = steps(open_log(room_bag(scan_fields=odd).write()))[0].scan.ranges_m
    np.testing.assert_array_equal(ranges[:4], [np.nan, np.inf, -np.inf, np.nan])
    assert np.isfinite(ranges[4:]).all()


def test_a_real_bag_gives_every_scan(data_dir: Path):
    recording = open_log(data_dir / "logs" / "olin_mac" / "olin_mac.bag")
    assert len(steps(recording)) == 357
    assert recording.ground_truth.covers(np.array([step.scan.stamp_ns for step in recording]), 10**6).all()
