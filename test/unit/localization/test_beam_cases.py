"""What did each beam meet? References made by hand, one beam to think about, and a pane in a real map."""

from __future__ import annotations

import numpy as np
import pytest

from buildings import CELL_M, Building
from glass_nav.localization import beam_cases, reference_ranges
from glass_nav.localization.beam_cases import CaseVote
from glass_nav.localization.range_residuals import RangeResiduals
from glass_nav.localization.reference_ranges import ReferenceRanges
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.wall_thickness import wall_thickness

MODES = ("soft", "paper")
AT_THE_BOUNDARY = RangeResiduals(depth_share=0.0, sigma_m=0.04)
VOTE = dict(case_gate_m=0.15, case_min_share=0.5, prior_specular=0.02, prior_first_penetration=0.12,
            prior_second_penetration=0.04, prior_uncertain=0.1)
NEVER = np.inf


def references(first=NEVER, mirrored=NEVER, second=NEVER, third=NEVER, cos=1.0, thickness_m=0.05, incidence=np.nan):
    """ReferenceRanges (4, N, B); each a number, a row of beams (B,), or samples and beams (N, B)."""
    ranges = np.stack(np.broadcast_arrays(*[np.atleast_2d(np.asarray(value, float))
                                            for value in (first, mirrored, second, third)]))
    return ReferenceRanges(ranges, np.full(ranges.shape, cos), np.full(ranges.shape, thickness_m),
                           np.full((3, *ranges.shape[1:]), -1), np.full(ranges.shape[1:], incidence))


def classify(measured_m, offered, mode="soft", residuals=AT_THE_BOUNDARY, **values):
    return beam_cases.classify(np.atleast_1d(np.asarray(measured_m, float)), offered, residuals,
                               CaseVote(**{**VOTE, **values}, vote_mode=mode))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("measured_m, case", [
    pytest.param(2.0, 1, id="stopped at the first surface"),
    pytest.param(2.05, 1, id="a bit behind it"),
    pytest.param(5.0, 3, id="passed one pane"),
    pytest.param(7.97, 4, id="passed two panes"),
    pytest.param(1.0, 0, id="somebody stands before the wall"),
    pytest.param(3.5, 0, id="nothing is mapped there"),
    pytest.param(11.0, 0, id="beyond all walls"),
    pytest.param(np.inf, 0, id="no return"),
    pytest.param(-np.inf, 0, id="too near"),
    pytest.param(np.nan, 0, id="no measurement")])
def test_a_beam_met_the_surface_that_its_range_fits(mode, measured_m, case):
    cases = classify(measured_m, references(first=2.0, second=5.0, third=8.0), mode)
    assert cases.case.tolist() == [case]
    assert cases.case.dtype == np.uint8


@pytest.mark.parametrize("mode", MODES)
def test_what_was_expected_is_told_with_the_case(mode):
    cases = classify([2.03, 4.96, np.nan, 3.5], references(first=[2.0] * 4, second=[5.0] * 4), mode)
    np.testing.assert_allclose(cases.expected_m, [2.0, 5.0, np.nan, np.nan])
    np.testing.assert_allclose(cases.residual_m, [0.03, -0.04, np.nan, np.nan])
    assert np.all((cases.weight >= 0.5) & (cases.weight <= 1.0))


@pytest.mark.parametrize("mode", MODES)
def test_shares_count_all_beams(mode):
    cases = classify([2.0, 2.0, 5.0, np.nan], references(first=[2.0] * 4, second=[5.0] * 4), mode)
    assert cases.share() == {0: 0.25, 1: 0.5, 2: 0.0, 3: 0.25, 4: 0.0}


def test_without_beams_there_are_no_shares():
    assert classify(np.zeros(0), references(first=np.zeros((1, 0)))).share() == dict.fromkeys(range(5), 0.0)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("equal, winner", [
    (dict(first=3.0, mirrored=3.0, second=3.0, third=3.0), 1), (dict(mirrored=3.0, second=3.0, third=3.0), 3),
    (dict(mirrored=3.0, third=3.0), 4), (dict(mirrored=3.0), 2), (dict(first=3.0, mirrored=3.0), 1)])
def test_of_equal_references_the_plainest_explanation_wins(mode, equal, winner):
    assert classify(3.0, references(**equal), mode).case.tolist() == [winner]


