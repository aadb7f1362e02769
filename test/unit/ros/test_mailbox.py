"""Mailbox: nothing is lost but what must be, and the newest scan with a transform wins."""

from __future__ import annotations

import threading
import time
from typing import List

import pytest

from glass_nav.ros import mailbox
from glass_nav.ros.mailbox import Mailbox, ScanCounts, WaitingScans


def test_items_come_out_once_in_their_order_by_lane():
    box = Mailbox(scans=10, commands=10)
    for number in range(3):
        box.put("scans", number)
    box.put("commands", "stop")
    assert box.take(0.0) == {"scans": [0, 1, 2], "commands": ["stop"]}
    assert box.take(0.0) == {"scans": [], "commands": []}


def test_a_full_lane_loses_its_oldest_and_no_other_lane():
    box = Mailbox(scans=2, commands=2)
    box.put("commands", "stop")
    for number in range(5):
        box.put("scans", number)
    assert box.take(0.0) == {"scans": [3, 4], "commands": ["stop"]}


def test_take_waits_for_an_item_of_another_thread():
    box = Mailbox(scans=1)
    threading.Timer(0.05, box.put, ("scans", "late")).start()
    assert box.take(10.0) == {"scans": ["late"]}


def run_next(box: Mailbox) -> None:
    """As a run loop does."""
    for work in box.take(10.0)["commands"]:
        work()


def test_the_caller_gets_what_the_work_returned_or_refused():
    def fail() -> None:
        raise ValueError("no map")

    box = Mailbox(commands=10)
    threading.Timer(0.02, run_next, (box,)).start()
    with pytest.raises(ValueError, match="no map"):
        mailbox.outcome(box.submit("commands", fail), 10.0)
    future = box.submit("commands", lambda: "done")
    run_next(box)
    assert mailbox.outcome(future, 0.0) == "done"


def test_work_that_nobody_waits_for_any_more_is_not_done():
    done: List[int] = []
    box = Mailbox(commands=10)
    future = box.submit("commands", lambda: done.append(1))
    with pytest.raises(TimeoutError, match="within 0.01 s"):
        mailbox.outcome(future, 0.01)
    run_next(box)
    assert not done


def test_an_error_that_is_not_about_values_also_ends_the_run_loop():
    def broken() -> None:
        raise KeyError("a bug")

    box = Mailbox(commands=10)
    future = box.submit("commands", broken)
    with pytest.raises(KeyError):
        run_next(box)
    with pytest.raises(KeyError):
        mailbox.outcome(future, 0.0)


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


def test_one_lane_can_be_emptied_alone():
    box = Mailbox(scans=10, commands=10)
    for scan in (1, 2):
        box.put("scans", scan)
    box.put("commands", "stop")
    assert box.take_now("scans") == [1, 2] and box.take_now("scans") == []
    assert box.take(0.0) == {"scans": [], "commands": ["stop"]}


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


def test_a_flood_does_not_slow_down_the_one_who_takes():
    box = Mailbox(scans=100, commands=10)
    stop = threading.Event()

    def flood() -> None:
        while not stop.is_set():
            box.put("scans", 0)

    thread = threading.Thread(target=flood)
    thread.start()
    try:
        box.put("commands", "one")
        started = time.monotonic()
        assert box.take(1.0)["commands"] == ["one"]
        assert time.monotonic() - started < 5.0
    finally:
        stop.set()
        thread.join()
