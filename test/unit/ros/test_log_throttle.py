"""A kind of line is said now and then; another kind is not held back by it."""

from __future__ import annotations

from glass_nav.ros.log_throttle import LogThrottle


def test_lines_that_differ_in_numbers_only_are_one_kind():
    log = LogThrottle()
    assert log.is_due("scan at 17.25 s: range_max must be > 0 m, got 0.0", 60.0)
    assert not log.is_due("scan at 18.35 s: range_max must be > 0 m, got 0.0", 60.0)
    assert log.is_due("scan at 18.35 s: no ranges", 60.0)


def test_after_its_period_a_line_is_due_again():
    log = LogThrottle()
    assert log.is_due("no scan", 0.0)
    assert log.is_due("no scan", 0.0)


def test_memory_stays_bounded_whatever_is_reported():
    log = LogThrottle()
    for index in range(1000):
        log.is_due("frame " + "x" * index, 60.0)
    assert len(log._said_s) <= 200