# By Fresnel with n = 1.51 a pane reflects 2 R / (1 + R), R of one surface. Head-on R = 0.0413, so
# 7.9 %; at 80 degrees R = (0.543 + 0.236) / 2, so 56 %. A mirrored echo is the stronger one where
# d3 / d2 > T / R: head-on 11.6, at 80 degrees 0.78.
@pytest.mark.parametrize("incidence_deg, behind_m, mirrored_m, case", [
    pytest.param(80.0, 5.0, 3.0, 2, id="grazing: the mirror wins"),
    pytest.param(80.0, 2.2, 3.0, 0, id="grazing, but the wall behind is much nearer"),
    pytest.param(80.0, 2.5, 3.0, 2, id="grazing, and the wall behind is a little nearer"),
    pytest.param(0.0, 5.0, 3.0, 0, id="head-on: the wall behind wins"),
    pytest.param(0.0, 36.0, 3.0, 2, id="head-on, but the wall behind is twelve times as far"),
    pytest.param(0.0, 34.0, 3.0, 0, id="eleven times is not enough"),
    pytest.param(0.0, NEVER, 3.0, 2, id="head-on with nothing behind")])
def test_a_mirrored_echo_is_believed_where_fresnel_lets_it_win(incidence_deg, behind_m, mirrored_m, case):
    offered = references(first=1.0, mirrored=mirrored_m, second=behind_m, incidence=np.radians(incidence_deg))
    assert classify(mirrored_m, offered).case.tolist() == [case]


def test_the_paper_believes_every_mirrored_echo():
    offered = references(first=1.0, mirrored=3.0, second=5.0, incidence=0.0)
    assert classify(3.0, offered, "paper").case.tolist() == [2]


def test_in_the_paper_every_sample_has_one_vote():
    offered = references(first=[[2.0], [2.0], [2.0], [9.0]], second=[[5.0], [5.0], [5.0], [2.0]])
    cases = classify(2.0, offered, "paper")
    assert cases.case.tolist() == [1]
    np.testing.assert_allclose(cases.weight, 0.75)


def test_in_the_paper_a_sample_votes_for_its_nearest_reference():
    # All references lie within the gate of 0.15 m.
    assert classify(2.1, references(first=2.0, second=2.12), "paper").case.tolist() == [3]


def test_a_case_that_too_few_voted_for_is_uncertain():
    offered = references(first=[[2.0], [2.0], [2.0], [9.0]])
    assert classify(2.0, offered, "paper", case_min_share=0.7).case.tolist() == [1]
    assert classify(2.0, offered, "paper", case_min_share=0.8).case.tolist() == [0]


def test_samples_that_disagree_half_and_half_take_the_plainer_case():
    cases = classify(2.0, references(first=[[2.0], [9.0]], second=[[9.0], [2.0]]), "paper")
    assert cases.case.tolist() == [1]
    np.testing.assert_allclose(cases.weight, 0.5)


def test_a_sample_that_explains_the_scan_is_heard_more():
    """Of two samples one explains 20 beams and the other none; they disagree about the last beam."""
    measured_m = np.append(np.full(20, 3.0), 5.0)
    first = np.stack([np.append(np.full(20, 3.0), 2.0), np.append(np.full(20, 4.0), 5.0)])
    second = np.stack([np.append(np.full(20, NEVER), 5.0), np.full(21, NEVER)])
    offered = references(first=first, second=second)
    assert classify(measured_m, offered, "soft").case[-1] == 3
    assert classify(measured_m, offered, "paper").case[-1] == 1  # one vote each: the plainer case


def test_a_beam_is_not_told_to_have_met_what_the_pose_itself_does_not_see():
    offered = references(first=[[NEVER], [2.0], [2.0], [2.0]])
    for mode in MODES:
        cases = classify(2.0, offered, mode)
        assert cases.case.tolist() == [0]
        assert np.isnan(cases.expected_m).all() and np.isnan(cases.residual_m).all()


@pytest.mark.parametrize("mode", MODES)
def test_a_grazing_beam_is_measured_across_the_wall(mode):
    """0.25 m along a beam that meets the wall at 75 degrees is 0.065 m across: the gate is 0.15 m across."""
    assert classify(5.25, references(first=5.0, cos=np.cos(np.radians(75.0))), "soft").case.tolist() == [1]
    assert classify(5.25, references(first=5.0, cos=1.0), mode).case.tolist() == [0]


