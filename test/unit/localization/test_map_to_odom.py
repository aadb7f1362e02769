"""When map -> odom goes out: at once, once, never back, and never changed after the fact."""

from __future__ import annotations

import numpy as np

from glass_nav.localization.map_to_odom import MapToOdom

MS = 1_000_000
ONE, OTHER = np.array([1.0, 2.0, 0.1]), np.array([1.1, 2.0, 0.1])


def test_before_the_first_correction_nothing_is_sent():
    assert MapToOdom().arrived(100 * MS, 100 * MS, 50 * MS) is None


def test_a_scan_that_arrives_sends_the_last_correction_ahead_of_its_stamp():
    sender = MapToOdom()
    first = sender.corrected(100 * MS, ONE, 80 * MS)
    assert first is not None and (first.stamp_ns, first.map_from_odom.tolist()) == (180 * MS, ONE.tolist())
    again = sender.arrived(150 * MS, 151 * MS, 80 * MS)
    assert again is not None and (again.stamp_ns, again.map_from_odom.tolist()) == (230 * MS, ONE.tolist())


def test_the_correction_holds_from_the_time_up_to_which_tf_was_sent():
    sender = MapToOdom()
    sender.corrected(100 * MS, ONE, 50 * MS)
    sent = sender.arrived(200 * MS, 201 * MS, 50 * MS)
    corrected = sender.corrected(200 * MS, OTHER, 50 * MS)
    assert corrected is not None and corrected.stamp_ns == sent.stamp_ns + 1_000
    assert sender.arrived(300 * MS, 301 * MS, 50 * MS).map_from_odom.tolist() == OTHER.tolist()


def test_what_was_sent_when_the_scan_came_is_not_sent_again():
    sender = MapToOdom()
    sender.corrected(100 * MS, ONE, 50 * MS)
    sender.arrived(200 * MS, 201 * MS, 50 * MS)
    assert sender.corrected(200 * MS, ONE, 50 * MS) is None


def test_a_scan_of_a_wrong_clock_or_of_the_past_sends_nothing():
    sender = MapToOdom()
    sender.corrected(100 * MS, ONE, 50 * MS)
    assert sender.arrived(100 * MS, 200 * MS, 50 * MS) is None
    assert sender.arrived(90 * MS, 200 * MS, 50 * MS) is None
    assert sender.arrived(900 * MS, 200 * MS, 50 * MS) is None
    assert sender.arrived(0, 200 * MS, 50 * MS) is None


def test_stamps_only_ascend_when_a_later_correction_is_of_an_older_scan_or_the_tolerance_shrinks():
    sender = MapToOdom()
    stamps = [
        sender.corrected(100 * MS, ONE, 50 * MS),
        sender.arrived(200 * MS, 200 * MS, 50 * MS),
        sender.corrected(150 * MS, OTHER, 50 * MS),
        sender.corrected(210 * MS, ONE, 0),
    ]
    assert np.all(np.diff([each.stamp_ns for each in stamps]) > 0)


def sent_to(sender, late_ms, count=60, period_ms=100, tolerance_ms=100):
    """Whether tf had an answer all the time, for each of the scans that arrive so late."""
    sender.corrected(0, ONE, tolerance_ms * MS)
    answered, until_ns = [], tolerance_ms * MS
    for number in range(1, count):
        scan_ns = number * period_ms * MS
        now_ns = scan_ns + late_ms(number) * MS
        answered.append(now_ns <= until_ns)
        until_ns = sender.arrived(scan_ns, now_ns, tolerance_ms * MS).stamp_ns
        assert until_ns >= scan_ns + tolerance_ms * MS
    return answered, until_ns - scan_ns


def test_where_scans_arrive_late_transforms_reach_further():
    """On a busy machine: without it tf would have no answer before any of the scans."""
    answered, _ = sent_to(MapToOdom(), lambda number: 40 + 30 * (number % 3))
    assert sum(answered[3:]) >= 0.95 * len(answered[3:])


def test_a_slow_lidar_leaves_no_gap_either():
    answered, _ = sent_to(MapToOdom(), lambda _: 5, period_ms=200)
    assert all(answered[3:])


def test_scans_in_time_leave_the_tolerance_as_it_is():
    assert sent_to(MapToOdom(), lambda _: 10, period_ms=50)[1] == 100 * MS


def test_where_the_tolerance_ends_as_the_next_scan_arrives_some_time_is_left_for_listeners():
    """Ten scans a second and a tolerance of 0.1 s, as most robots have them."""
    sender = MapToOdom()
    sent_to(sender, lambda _: 1)
    for scan_ns in range(6000 * MS, 100_000 * MS, 100 * MS):
        left_ns = sender.arrived(scan_ns, scan_ns + MS, 100 * MS).stamp_ns - (scan_ns + 101 * MS)
        assert 20 * MS <= left_ns <= 55 * MS


def test_a_pause_of_the_scans_is_no_reason_to_reach_further():
    sender = MapToOdom()
    sender.corrected(100 * MS, ONE, 50 * MS)
    assert sender.arrived(5000 * MS, 5001 * MS, 50 * MS).stamp_ns == 5050 * MS


def test_a_busy_machine_is_forgotten():
    sender = MapToOdom()
    sent_to(sender, lambda number: 80 if number < 10 else 2, count=3000)
    assert sender.arrived(300_000 * MS, 300_001 * MS, 100 * MS).stamp_ns < 300_155 * MS


def test_stamps_differ_also_as_seconds_in_a_double():
    """As Python's tf2 takes them: it drops a transform whose stamp it has already."""
    sender, now_ns = MapToOdom(), 1_795_000_000_123_456_789
    sent = [
        sender.corrected(now_ns, ONE, 100 * MS),
        sender.arrived(now_ns + 100 * MS, now_ns + 100 * MS, 100 * MS),
        sender.corrected(now_ns + 100 * MS, OTHER, 100 * MS),
    ]
    assert len({each.stamp_ns * 1e-9 for each in sent}) == len(sent)


def test_starting_over_forgets_the_pose_and_sends_no_stamp_twice():
    sender = MapToOdom()
    sender.corrected(100 * MS, ONE, 50 * MS)
    sender.start_over()
    assert sender.arrived(200 * MS, 200 * MS, 50 * MS) is None
    assert sender.corrected(100 * MS, OTHER, 50 * MS).stamp_ns == 150 * MS + 1_000


def test_after_the_clock_was_set_back_stamps_are_those_of_the_scans_again():
    sender = MapToOdom()
    sender.corrected(9000 * MS, ONE, 50 * MS)
    sender.start_over()
    assert sender.corrected(100 * MS, OTHER, 50 * MS).stamp_ns == 150 * MS
    assert sender.arrived(120 * MS, 120 * MS, 50 * MS).stamp_ns == 170 * MS
