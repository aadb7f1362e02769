from __future__ import annotations

import numpy as np
import pytest

from glass_nav.recording.recording import Refusal, Step
from glass_nav.replay.window import Window
from glass_nav.sensing.scan import Scan


def entry(second, reason=None):
    stamp_ns = 10**12 + int(second * 10**9)
    if reason is not None:
        return Refusal(stamp_ns, reason)
    return Step(Scan(stamp_ns, np.ones(1), np.zeros(1), 0.0, 9.0, np.zeros(3)), np.zeros(3))


@pytest.mark.parametrize(
    "window, seconds",
    [
        (Window(), [0, 1, 2, 3, 4]),
        (Window(start_s=1.5), [2, 3, 4]),
        (Window(duration_s=2.0), [0, 1, 2]),
        (Window(start_s=1.0, duration_s=1.0), [1, 2]),
        (Window(every=2), [0, 2, 4]),
        (Window(max_scans=2), [0, 1]),
        (Window(start_s=1.0, every=2, max_scans=1), [1]),
    ],
)
def test_a_window_takes_its_part(window, seconds):
    taken = [round(step.scan.stamp_ns * 1e-9 - 1000) for step in window.of(map(entry, range(5)))]
    assert taken == seconds
    assert window.expected(5) >= len(seconds)


def test_refused_scans_within_the_window_stay_in_it():
    entries = [entry(0), entry(1, "bad"), entry(2), entry(3, "worse"), entry(4)]
    assert [each.reason for each in Window(start_s=2.0).of(entries) if isinstance(each, Refusal)] == ["worse"]
    assert len(list(Window().of(entries))) == 5


def test_a_part_of_the_time_has_that_part_of_the_scans():
    assert Window(duration_s=10.0).expected(1000, 100.0) == 100
    assert Window(start_s=90.0, duration_s=50.0).expected(1000, 100.0) == 100
    assert Window(start_s=200.0).expected(1000, 100.0) == 0
    assert Window(duration_s=10.0, every=3).expected(1000, 100.0) == 34
    assert Window(duration_s=10.0).expected(1000, None) == 1000  # nobody knows how long the log is
