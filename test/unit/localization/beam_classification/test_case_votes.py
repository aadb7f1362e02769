"""What did each beam meet? References made by hand, one beam to think about, and a pane in a real map."""

from __future__ import annotations

import numpy as np
import pytest
from buildings import CELL_M, GLASS_ROOM, RANGE_MAX_M, Building
from made_expected_ranges import NEVER, OBLIQUE, expect

from glass_nav import _beam_vote
from glass_nav.geometry import se2
from glass_nav.localization.beam_classification import case_votes, expected_ranges
from glass_nav.localization.beam_classification.case_votes import CaseVote
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.wall_thickness import wall_thickness
from glass_nav.world.grid_map import GridMap

MODES = ("soft", "paper")
AT_THE_BOUNDARY = RangeResiduals(depth_share=0.0, sigma_m=0.04)
VOTE = dict(
    case_gate_m=0.15,
    case_min_share=0.5,
    prior_uncertain=0.1,
    prior_uncertain_behind=0.2,
    mirror_gain=2.0,
    neighbour_pull=0.0,
)


def classify(
    measured_m, offered, mode="soft", residuals=AT_THE_BOUNDARY, through=0.5, there=1.0, max_range_m=20.0, **values
):
    """through, there: chances to be seen through, and to be there if so, of both surfaces or of each."""
    measured_m = np.atleast_1d(np.asarray(measured_m, float))
    glass = np.stack(
        [np.broadcast_to(np.reshape(chance, (-1, 1)), (2, len(measured_m))) for chance in (through, there)]
    )
    return case_votes.classify(
        measured_m, offered, residuals, CaseVote(**{**VOTE, **values}, vote_mode=mode), glass, max_range_m
    )


def weight_of_a_mirror(mirrored=3.0, second=5.0, incidence_deg=60.0, **values):
    """Share of the vote that a beam gets for being mirrored whose range fits nothing else."""
    cases = classify(
        mirrored,
        expect(first=1.0, mirrored=mirrored, second=second, incidence=np.radians(incidence_deg)),
        case_min_share=0.0,
        **values,
    )
    return float(cases.weight[0]) if cases.case[0] == 2 else 1.0 - float(cases.weight[0])


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    "measured_m, case",
    [
        pytest.param(2.0, 1, id="stopped at the first surface"),
        pytest.param(2.05, 1, id="a bit behind it"),
        pytest.param(5.0, 3, id="passed one pane"),
        pytest.param(7.97, 4, id="passed two panes"),
        pytest.param(1.0, 0, id="somebody stands before the wall"),
        pytest.param(3.5, 0, id="nothing is mapped there"),
        pytest.param(11.0, 0, id="beyond all walls"),
        pytest.param(np.inf, 0, id="no return"),
        pytest.param(-np.inf, 0, id="too near"),
        pytest.param(np.nan, 0, id="no measurement"),
    ],
)
def test_a_beam_met_the_surface_that_its_range_fits(mode, measured_m, case):
    cases = classify(measured_m, expect(first=2.0, second=5.0, third=8.0), mode)
    assert cases.case.tolist() == [case]
    assert cases.case.dtype == np.uint8


@pytest.mark.parametrize("mode", MODES)
def test_what_was_expected_is_told_with_the_case(mode):
    cases = classify([2.03, 4.96, np.nan, 3.5], expect(first=[2.0] * 4, second=[5.0] * 4), mode)
    np.testing.assert_allclose(cases.expected_m, [2.0, 5.0, np.nan, np.nan])
    np.testing.assert_allclose(cases.residual_m, [0.03, -0.04, np.nan, np.nan])
    assert np.all((cases.weight >= 0.5) & (cases.weight <= 1.0))


@pytest.mark.parametrize("mode", MODES)
def test_shares_count_all_beams(mode):
    cases = classify([2.0, 2.0, 5.0, np.nan], expect(first=[2.0] * 4, second=[5.0] * 4), mode)
    assert cases.share() == {0: 0.25, 1: 0.5, 2: 0.0, 3: 0.25, 4: 0.0}


def test_without_beams_there_are_no_shares():
    assert classify(np.zeros(0), expect(first=np.zeros((1, 0)))).share() == dict.fromkeys(range(5), 0.0)


