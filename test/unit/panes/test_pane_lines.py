"""Lines through returns near their normal."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.panes.pane_lines import Line

LINE = Line(np.array([1.0, 2.0]), 0.0, -1.0, 1.0, np.zeros((2, 2)), np.arange(200))


@pytest.mark.parametrize(
    ("off_m", "least", "most"),
    [pytest.param(0.02, 0.0, 0.0, id="of a pane"), pytest.param(0.12, -1.0, -0.4, id="of leaves")],
)
def test_returns_scattered_over_the_strip_speak_against_a_line(off_m: float, least: float, most: float) -> None:
    along_m, across_m = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 200))
    assert least <= LINE.straightness(LINE.centre_m + np.stack([along_m, off_m * across_m], axis=-1)) <= most
