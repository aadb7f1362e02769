"""Where in a drawn wall beams end: learnt from scans, slowly, and within limits."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.localization.beam_classification.range_residuals import RangeResiduals

MIN_M, MAX_M = 0.02, 0.3


def scans_at(depth_share, thickness_m=0.4, sigma_m=0.05, beams=200, seed=0):
    """One scan: residuals across a wall that stands at that share of its drawn thickness."""
    rng = np.random.default_rng(seed)
    return depth_share * thickness_m + rng.normal(0.0, sigma_m, beams), np.full(beams, thickness_m)


def after(residuals, scans):
    for across_m, thickness_m in scans:
        residuals = residuals.learn(across_m, thickness_m, MIN_M, MAX_M)
    return residuals


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.9])
def test_a_wall_drawn_thick_is_found_inside_what_is_drawn(share):
    residuals = after(RangeResiduals(0.5, 0.1), [scans_at(share, seed=seed) for seed in range(150)])
    assert residuals.depth_share == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize("sigma_m", [0.03, 0.1])
def test_the_spread_is_learnt_as_a_standard_deviation(sigma_m):
    residuals = after(RangeResiduals(0.3, 0.2), [scans_at(0.3, sigma_m=sigma_m, seed=seed) for seed in range(150)])
    assert residuals.sigma_m == pytest.approx(sigma_m, rel=0.1)


def test_one_scan_counts_as_one_in_twenty():
    # All beams end 0.12 m deep in a wall of 0.4 m: share 0.3. Off 0.08 m where 0.5 was expected: sigma 1.4826 x 0.08.
    residuals = RangeResiduals(0.5, 0.1).learn(np.full(50, 0.12), np.full(50, 0.4), MIN_M, MAX_M)
    assert residuals.depth_share == pytest.approx(0.95 * 0.5 + 0.05 * 0.3)
    assert residuals.sigma_m == pytest.approx(0.95 * 0.1 + 0.05 * 1.4826 * 0.08)


def test_beams_that_met_something_else_teach_nothing():
    across_m, thickness_m = scans_at(0.2)
    people = np.full(150, -2.0)
    rooms_behind = np.full(150, 3.0)
    with_others = RangeResiduals(0.5, 0.1).learn(
        np.concatenate([across_m, people, rooms_behind]), np.full(500, 0.4), MIN_M, MAX_M
    )
    assert with_others == RangeResiduals(0.5, 0.1).learn(across_m, thickness_m, MIN_M, MAX_M)


def test_a_few_beams_teach_nothing():
    before = RangeResiduals(0.5, 0.1)
    assert before.learn(np.full(19, 0.1), np.full(19, 0.4), MIN_M, MAX_M) == before
    assert before.learn(np.full(20, 0.1), np.full(20, 0.4), MIN_M, MAX_M) != before
    assert before.learn(np.zeros(0), np.zeros(0), MIN_M, MAX_M) == before


@pytest.mark.parametrize("across_m, share", [(-0.3, 0.0), (0.55, 1.0)])
def test_a_wall_is_never_outside_what_is_drawn(across_m, share):
    scan = np.full(50, across_m), np.full(50, 0.1)
    assert after(RangeResiduals(0.5, 0.1), [scan] * 300).depth_share == pytest.approx(share, abs=1e-6)


def test_the_spread_stays_within_its_limits():
    exact = np.full(50, 0.2), np.full(50, 0.4)
    assert after(RangeResiduals(0.5, 0.1), [exact] * 300).sigma_m == MIN_M
    wide = np.tile([-0.55, 0.55], 50), np.full(100, 0.01)
    assert after(RangeResiduals(0.5, 0.1), [wide] * 300).sigma_m == MAX_M


def test_a_cabinet_before_a_thin_wall_widens_nothing():
    """Three quarters of the beams that end near the wall end at it, for a long time."""
    rng = np.random.default_rng(0)
    learnt = RangeResiduals(0.5, 0.04)
    for _ in range(100):
        across_m = np.concatenate([rng.normal(0.025, 0.02, 50), rng.normal(-0.2, 0.02, 150)])
        learnt = learnt.learn(across_m, np.full(200, 0.05), MIN_M, MAX_M)
    assert learnt.depth_share == pytest.approx(0.5, abs=0.1)
    assert learnt.sigma_m == pytest.approx(0.02, abs=0.005)
