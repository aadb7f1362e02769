"""Mailbox: nothing is lost but what must be, and whoever waits gets an answer."""

from __future__ import annotations

import threading
import time
from typing import List

import pytest

from glass_nav.ros import mailbox
from glass_nav.ros.mailbox import Mailbox


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


def test_one_lane_can_be_emptied_alone():
    box = Mailbox(scans=10, commands=10)
    for scan in (1, 2):
        box.put("scans", scan)
    box.put("commands", "stop")
    assert box.take_now("scans") == [1, 2] and box.take_now("scans") == []
    assert box.take(0.0) == {"scans": [], "commands": ["stop"]}


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
