"""The compiled vote against the same formulas in numpy, on expected ranges of all kinds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import slow_case_votes
from made_expected_ranges import expect

from glass_nav.localization.beam_classification import case_votes
from glass_nav.localization.beam_classification.behind_panes import Coatings
from glass_nav.localization.beam_classification.case_votes import CaseVote
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals

SAMPLES, BEAMS = 7, 1500
RESIDUALS = RangeResiduals(0.4, 0.05)
VOTE = CaseVote()
RANGE_MAX_M = 12.0


def drawn(seed):
    """Expected ranges (4, N, B) in which surfaces lack, coincide and lie apart, and scans that fit some of them."""
    rng = np.random.default_rng(seed)
    first = rng.uniform(0.5, 5.0, BEAMS)
    apart = rng.choice([0.1, 0.4, 3.0], (3, BEAMS))
    paths = np.cumsum(np.vstack([first, apart]), axis=0)  # first, mirrored, second, third
    paths[1:][rng.uniform(size=(3, BEAMS)) < 0.3] = np.inf
    paths[:, rng.uniform(size=BEAMS) < 0.1] = np.inf
    ranges = paths[:, None] + rng.normal(0.0, 0.05, (4, SAMPLES, BEAMS))
    expected = replace(
        expect(*ranges),
        cos_incidence=rng.uniform(0.05, 1.0, ranges.shape),
        thickness_m=rng.uniform(0.0, 0.3, ranges.shape).astype(np.float32),
        pane_incidence=np.where(rng.uniform(size=(1, BEAMS)) < 0.2, np.nan, rng.uniform(0.0, 1.5, (1, BEAMS))),
        axis_rad=np.where(rng.uniform(size=(4, BEAMS)) < 0.2, np.nan, rng.uniform(-3.0, 3.0, (4, BEAMS))),
        seen_side=rng.uniform(size=(4, BEAMS)) < 0.8,
    )
    measured_m = paths[rng.integers(4, size=BEAMS), np.arange(BEAMS)] + rng.normal(0.1, 0.1, BEAMS)
    measured_m[rng.uniform(size=BEAMS) < 0.05] = np.nan
    glass = rng.uniform(0.3, 1.0, (2, 2, BEAMS))
    unmapped_end = rng.uniform(size=BEAMS) < 0.3
    return measured_m, expected, glass, unmapped_end, Coatings(rng.normal(0.0, 1.0, 3)), rng.uniform(0.1, 1.0, BEAMS)


def same(found, wanted):
    np.testing.assert_array_equal(found.case, wanted.case)
    for name in ("expected_m", "residual_m", "weight"):
        np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), atol=1e-5, err_msg=name)


@pytest.mark.parametrize("seed", range(4))
def test_the_compiled_vote_is_that_of_numpy(seed):
    measured_m, expected, *known = drawn(seed)
    arguments = measured_m, expected, RESIDUALS, VOTE, known[0], RANGE_MAX_M, *known[1:]
    found = case_votes.classify(*arguments)
    assert set(found.case) == {0, 1, 2, 3, 4}
    same(found, slow_case_votes.classify(*arguments))


@pytest.mark.parametrize("seed", range(4))
def test_what_is_seen_from_another_pose_is_as_in_numpy(seed):
    measured_m, expected, *known = drawn(seed)
    cases = case_votes.classify(measured_m, expected, RESIDUALS, VOTE, known[0], RANGE_MAX_M, *known[1:])
    moved_m = np.random.default_rng(seed).choice([0.0, 0.1, 0.25, 0.4], expected.range_m.shape)
    elsewhere = replace(expected, range_m=expected.range_m + moved_m, cos_incidence=np.ones(expected.range_m.shape))
    arguments = cases, measured_m, elsewhere, RESIDUALS, replace(VOTE, case_gate_m=0.05)
    found = case_votes.as_seen_from(*arguments)
    lost = np.count_nonzero(found.case != cases.case)
    assert 0 < lost < np.count_nonzero(cases.case)
    same(found, slow_case_votes.as_seen_from(*arguments))
