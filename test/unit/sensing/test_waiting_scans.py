"""The newest scan with a transform wins, and every scan is counted."""

from __future__ import annotations

import pytest

from glass_nav.sensing.waiting_scans import ScanCounts, WaitingScans


def stamps(*ready: int):
    """is_ready() for scans that are their own stamps."""
    return lambda scan: scan in ready


def test_the_newest_scan_with_a_transform_wins_and_older_ones_go():
    scans: WaitingScans[int] = WaitingScans(10, limit_s=1.0)
    for stamp in (10, 20, 30, 40):
        assert scans.add(stamp, stamp, now_s=0.0)
    assert scans.take_ready(stamps(10, 20, 30), 0.1) == (30, [])
    assert (scans.counts.superseded, scans.counts.waiting, len(scans)) == (2, 1, 1)
    assert scans.take_ready(stamps(), 0.2) == (None, [])
    assert scans.take_ready(stamps(40), 0.2) == (40, [])


@pytest.mark.parametrize("stamp", [30, 29, 1])
def test_stamps_only_ascend(stamp):
    scans: WaitingScans[int] = WaitingScans(10, limit_s=1.0)
    scans.add(30, 30, now_s=0.0)
    scans.take_ready(stamps(30), 0.0)
    assert not scans.add(stamp, stamp, now_s=0.1)
    assert scans.add(31, 31, now_s=0.1)


def test_a_scan_without_a_transform_is_given_up_after_the_limit_even_if_others_flow():
    scans: WaitingScans[int] = WaitingScans(10, limit_s=1.0)
    scans.add(99, 99, now_s=0.0)  # its stamp is ahead of all transforms
    for number in range(5):
        scans.add(number, number, now_s=0.25 * number)
        assert scans.take_ready(stamps(*range(5)), 0.25 * number) == (number, [])
    scans.add(5, 5, now_s=1.25)
    assert scans.take_ready(stamps(5), 1.25) == (5, [99])
    assert scans.counts.dropped_no_transform == 1 and len(scans) == 0


def test_no_more_scans_wait_than_there_is_room_for():
    scans: WaitingScans[int] = WaitingScans(3, limit_s=100.0)
    for number in range(1000):
        scans.add(number, number, now_s=0.0)
    assert len(scans) == 3
    assert scans.counts.dropped_no_transform == 997
    assert scans.take_ready(lambda scan: True, 0.0)[0] == 999


def test_two_lidars_are_counted_together():
    counts = ScanCounts()
    front, rear = (WaitingScans(2, 1.0, counts) for _ in range(2))
    for stamp in (10, 20, 30):
        front.add(stamp, stamp, now_s=0.0)
    rear.add(10, 10, now_s=0.0)
    assert (counts.waiting, counts.dropped_no_transform) == (3, 1)
    assert front.take_ready(stamps(30), 0.1) == (30, [])
    assert (counts.waiting, counts.superseded) == (1, 1)
    rear.restart()
    assert (counts.waiting, counts.dropped_no_transform) == (0, 2)


def test_after_a_restart_earlier_stamps_are_taken():
    scans: WaitingScans[int] = WaitingScans(10, limit_s=1.0)
    scans.add(50, 50, now_s=0.0)
    scans.take_ready(stamps(50), 0.0)
    scans.add(60, 60, now_s=0.0)
    scans.restart()
    assert scans.add(1, 1, now_s=0.0)
    assert scans.take_ready(stamps(1, 60), 0.0) == (1, [])