@pytest.mark.parametrize(
    "equal, winner",
    [
        (dict(first=3.0, mirrored=3.0, second=3.0, third=3.0), 1),
        (dict(mirrored=3.0, second=3.0, third=3.0), 3),
        (dict(mirrored=3.0, third=3.0), 4),
        (dict(mirrored=3.0), 2),
        (dict(first=3.0, mirrored=3.0), 1),
    ],
)
def test_in_the_paper_the_plainest_of_equal_explanations_wins(equal, winner):
    assert classify(3.0, expect(**equal), "paper").case.tolist() == [winner]


@pytest.mark.parametrize(
    "through, there, case",
    [
        pytest.param(0.01, 1.0, 1, id="a wall"),
        pytest.param(0.99, 1.0, 3, id="a pane"),
        pytest.param((0.99, 0.99), 1.0, 3, id="two panes: the one behind may be open or answer"),
        pytest.param(0.99, 0.01, 0, id="a thing that is gone"),
    ],
)
def test_of_equal_explanations_the_glass_probability_of_the_wall_decides(through, there, case):
    offered = expect(first=3.0, second=3.0)
    assert classify(3.0, offered, through=through, there=there).case.tolist() == [case]


@pytest.mark.parametrize("second, case", [(0.01, 3), (0.99, 4)])
def test_the_glass_probability_of_the_second_wall_decides_between_one_pane_and_two(second, case):
    offered = expect(first=1.0, second=3.0, third=3.0)
    assert classify(3.0, offered, through=(0.99, second)).case.tolist() == [case]


def test_a_pane_answers_head_on_and_lets_pass_what_comes_from_the_side():
    """Half a gate between a pane and the wall behind it, and a range from the middle."""
    for incidence, case in ((0.0, 1), (OBLIQUE, 3)):
        offered = expect(first=2.0, second=2.1, incidence=incidence)
        assert classify(2.05, offered, through=0.99).case.tolist() == [case]


@pytest.mark.parametrize("mode", MODES)
def test_a_wall_that_never_let_anybody_through_may_do_so_once(mode):
    assert classify(5.0, expect(first=2.0, second=5.0), mode, through=0.0).case.tolist() == [3]


def test_what_ends_behind_a_thing_that_is_gone_has_passed_no_pane():
    """It is at the second surface and yet in none of the cases 1 to 4."""
    offered = expect(first=2.0, second=5.0)
    assert classify(5.0, offered, through=0.99, there=0.02).case.tolist() == [0]
    assert classify(5.0, offered, through=0.99, there=0.98).case.tolist() == [3]
    assert classify(5.0, offered, "paper", through=0.99, there=0.02).case.tolist() == [3]  # knows no glass map


@pytest.mark.parametrize("row, measured_m", [(2, 5.0), (3, 8.0), (1, 3.0)])
def test_a_wall_is_not_believed_to_be_met_from_a_side_that_nobody_saw(row, measured_m):
    """Looking back into the building through its glass: the outer face of the wall is not on the map."""
    offered = dict(first=2.0, mirrored=3.0, second=5.0, third=8.0)
    sides = np.ones(4, bool)
    seen = classify(measured_m, expect(**offered), case_min_share=0.0)
    sides[row] = False
    unseen = classify(measured_m, expect(**offered, seen_side=sides), case_min_share=0.0)
    assert seen.case.tolist() == [row + 1]
    assert unseen.case.tolist() == [0] or unseen.weight[0] < seen.weight[0]
    sides[row], sides[0] = True, False  # the first surface stands before the lidar, whatever the mapper saw
    assert classify(2.0, expect(**offered, seen_side=sides)).case.tolist() == [1]


# -- mirrors


def test_a_mirrored_echo_is_believed_the_more_the_flatter_the_beam():
    # By Fresnel with n = 1.51 a pane reflects 8 % head-on, 56 % at 80 degrees.
    weights = [weight_of_a_mirror(incidence_deg=deg) for deg in (30.0, 50.0, 65.0, 80.0)]
    assert np.all(np.diff(weights) > 0.0)


def test_a_mirrored_echo_is_believed_the_less_the_nearer_the_wall_behind():
    weights = [weight_of_a_mirror(second=behind_m) for behind_m in (NEVER, 12.0, 5.0, 2.2, 1.3)]
    assert np.all(np.diff(weights) < 0.0)


