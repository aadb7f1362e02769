"""The drive over the bridge: both localizers see the same scans, and are measured alike."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.demo import bridge_demo
from glass_nav.demo.bridge_demo import FIELD, OURS, Tracked


@pytest.mark.long_run
def test_both_localizers_follow_the_same_drive() -> None:
    tracked = bridge_demo.drive(seed=1, max_scans=4)
    assert list(tracked) == [OURS, FIELD]
    for name, each in tracked.items():
        assert each.position_m.shape == each.yaw_rad.shape == (4,)
        assert each.position_m[-1] < 0.1, name  # where the bridge has not begun, both are right


def test_a_row_has_a_figure_under_each_word_of_the_header() -> None:
    row = Tracked(np.array([0.0, 0.0, 0.0, 2.0]), np.radians([0.0, 1.0, 1.0, 2.0])).row
    assert row.split() == ["0.500", "1.700", "2.000", "1.00", "25", "%"]
    assert len(row) == len(bridge_demo.HEADER)