@pytest.mark.parametrize("mode", MODES)
def test_a_beam_ends_inside_a_wall_that_is_drawn_thick(mode):
    # Half of 0.6 m behind the boundary; seen at 60 degrees the beam needs twice as long for that.
    residuals = RangeResiduals(depth_share=0.5, sigma_m=0.04)
    head_on = classify([2.3, 2.0], references(first=[2.0, 2.0], thickness_m=0.6), mode, residuals)
    assert head_on.case.tolist() == [1, 0]
    np.testing.assert_allclose(head_on.expected_m, [2.3, np.nan])
    slanted = classify(2.6, references(first=2.0, thickness_m=0.6, cos=0.5), mode, residuals)
    np.testing.assert_allclose(slanted.expected_m, 2.6)


@pytest.mark.parametrize("mode", MODES)
def test_a_map_that_fits_badly_gets_a_wider_gate(mode):
    offered = references(first=2.0)
    assert classify(2.25, offered, mode).case.tolist() == [0]
    assert classify(2.25, offered, mode, RangeResiduals(0.0, 0.15)).case.tolist() == [1]


def test_from_another_pose_the_cases_stay_and_the_ranges_change():
    measured_m = np.array([2.0, 5.0, 3.5, 2.0])
    cases = classify(measured_m, references(first=[2.0] * 4, second=[5.0] * 4))
    moved = references(first=[2.1, 2.1, 2.1, NEVER], second=[5.2] * 4)
    far = beam_cases.as_seen_from(cases, measured_m, references(first=[2.4] * 4, second=[5.4] * 4), AT_THE_BOUNDARY,
                                  CaseVote(case_gate_m=0.15))
    assert far.case.tolist() == [0, 0, 0, 0] and np.isnan(far.expected_m).all()
    seen = beam_cases.as_seen_from(cases, measured_m, moved, AT_THE_BOUNDARY, CaseVote())
    assert seen.case.tolist() == [1, 3, 0, 0]
    np.testing.assert_allclose(seen.expected_m, [2.1, 5.2, np.nan, np.nan])
    np.testing.assert_allclose(seen.residual_m, [-0.1, -0.2, np.nan, np.nan])
    np.testing.assert_array_equal(seen.weight, cases.weight)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("thickness_cells, case", [pytest.param(1, 3, id="glass"), pytest.param(4, 3, id="thick glass"),
                                                   pytest.param(6, 0, id="too thick to be glass")])
def test_a_beam_goes_through_a_pane_but_not_through_a_thick_wall(mode, thickness_cells, case):
    """A real map: 3 m to what may be glass, and 5 m to the wall of the room behind; the beam measured 5 m."""
    walls = [(3.0 + CELL_M * cell, 0.0, 3.0 + CELL_M * cell, 4.0) for cell in range(thickness_cells)]
    grid_map = Building([(-1, 0), (5, 0), (5, 4), (-1, 4)], panes=walls).grid_map()
    scan = Scan(0, np.array([5.0, 3.0]), np.zeros(2), 0.1, 10.0, np.zeros(3))
    seen = reference_ranges.of(RayCaster(grid_map), wall_thickness(grid_map), np.array([[0.0, 2.0, 0.0]]), scan,
                               max_thickness_m=0.2, min_linearity=0.9)
    cases = classify(scan.ranges_m, seen, mode, RangeResiduals(0.5, 0.04))
    assert cases.case.tolist() == [case, 1]


@pytest.mark.parametrize("values, text", [
    (dict(vote_mode="loud"), "~vote_mode must be one of soft, paper, got 'loud'"),
    (dict(case_gate_m=0.0), "~case_gate_m must be > 0 m, got 0.0"),
    (dict(glass_max_thickness_m=-0.1), "~glass_max_thickness_m must be > 0 m, got -0.1"),
    (dict(case_min_share=1.2), "~case_min_share must be in [0, 1], got 1.2"),
    (dict(normal_min_linearity=-0.5), "~normal_min_linearity must be in [0, 1], got -0.5"),
    (dict(prior_specular=-0.01), "~prior_specular must be in [0, 1], got -0.01"),
    (dict(prior_first_penetration=float("nan")), "~prior_first_penetration must be in [0, 1], got nan"),
    (dict(prior_specular=0.5, prior_first_penetration=0.3, prior_second_penetration=0.2, prior_uncertain=0.1),
     "~prior_specular, ~prior_first_penetration, ~prior_second_penetration and ~prior_uncertain must sum to less "
     "than 1, got 1.1")])
def test_wrong_values_are_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        CaseVote(**values)
    assert str(err.value) == text


def test_the_priors_sum_to_one():
    vote = CaseVote(prior_specular=0.1, prior_first_penetration=0.2, prior_second_penetration=0.05,
                    prior_uncertain=0.25)
    assert vote.prior_diffuse == pytest.approx(0.4)