def test_a_mirrored_echo_is_believed_the_less_the_longer_its_way():
    """Nothing behind the pane: the way alone makes the echo weak."""
    weights = [weight_of_a_mirror(mirrored=mirrored_m, second=NEVER) for mirrored_m in (2.0, 6.0, 12.0, 18.0)]
    assert np.all(np.diff(weights) < 0.0)


def test_a_lidar_that_sees_farther_sees_fainter_mirrored_echoes():
    assert weight_of_a_mirror(second=NEVER, max_range_m=30.0) > weight_of_a_mirror(second=NEVER, max_range_m=4.0)


def test_coated_panes_mirror_more_and_panes_without_gain_not_at_all():
    assert weight_of_a_mirror(mirror_gain=6.0) > weight_of_a_mirror(mirror_gain=1.0)
    offered = expect(first=1.0, mirrored=3.0, second=5.0, incidence=np.radians(80.0))
    assert classify(3.0, offered, mirror_gain=0.0).case.tolist() == [0]


@pytest.mark.parametrize(
    "incidence_deg, case", [pytest.param(20.0, 3, id="nearly head-on"), pytest.param(82.0, 2, id="grazing")]
)
def test_a_wall_behind_and_its_like_in_the_mirror_are_told_apart_by_the_incidence(incidence_deg, case):
    """Both as far away: near head-on a pane mirrors a tenth of the light, grazing it mirrors most."""
    offered = expect(first=1.0, mirrored=4.0, second=4.0, incidence=np.radians(incidence_deg))
    assert classify(4.0, offered, through=0.9).case.tolist() == [case]


@pytest.mark.parametrize("mode", MODES)
def test_where_nothing_is_mirrored_no_beam_is_said_to_be(mode):
    offered = expect(first=[1.0] * 3, second=[5.0] * 3, incidence=np.nan)
    assert classify([3.0, NEVER, 5.0], offered, mode).case.tolist() == [0, 0, 3]


def test_the_paper_believes_every_mirrored_echo():
    offered = expect(first=1.0, mirrored=3.0, second=5.0, incidence=0.0)
    assert classify(3.0, offered, "paper").case.tolist() == [2]


# -- samples


def test_in_the_paper_every_sample_has_one_vote():
    offered = expect(first=[[2.0], [2.0], [2.0], [9.0]], second=[[5.0], [5.0], [5.0], [2.0]])
    cases = classify(2.0, offered, "paper")
    assert cases.case.tolist() == [1]
    np.testing.assert_allclose(cases.weight, 0.75)


def test_in_the_paper_a_sample_votes_for_its_nearest_reference():
    # All expected ranges lie within the gate of 0.15 m.
    assert classify(2.1, expect(first=2.0, second=2.12), "paper").case.tolist() == [3]


def test_a_case_that_too_few_voted_for_is_uncertain():
    offered = expect(first=[[2.0], [2.0], [2.0], [9.0]])
    assert classify(2.0, offered, "paper", case_min_share=0.7).case.tolist() == [1]
    assert classify(2.0, offered, "paper", case_min_share=0.8).case.tolist() == [0]


def test_samples_that_disagree_half_and_half_take_the_plainer_case():
    cases = classify(2.0, expect(first=[[2.0], [9.0]], second=[[9.0], [2.0]]), "paper")
    assert cases.case.tolist() == [1]
    np.testing.assert_allclose(cases.weight, 0.5)


def test_a_sample_that_explains_the_scan_is_heard_more():
    """Of two samples one explains 20 beams and the other none; they disagree about the last beam."""
    measured_m = np.append(np.full(20, 3.0), 5.0)
    first = np.stack([np.append(np.full(20, 3.0), 2.0), np.append(np.full(20, 4.0), 5.0)])
    second = np.stack([np.append(np.full(20, NEVER), 5.0), np.full(21, NEVER)])
    offered = expect(first=first, second=second)
    assert classify(measured_m, offered, "soft").case[-1] == 3
    assert classify(measured_m, offered, "paper").case[-1] == 1  # one vote each: the plainer case


