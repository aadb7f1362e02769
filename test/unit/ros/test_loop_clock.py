"""LoopClock: what is a jump of time, and when does time begin."""

from __future__ import annotations

import pytest

rospy = pytest.importorskip("rospy")

from glass_nav.ros.loop_clock import LoopClock  # noqa: E402


def clock_reading(monkeypatch: pytest.MonkeyPatch, *times_s: float) -> LoopClock:
    """A clock whose first reading, at its start, is the first of these times."""
    readings = iter(times_s)
    monkeypatch.setattr(rospy, "get_time", lambda: next(readings))
    return LoopClock()


def test_time_that_jumps_back_is_reported_once(monkeypatch):
    clock = clock_reading(monkeypatch, 100.0, 100.1, 40.0, 40.1)
    assert [clock.tick() for _ in range(3)] == [None, "time jumped back by 60.100 s", None]
    assert clock.now_s == 40.1


@pytest.mark.parametrize("back_s", [0.1, 0.5])
def test_noise_between_machines_is_no_jump(monkeypatch, back_s):
    clock = clock_reading(monkeypatch, 100.0, 100.0 - back_s)
    assert clock.tick() is None


def test_simulated_time_begins_with_the_first_clock_message(monkeypatch):
    clock = clock_reading(monkeypatch, 0.0, 5.0, 5.1)
    assert clock.tick() is None and clock.has_begun
    assert clock.tick() is None and not clock.has_begun
