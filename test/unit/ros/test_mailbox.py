"""Mailbox: nothing is lost but what must be."""

from __future__ import annotations

import threading
import time
from typing import List

import pytest

from glass_nav.ros.mailbox import Errand, Mailbox


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


def test_an_errand_tells_the_one_who_waits_what_came_of_it():
    def fail() -> None:
        raise ValueError("no map")

    errand = Errand(fail)
    threading.Timer(0.02, errand.run).start()
    with pytest.raises(ValueError, match="no map"):
        errand.wait(10.0)
    done: List[int] = []
    errand = Errand(lambda: done.append(1))
    errand.run()
    errand.wait(0.0)
    assert done == [1]


def test_an_errand_nobody_waits_for_any_more_is_not_done():
    done: List[int] = []
    errand = Errand(lambda: done.append(1))
    with pytest.raises(TimeoutError, match="within 0.01 s"):
        errand.wait(0.01)
    errand.run()
    assert not done


def test_an_error_that_is_not_about_values_stays_with_the_run_loop():
    def broken() -> None:
        raise KeyError("a bug")

    with pytest.raises(KeyError):
        Errand(broken).run()


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