@pytest.mark.parametrize("mode", MODES)
def test_a_beam_that_passes_an_edge_at_the_pose_itself_keeps_its_case(mode):
    """What it is told to have met is what the sample sees that explains it best."""
    offered = expect(first=[[NEVER], [2.02], [1.9], [2.1]])
    cases = classify(2.0, offered, mode)
    assert cases.case.tolist() == [1]
    np.testing.assert_allclose(cases.expected_m, 2.02)
    np.testing.assert_allclose(cases.residual_m, -0.02)


@pytest.mark.parametrize("mode", MODES)
def test_what_the_pose_itself_sees_is_told_even_if_another_sample_fits_better(mode):
    cases = classify(2.0, expect(first=[[2.06], [2.0], [2.0]]), mode)
    np.testing.assert_allclose(cases.expected_m, 2.06)


def test_a_corner_that_some_samples_graze_is_no_pane():
    """Half of them see it before the wall. Not each sample decides: without the corner the wall explains the beam."""
    offered = expect(first=[[2.0], [5.0]] * 4, second=[[5.0], [NEVER]] * 4)
    cases = classify(5.0, offered, through=0.1)
    assert cases.case.tolist() == [1]
    assert cases.weight[0] > 0.85
    np.testing.assert_allclose(cases.expected_m, 5.0)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("seed", range(5))
def test_the_order_of_the_samples_does_not_matter(seed, mode):
    """But for the first of them, the pose itself."""
    rng = np.random.default_rng(seed)
    samples, beams = 12, 60
    first = rng.uniform(1.0, 3.0, (1, beams)) + rng.normal(0.0, 0.06, (samples, beams))
    second, third = first + rng.uniform(0.05, 2.0, beams), first + rng.uniform(2.0, 3.0, beams)
    mirrored = np.where(rng.random(beams) < 0.5, first + rng.uniform(0.3, 2.0, beams), NEVER)
    measured_m = np.where(rng.random(beams) < 0.5, first[0], second[0]) + rng.normal(0.0, 0.05, beams)
    order = np.append(0, 1 + rng.permutation(samples - 1))
    one = classify(measured_m, expect(first, mirrored, second, third), mode, neighbour_pull=1.0)
    other = classify(
        measured_m,
        expect(*[rows[order] for rows in (first, np.tile(mirrored, (samples, 1)), second, third)]),
        mode,
        neighbour_pull=1.0,
    )
    np.testing.assert_array_equal(one.case, other.case)
    np.testing.assert_allclose(one.weight, other.weight)
    np.testing.assert_allclose(one.expected_m, other.expected_m)


# -- neighbours


def walls_apart(measured_m):
    """Every beam may end at a wall or, 0.2 m behind it, at another."""
    return expect(first=np.full(len(measured_m), 2.0), second=np.full(len(measured_m), 2.2))


def test_a_beam_between_others_of_one_case_is_pulled_to_it():
    measured_m = np.array([2.0, 2.0, 2.0, 2.12, 2.0, 2.0, 2.0])
    assert classify(measured_m, walls_apart(measured_m)).case.tolist() == [1, 1, 1, 3, 1, 1, 1]
    assert classify(measured_m, walls_apart(measured_m), neighbour_pull=8.0).case.tolist() == [1] * 7


def test_neighbours_do_not_outvote_what_a_beam_measured():
    measured_m = np.array([2.0, 2.0, 2.0, 2.2, 2.0, 2.0, 2.0])
    assert classify(measured_m, walls_apart(measured_m), neighbour_pull=1.5).case.tolist() == [1, 1, 1, 3, 1, 1, 1]


@pytest.mark.parametrize("around", [np.full(6, np.nan), np.full(6, np.inf)])
def test_beams_without_an_answer_pull_nobody(around):
    measured_m = np.insert(around, 3, 2.12)
    alone = classify(measured_m, walls_apart(measured_m))
    pulled = classify(measured_m, walls_apart(measured_m), neighbour_pull=8.0)
    assert pulled.case.tolist() == alone.case.tolist() == [0, 0, 0, 3, 0, 0, 0]
    np.testing.assert_allclose(pulled.weight, alone.weight, atol=1e-4)


