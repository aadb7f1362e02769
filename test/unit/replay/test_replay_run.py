from __future__ import annotations

import numpy as np
import pytest

from glass_nav.recording.recording import Recording, RecordingError, Step
from glass_nav.replay import replay_run
from glass_nav.sensing.scan import Scan, ScanError


def step(second):
    return Step(Scan(second * 10**9, np.ones(1), np.zeros(1), 0.0, 9.0, np.zeros(3)), np.zeros(3))


def test_a_scan_that_the_filter_refuses_is_counted():
    class Filter:
        def update(self, scan, odom_from_base):
            raise ScanError("no good", 1_000_000_000)

    with pytest.raises(RecordingError, match="^log: none of its 2 scans can be used; 2 times: no good$"):
        replay_run.run(Recording("log", 2, [step(0), step(1)]), Filter(), lambda stamp_ns: None, 0)
    with pytest.raises(RecordingError, match="^log: no scan in the part to be replayed$"):
        replay_run.run(Recording("log", 0, []), Filter(), lambda stamp_ns: None, 0)
