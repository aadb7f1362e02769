"""Which echo comes back from a pane, by the physics of glass and by what the map knows behind it."""

from __future__ import annotations

import numpy as np
import pytest
from made_expected_ranges import NEVER, expect

from glass_nav.localization.beam_classification import behind_panes
from glass_nav.localization.beam_classification.behind_panes import UNKNOWN_COATINGS

SIGMA_M, RANGE_MAX_M = 0.02, 25.0
ALONG, ACROSS = 0.0, 0.5 * np.pi  # axis of the target's image: as of the mirror, perpendicular to it


def echoes(measured_m=6.0, unmapped_end=False, target_rad=ALONG, **offered):
    axis_rad = np.array([[0.0], [target_rad], [0.0], [0.0]])
    expected = expect(**{"first": 2.0, "mirrored": 6.0, "axis_rad": axis_rad, **offered})
    found = behind_panes.of(np.array([measured_m]), expected, SIGMA_M, RANGE_MAX_M, 2.0, np.array([unmapped_end]))
    return float(found.mirrored[0]), float(found.unmapped[0])


def test_the_flatter_a_beam_meets_the_pane_the_more_often_the_mirrored_echo_wins():
    chances = [echoes(second=6.0, incidence=np.radians(degrees))[0] for degrees in (10, 50, 65, 75, 80, 85)]
    assert chances == sorted(chances)
    assert chances[0] < 0.1 and chances[-1] > 0.8


def test_nothing_is_mirrored_where_the_mirrored_path_ends_nowhere():
    assert echoes(mirrored=NEVER, second=6.0, incidence=np.radians(80.0))[0] == 0.0


def test_where_the_map_ends_behind_the_pane_something_mostly_stands_there():
    seen, unseen = (echoes(incidence=np.radians(45.0), unmapped_end=unmapped)[0] for unmapped in (False, True))
    assert seen > 0.4 > 0.1 > unseen
    assert echoes(unmapped_end=True)[1] > 2.0 * echoes(unmapped_end=False)[1] > 0.0


def test_a_wall_that_may_go_on_behind_the_pane_explains_what_its_mirror_image_would():
    other, same_line, corner = (
        echoes(unmapped_end=True, target_rad=target_rad, incidence=np.radians(70.0))[1]
        for target_rad in (ALONG, ACROSS, np.nan)
    )
    assert same_line > 10.0 * other and corner > 10.0 * other
    away = echoes(measured_m=7.0, unmapped_end=True, target_rad=ACROSS, incidence=np.radians(70.0))[1]
    assert away == pytest.approx(echoes(measured_m=7.0, unmapped_end=True, incidence=np.radians(70.0))[1])


def test_in_front_of_a_wall_drawn_from_its_other_side_its_near_face_may_stand():
    side = np.array([True, True, False, True])
    near, far = (echoes(measured_m=z, second=9.0, seen_side=side)[1] for z in (8.7, 8.0))
    assert near == pytest.approx(2.0) and far < 0.1
    assert echoes(measured_m=8.7, second=9.0)[1] < 0.1


UNSEEN = np.array([True, True, False, True])  # the second surface is met from a side that no mapper saw


def test_a_mirrored_echo_has_to_win_over_a_wall_drawn_from_its_other_side():
    behind = {"second": 6.2, "seen_side": UNSEEN, "incidence": np.radians(78.0), "unmapped_end": True}
    chances = [
        echoes(**behind, cos=np.array([1.0, target_cos, 1.0, 1.0])[:, None, None])[0] for target_cos in (1.0, 0.5, 0.25)
    ]
    assert chances == sorted(chances, reverse=True) and chances[0] - chances[-1] > 0.1
    unknown_orientation = echoes(**behind, target_rad=np.nan)
    assert unknown_orientation[0] == pytest.approx(chances[1])
    assert unknown_orientation[1] > 3.0 * echoes(**{**behind, "seen_side": True})[1]


def test_past_the_end_of_what_is_drawn_a_wall_stands_where_the_neighbours_met_it():
    def chance_of_last(second_m, measured_m):
        expected = expect(
            np.full(3, 2.0), np.full(3, 6.0), np.array(second_m), cos=0.5, incidence=np.radians(70.0), seen_side=UNSEEN
        )
        found = behind_panes.of(np.array(measured_m), expected, SIGMA_M, RANGE_MAX_M, 2.0, np.zeros(3, bool))
        return found.mirrored[-1]

    alone = chance_of_last([NEVER, NEVER, NEVER], [6.0, 6.0, 6.0])
    assert chance_of_last([NEVER, 6.2, NEVER], [6.0, 6.0, 6.0]) < alone
    assert chance_of_last([NEVER, 6.2, NEVER], [6.0, 6.0, 5.0]) == alone  # ended elsewhere
    assert chance_of_last([6.2, NEVER, NEVER], [6.0, 6.0, 6.0]) < alone


@pytest.mark.parametrize("measured_m", [np.inf, np.nan, -np.inf, 1.5])
def test_a_beam_that_did_not_return_from_behind_says_nothing_of_what_is_there(measured_m):
    assert echoes(measured_m=measured_m)[1] == 0.0


@pytest.mark.parametrize(
    "measured_m, stronger", [pytest.param(6.0, True, id="mirrored"), pytest.param(9.0, False, id="behind")]
)
def test_how_much_panes_mirror_is_learnt_from_echoes_that_are_not_in_doubt(measured_m, stronger):
    coatings = UNKNOWN_COATINGS
    expected = expect(first=2.0, mirrored=6.0, second=9.0, incidence=np.radians(65.0))
    for _ in range(20):
        coatings = coatings.learn(np.full(1, measured_m), expected, SIGMA_M, 0.15, 2.0)
    before, after = UNKNOWN_COATINGS.frequencies(), coatings.frequencies()
    assert (after[-1] > before[-1]) == stronger
    next_pane = expect(first=2.0, mirrored=6.0, second=2.5, incidence=np.radians(65.0), cos=0.4)
    assert coatings.learn(np.full(1, measured_m), next_pane, SIGMA_M, 0.15, 2.0) is coatings
    doubtful = expect(first=2.0, mirrored=6.0, second=6.1, incidence=np.radians(65.0))
    assert coatings.learn(np.array([6.0]), doubtful, SIGMA_M, 0.15, 2.0) is coatings


@pytest.mark.parametrize(
    "measured_m, stronger", [pytest.param(6.0, True, id="mirrored"), pytest.param(9.0, False, id="behind")]
)
def test_how_much_panes_mirror_is_learnt_from_beams_that_ended_where_the_map_knows_nothing(measured_m, stronger):
    def learnt(unmapped_end, returns=1.0, scans=20):
        coatings = UNKNOWN_COATINGS
        for _ in range(scans):
            coatings = coatings.learn_from_open_ends(
                np.full(1, measured_m),
                expect(first=2.0, mirrored=6.0, incidence=np.radians(50.0)),
                SIGMA_M,
                0.15,
                RANGE_MAX_M,
                2.0,
                np.array([unmapped_end]),
                np.array([returns]),
            )
        return coatings.frequencies()

    before = UNKNOWN_COATINGS.frequencies()
    assert (learnt(True)[-1] > before[-1]) == stronger
    assert np.array_equal(learnt(False), before)
    by_a_pane = learnt(True, returns=0.01)  # which mostly returns nothing, whatever mirrors
    assert np.ptp(by_a_pane / before) < np.ptp(learnt(True) / before)
    for_long = learnt(True, scans=500)
    assert for_long.max() / for_long.min() < np.exp(2.0) + 1e-6  # it is bounded: what is there is not known