def test_beams_far_away_in_the_scan_pull_nobody():
    measured_m = np.array([2.12] + [np.nan] * 20 + [2.0] * 20)  # and the scan does not go round
    assert classify(measured_m, walls_apart(measured_m), neighbour_pull=8.0).case[0] == 3


def test_in_the_paper_neighbours_pull_nobody():
    measured_m = np.array([2.0, 2.0, 2.0, 2.12, 2.0, 2.0, 2.0])
    assert classify(measured_m, walls_apart(measured_m), "paper", neighbour_pull=8.0).case[3] == 3


@pytest.mark.parametrize("pull", [0.0, 1.5, 8.0])
def test_a_scan_read_backwards_has_the_same_cases(pull):
    rng = np.random.default_rng(3)
    measured_m = rng.choice([2.0, 2.06, 2.1, 2.14, 2.2, 3.0, np.nan], 100)
    one = classify(measured_m, walls_apart(measured_m), neighbour_pull=pull)
    other = classify(measured_m[::-1], walls_apart(measured_m), neighbour_pull=pull)
    np.testing.assert_array_equal(one.case, other.case[::-1])
    np.testing.assert_allclose(one.weight, other.weight[::-1])


# -- where beams end


@pytest.mark.parametrize("mode", MODES)
def test_a_grazing_beam_is_measured_across_the_wall(mode):
    """0.25 m along a beam that meets the wall at 75 degrees is 0.065 m across: the gate is 0.15 m across."""
    assert classify(5.25, expect(first=5.0, cos=np.cos(np.radians(75.0))), "soft").case.tolist() == [1]
    assert classify(5.25, expect(first=5.0, cos=1.0), mode).case.tolist() == [0]


@pytest.mark.parametrize("mode", MODES)
def test_a_beam_ends_inside_a_wall_that_is_drawn_thick(mode):
    # Half of 0.6 m behind the boundary; seen at 60 degrees the beam needs twice as long for that.
    residuals = RangeResiduals(depth_share=0.5, sigma_m=0.04)
    head_on = classify([2.3, 2.0], expect(first=[2.0, 2.0], thickness_m=0.6), mode, residuals)
    assert head_on.case.tolist() == [1, 0]
    np.testing.assert_allclose(head_on.expected_m, [2.3, np.nan])
    slanted = classify(2.6, expect(first=2.0, thickness_m=0.6, cos=0.5), mode, residuals)
    np.testing.assert_allclose(slanted.expected_m, 2.6)


@pytest.mark.parametrize("mode", MODES)
def test_a_map_that_fits_badly_gets_a_wider_gate(mode):
    offered = expect(first=2.0)
    assert classify(2.25, offered, mode).case.tolist() == [0]
    assert classify(2.25, offered, mode, RangeResiduals(0.0, 0.15)).case.tolist() == [1]


def test_from_another_pose_the_cases_stay_and_the_ranges_change():
    measured_m = np.array([2.0, 5.0, 3.5, 2.0])
    cases = classify(measured_m, expect(first=[2.0] * 4, second=[5.0] * 4))
    moved = expect(first=[2.1, 2.1, 2.1, 2.0], second=[5.2] * 4)
    seen = case_votes.as_seen_from(cases, measured_m, moved, AT_THE_BOUNDARY, CaseVote(case_gate_m=0.15))
    assert seen.case.tolist() == [1, 3, 0, 1]
    np.testing.assert_allclose(seen.expected_m, [2.1, 5.2, np.nan, 2.0])
    np.testing.assert_allclose(seen.residual_m, [-0.1, -0.2, np.nan, 0.0])
    np.testing.assert_array_equal(seen.weight, cases.weight)


def test_from_another_pose_a_beam_that_passes_an_edge_keeps_its_range():
    """There it would meet something a metre away, or nothing: an edge lies between the two poses."""
    measured_m = np.array([2.0, 2.0, 5.0])
    cases = classify(measured_m, expect(first=[2.03] * 3, second=[5.02] * 3))
    moved = expect(first=[3.0, NEVER, 2.0], second=[NEVER, NEVER, 7.0])
    seen = case_votes.as_seen_from(cases, measured_m, moved, AT_THE_BOUNDARY, CaseVote(case_gate_m=0.15))
    assert seen.case.tolist() == [1, 1, 3]
    np.testing.assert_allclose(seen.expected_m, [2.03, 2.03, 5.02])


