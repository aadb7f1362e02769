"""The compiled evidence and cut of a scan against the same formulas in numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import slow_scan_report
from made_expected_ranges import expect

from glass_nav.localization.beam_classification import beam_evidence, surface_scan
from glass_nav.localization.beam_classification.surface_scan import FirstSurfaces

BEAMS = 2000


def drawn(seed):
    """First surfaces, most of them along straight walls, and beams that end at them, before, behind or nowhere."""
    rng = np.random.default_rng(seed)
    wall = np.repeat(rng.uniform(1.0, 8.0, BEAMS // 10), 10)
    range_m = np.where(rng.uniform(size=BEAMS) < 0.1, np.inf, wall + rng.normal(0.0, 0.02, BEAMS))
    axis_rad = np.repeat(rng.uniform(-1.5, 1.5, BEAMS // 10), 10) + rng.normal(0.0, 0.03, BEAMS)
    axis_rad[rng.uniform(size=BEAMS) < 0.1] = np.nan
    first = FirstSurfaces(range_m, rng.uniform(0.05, 1.0, BEAMS), axis_rad, np.zeros(BEAMS, np.int32))
    measured_m = range_m + rng.choice([-0.5, 0.0, 0.3, 2.0], BEAMS)
    measured_m[rng.uniform(size=BEAMS) < 0.3] = np.inf
    measured_m[rng.uniform(size=BEAMS) < 0.05] = np.nan
    return rng, first, measured_m, rng.integers(0, 5, BEAMS).astype(np.uint8)


@pytest.mark.parametrize("seed", range(3))
def test_the_compiled_cut_is_that_of_numpy(seed):
    rng, first, measured_m, case = drawn(seed)
    arguments = measured_m, case, first, rng.uniform(0.0, 1.0, (2, BEAMS)), rng.uniform(0.05, 0.5, BEAMS), 12.0
    found, wanted = surface_scan.of(*arguments, True), slow_scan_report.cut(*arguments)
    assert 100 < np.count_nonzero(wanted.cut) < 0.8 * BEAMS
    np.testing.assert_array_equal(found.cut, wanted.cut)
    np.testing.assert_array_equal(found.ranges_m, wanted.ranges_m)


@pytest.mark.parametrize("seed", range(3))
def test_the_compiled_evidence_is_that_of_numpy(seed):
    rng, first, measured_m, case = drawn(seed)
    far = np.full((1, BEAMS), np.inf)
    expected = replace(expect(far, far, far, far), line_m=np.tile(first.range_m, (4, 1)))
    arguments = measured_m, case, expected, rng.uniform(0.0, 1.0, BEAMS), rng.uniform(size=BEAMS) < 0.5
    found, wanted = beam_evidence.of(*arguments), slow_scan_report.evidence(*arguments)
    assert min(vars(wanted).values()) > 20.0
    for name, value in vars(wanted).items():
        assert getattr(found, name) == pytest.approx(value), name