def test_from_another_pose_a_beam_far_from_its_surface_is_uncertain():
    """The same wall, yet it would stand two and a half gates away from where the beam ended."""
    measured_m = np.array([2.14, 2.0])
    cases = classify(measured_m, expect(first=[2.0, 2.0]), "paper")
    assert cases.case.tolist() == [1, 1]
    seen = case_votes.as_seen_from(
        cases, measured_m, expect(first=[1.76, 1.76]), AT_THE_BOUNDARY, CaseVote(case_gate_m=0.15)
    )
    assert seen.case.tolist() == [0, 1]
    np.testing.assert_allclose(seen.expected_m, [np.nan, 1.76])
    np.testing.assert_allclose(seen.residual_m, [np.nan, 0.24])


# -- in a map


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    "thickness_cells, case",
    [
        pytest.param(1, 3, id="glass"),
        pytest.param(4, 3, id="thick glass"),
        pytest.param(6, 0, id="too thick to be glass"),
    ],
)
def test_a_beam_goes_through_a_pane_but_not_through_a_thick_wall(mode, thickness_cells, case):
    """A real map: 3 m to what may be glass, and 5 m to the wall of the room behind; the beam measured 5 m."""
    walls = [(3.0 + CELL_M * cell, 0.0, 3.0 + CELL_M * cell, 4.0) for cell in range(thickness_cells)]
    grid_map = Building([(-1, 0), (5, 0), (5, 4), (-1, 4)], panes=walls).grid_map()
    scan = Scan(0, np.array([5.0, 3.0]), np.zeros(2), 0.1, 10.0, np.zeros(3))
    seen = expected_ranges.of(
        RayCaster(grid_map),
        wall_thickness(grid_map),
        np.array([[0.0, 2.0, 0.0]]),
        scan,
        max_thickness_m=0.2,
        min_linearity=0.9,
    )
    cases = classify(scan.ranges_m, seen, mode, RangeResiduals(0.5, 0.04))
    assert cases.case.tolist() == [case, 1]


def in_a_world(grid_map, samples, angles_rad, measured_m):
    scan = Scan(0, measured_m, angles_rad, 0.05, RANGE_MAX_M, np.zeros(3))
    seen = expected_ranges.of(
        RayCaster(grid_map), wall_thickness(grid_map), samples, scan, max_thickness_m=0.2, min_linearity=0.9
    )
    return classify(
        measured_m, seen, residuals=RangeResiduals(0.5, 0.03), through=0.4, max_range_m=RANGE_MAX_M, neighbour_pull=1.5
    )


def view(seed, beams=181):
    """Samples around a place in the room of glass, and what the lidar measured there: half of it through the pane."""
    rng = np.random.default_rng(seed)
    pose = np.array([rng.uniform(1.0, 5.0), rng.uniform(0.5, 2.3), rng.uniform(-1.0, 1.0)])
    samples = np.vstack([pose, pose + rng.normal(0.0, [0.03, 0.03, 0.01], (24, 3))])
    angles_rad = np.linspace(-2.0, 2.0, beams)
    measured_m, _ = GLASS_ROOM.measured(pose, angles_rad, rng.random(beams) < 0.5)
    return samples, angles_rad, measured_m + rng.normal(0.0, 0.02, beams)


def turned(poses, quarters, width, height):
    """Poses in a world of width x height that is turned by quarters with its lower left corner kept at the origin."""
    for _ in range(quarters):
        poses = np.column_stack([height - poses[:, 1], poses[:, 0], poses[:, 2] + np.pi / 2])
        width, height = height, width
    return poses


@pytest.mark.parametrize("quarters, mirrored", [(1, False), (2, False), (3, False), (0, True), (1, True)])
@pytest.mark.parametrize("seed", range(6))
def test_a_world_turned_or_mirrored_has_the_same_cases(seed, quarters, mirrored):
    """Its cells, not its frame; but for a beam or two that goes just through a corner of a cell."""
    grid_map = GLASS_ROOM.grid_map()
    samples, angles_rad, measured_m = view(seed)
    straight = in_a_world(grid_map, samples, angles_rad, measured_m)
    in_grid = samples - grid_map.map_from_grid
    width, height = np.array(grid_map.occupancy.shape[::-1]) * grid_map.resolution_m
    occupancy = grid_map.occupancy
    if mirrored:
        occupancy, angles_rad = occupancy[::-1], -angles_rad
        in_grid = np.column_stack([in_grid[:, 0], height - in_grid[:, 1], -in_grid[:, 2]])
    world = GridMap(np.ascontiguousarray(np.rot90(occupancy, -quarters)), grid_map.resolution_m, np.zeros(3))
    other = in_a_world(world, turned(in_grid, quarters, width, height), angles_rad, measured_m)
    assert {1, 3} <= set(straight.case)
    assert np.mean(other.case == straight.case) > 0.98
    same = other.case == straight.case
    assert np.mean(np.abs(other.weight - straight.weight)[same] < 0.02) > 0.97
    assert np.nanmean(np.abs(other.expected_m - straight.expected_m)[same] < 1e-6) > 0.97


@pytest.mark.parametrize("where", [np.array([40.0, -7.0, 0.6]), np.array([-3.0, 2.0, -2.9])])
@pytest.mark.parametrize("seed", range(3))
def test_where_the_map_lies_does_not_change_the_cases(seed, where):
    grid_map = GLASS_ROOM.grid_map()
    samples, angles_rad, measured_m = view(seed)
    straight = in_a_world(grid_map, samples, angles_rad, measured_m)
    world = GridMap(grid_map.occupancy, grid_map.resolution_m, se2.compose(where, grid_map.map_from_grid))
    other = in_a_world(world, se2.compose(where, samples), angles_rad, measured_m)
    assert np.mean(other.case == straight.case) > 0.98
    np.testing.assert_allclose(np.median(np.abs(other.weight - straight.weight)), 0.0, atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_samples_that_see_the_same_corners_may_change_places(seed):
    """Every other sample sees past corners: those of one parity are exchangeable."""
    rng = np.random.default_rng(seed)
    samples, angles_rad, measured_m = view(seed)
    order = np.arange(len(samples))
    order[1::2], order[2::2] = rng.permutation(order[1::2]), rng.permutation(order[2::2])
    one = in_a_world(GLASS_ROOM.grid_map(), samples, angles_rad, measured_m)
    other = in_a_world(GLASS_ROOM.grid_map(), samples[order], angles_rad, measured_m)
    np.testing.assert_array_equal(one.case, other.case)
    np.testing.assert_allclose(one.weight, other.weight)


@pytest.mark.parametrize("seed", range(5))
def test_the_soft_vote_is_the_posterior_over_the_cases(seed):
    """Against the formula, array by array."""
    rng = np.random.default_rng(seed)
    samples, beams, uncertain, depth_share, sigma_m, gate_m, min_cos, temper = 7, 40, 0.1, 0.4, 0.05, 0.15, 0.2, 0.03
    measured_m = np.where(rng.random(beams) < 0.2, np.inf, rng.uniform(0.5, 3.0, beams))
    near_m = np.where(np.isfinite(measured_m), measured_m, 1.0) + rng.normal(0.0, 0.1, (4, samples, beams))
    range_m = np.where(rng.random(near_m.shape) < 0.3, np.inf, near_m)
    cos, thickness_m = rng.uniform(0.05, 1.0, near_m.shape), rng.integers(0, 5, near_m.shape) / 32
    prior = rng.dirichlet(np.ones(6), beams).T
    share = _beam_vote.case_votes(
        measured_m, range_m, cos, thickness_m, prior, uncertain, depth_share, sigma_m, gate_m, min_cos, temper
    )

    answered = np.isfinite(measured_m)
    steep = np.maximum(cos, min_cos)
    end_m = range_m + depth_share * thickness_m / steep
    end_m[1] += 2.0 * depth_share * thickness_m[0] * cos[0]
    across_m = (np.where(answered, measured_m, 0.0) - end_m) * steep
    widening = np.ones(range_m.shape)
    widening[1] = np.hypot(1.0, 2.0 * cos[0])  # the image of a mirror that is off is off twice as much
    density = np.exp(-0.5 * np.minimum((across_m / (sigma_m * widening)) ** 2, 100.0)) / widening
    density = np.where(np.abs(across_m) <= gate_m, density, 0.0)
    nothing = uncertain * np.exp(-0.25 * (gate_m / sigma_m) ** 2) + prior[4] * density[2] + prior[5]
    joint = np.concatenate([nothing[None], prior[:4, None] * density])
    evidence = np.exp(temper * (np.log(joint.sum(axis=0)) @ answered))
    expected = np.einsum("n,cnb->cb", evidence, joint)[:, answered]
    np.testing.assert_allclose(share[:, answered], expected / expected.sum(axis=0), rtol=1e-9)
    np.testing.assert_array_equal(share[:, ~answered].T, [[1.0, 0.0, 0.0, 0.0, 0.0]] * np.count_nonzero(~answered))


@pytest.mark.parametrize(
    "wrong, text",
    [
        (dict(measured_m=np.zeros((1, 3))), "measured must be (B,)"),
        (dict(cos=np.ones((4, 2, 2))), "ranges, cosines and thicknesses must be (4, N, B)"),
        (dict(range_m=np.ones((4, 0, 3))), "ranges, cosines and thicknesses must be (4, N, B)"),
        (dict(prior=np.ones((4, 3))), "priors must be (6, B)"),
    ],
)
def test_case_votes_of_other_shapes_are_refused(wrong, text):
    arrays = dict(
        measured_m=np.ones(3),
        range_m=np.ones((4, 2, 3)),
        cos=np.ones((4, 2, 3)),
        thickness_m=np.ones((4, 2, 3)),
        prior=np.ones((6, 3)),
    )
    with pytest.raises(ValueError) as err:
        _beam_vote.case_votes(
            **{**arrays, **wrong}, nothing=0.1, depth_share=0.5, sigma_m=0.05, gate_m=0.15, min_cos=0.2, temper=0.1
        )
    assert str(err.value) == text


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("mode", MODES)
def test_what_is_far_behind_the_end_of_a_beam_need_not_be_looked_for(mode, seed):
    grid_map = GLASS_ROOM.grid_map()
    samples, angles_rad, measured_m = view(seed)
    residuals, vote = RangeResiduals(0.5, 0.04), CaseVote(vote_mode=mode)
    scan = Scan(0, measured_m, angles_rad, 0.1, RANGE_MAX_M, np.zeros(3))
    everywhere, near = (
        expected_ranges.of(RayCaster(grid_map), wall_thickness(grid_map), samples, scan, 0.2, 0.9, behind_m)
        for behind_m in (np.inf, case_votes.reach_m(residuals, vote))
    )
    assert np.count_nonzero(np.isfinite(near.range_m)) < 0.9 * np.count_nonzero(np.isfinite(everywhere.range_m))
    glass = np.full((2, 2, len(measured_m)), 0.5)
    one, other = (
        case_votes.classify(measured_m, offered, residuals, vote, glass, RANGE_MAX_M) for offered in (everywhere, near)
    )
    np.testing.assert_array_equal(one.case, other.case)
    np.testing.assert_allclose(one.weight, other.weight, rtol=1e-9)


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(vote_mode="loud"), "~vote_mode must be one of soft, paper, got 'loud'"),
        (dict(case_gate_m=0.0), "~case_gate_m must be > 0 m, got 0.0"),
        (dict(glass_max_thickness_m=-0.1), "~glass_max_thickness_m must be > 0 m, got -0.1"),
        (dict(case_min_share=1.2), "~case_min_share must be in [0, 1], got 1.2"),
        (dict(normal_min_linearity=-0.5), "~normal_min_linearity must be in [0, 1], got -0.5"),
        (dict(prior_uncertain=0.0), "~prior_uncertain must be in (0, 1), got 0.0"),
        (dict(prior_uncertain_behind=1.0), "~prior_uncertain_behind must be in (0, 1), got 1.0"),
        (dict(mirror_gain=-1.0), "~mirror_gain must be finite and >= 0, got -1.0"),
        (dict(neighbour_pull=float("nan")), "~neighbour_pull must be finite and >= 0, got nan"),
        (dict(neighbour_pull=float("inf")), "~neighbour_pull must be finite and >= 0, got inf"),
    ],
)
def test_wrong_values_are_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        CaseVote(**values)
    assert str(err.value) == text
