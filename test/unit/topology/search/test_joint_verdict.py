"""What is made of a belief: where a robot stands that sees a meetpoint otherwise than the atlas has it, when it is sure."""

from __future__ import annotations

import made_atlases
import numpy as np
import pytest
from made_scans import MadeScans

from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search import belief
from glass_nav.topology.search.belief import NO_DART, Belief
from glass_nav.topology.search.expected_views import ExpectedViews
from glass_nav.topology.search.joint_verdict import JointVerdict
from glass_nav.topology.search.matching import Matcher
from glass_nav.topology.search.passed_edges import PassedEdges
from glass_nav.topology.search.search_forest import SearchForest
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState

CROSS = made_atlases.corridors(
    [(0.0, 0.0), (5.0, 0.0), (0.0, 5.0), (-5.0, 0.0), (0.0, -5.0)], [1.0] * 5, [(0, 1), (0, 2), (0, 3), (0, 4)]
)


def two_rows(here: Meetpoint) -> "tuple[JointVerdict, PassedEdges]":
    """Of two equal rows of three places, 100 m apart; from the east the second looks different. The robot is at a place."""
    row = made_atlases.corridors(
        [(x, y) for y in (0.0, 100.0) for x in (0.0, 6.0, 12.0)], [0.5, 1.3, 0.5] * 2, [(0, 1), (1, 2), (3, 4), (4, 5)]
    )
    matcher, params = Matcher(row, SearchParams().tolerances, use_angles=False), SearchParams()
    scans = MadeScans(lambda poses: np.where((poses[:, 0] > 10.0) & (poses[:, 1] > 50.0), 0.5, 1.0), np.zeros((0, 3)))
    forest, passed = SearchForest(matcher, 2), PassedEdges()
    forest.begin(here)
    passed.begin(here)
    return JointVerdict(matcher, forest, passed, params, ExpectedViews(row, scans)), passed


def believed(poses: "list[list[float]]", dart: "list[int]") -> Belief:
    even = np.zeros(2)
    share = np.array([0.6, 0.4])
    return Belief(np.zeros(3), np.array(poses), share, 0.0, even, even, even, np.ones(2), np.array(dart), 3.0, 2)


def test_a_place_without_a_node_is_told_apart_by_driving_to_where_it_looks_different() -> None:
    verdict, _ = two_rows(Meetpoint(2, 1.3, bearings_rad=np.array([np.pi, 0.0]), odom_from_base=np.zeros(3)))
    told = believed([[6.0, 0.0, 0.0], [6.5, 103.0, 0.0]], [1, NO_DART])  # the atlas has no node at the second
    estimate = verdict.at_meetpoint(told, 1)
    assert estimate.state == SearchState.SEARCHING and estimate.choice is not None and estimate.choice.rank == 1
    assert estimate.reason.endswith("2 places left; next towards the nearest difference, 1 edge away")
    again = verdict.at_meetpoint(told, 2)  # it has looked, and sees no difference
    assert again.state == SearchState.SEARCHING and again.reason.endswith("next a new edge")


def test_where_the_robot_sees_more_edges_than_the_atlas_has_it_takes_the_one_in_the_direction_of_the_difference() -> (
    None
):
    bearings_rad = np.array([np.pi, 1.5, 0.2, -1.5])
    verdict, _ = two_rows(Meetpoint(4, 1.3, bearings_rad=bearings_rad, odom_from_base=np.zeros(3)))
    estimate = verdict.at_meetpoint(believed([[6.0, 0.0, 0.0], [6.0, 100.0, 0.0]], [NO_DART, 5]), 1)
    assert estimate.choice is not None and estimate.choice.rank == 2  # east
    assert estimate.reason.endswith("next towards the nearest difference, 1 edge away")


def test_places_are_ambiguous_only_after_a_second_visit_to_where_they_differ() -> None:
    here = Meetpoint(2, 1.3, bearings_rad=np.array([np.pi, 0.0]), odom_from_base=np.zeros(3))
    verdict, passed = two_rows(here)
    passed.add(1, here, 6.0)  # both edges, to and fro
    told = believed([[6.0, 0.0, 0.0], [6.0, 100.0, 0.0]], [1, 5])
    states = [verdict.at_meetpoint(told, depth) for depth in range(1, 5)]
    assert [each.state for each in states[:-1]] == [SearchState.SEARCHING] * 3
    assert states[-1].state == SearchState.AMBIGUOUS
    assert states[-1].reason == "2 places match, and two visits to where they differ did not tell them apart"


def is_confirmed(
    scans: "tuple[float, float]",
    checked: float,
    graph: "tuple[float, float]" = (0.0, 0.0),
    driven_m: float = 0.0,
    between: "tuple[float, float]" = (0.0, 0.0),
) -> bool:
    """Of two places with such evidence by scans, by those of them that did not choose the first, and by meetpoints."""
    params, matcher = SearchParams(), Matcher(CROSS, SearchParams().tolerances, use_angles=True)
    poses = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    first, share, elsewhere = belief.places(poses, np.array(scans), np.array(graph), np.array(between))
    evidence = np.array(scans)[first], np.full(2, checked), np.array(graph)[first], np.ones(2)
    told = Belief(np.zeros(3), poses, share, elsewhere, *evidence, np.full(2, NO_DART), driven_m, 3)
    verdict = JointVerdict(matcher, SearchForest(matcher, 2), PassedEdges(), params)
    final = verdict.final(told, 0)
    return final is not None and final.state == SearchState.CONFIRMED


@pytest.mark.parametrize(
    "scans, graph, confirmed",
    [
        pytest.param((20.0, 5.0), (0.0, 0.0), True, id="by scans"),
        pytest.param((20.0, 14.5), (6.0, 0.0), True, id="by both"),
        pytest.param((20.0, 20.0), (9.0, 0.0), False, id="by meetpoints alone"),
    ],
)
def test_scans_must_have_their_part_in_the_lead_over_another_place(
    scans: "tuple[float, float]", graph: "tuple[float, float]", confirmed: bool
) -> None:
    assert is_confirmed(scans, 5.0, graph) == confirmed


def test_a_place_that_is_hardly_likelier_than_elsewhere_is_not_confirmed_by_its_lead_over_the_others() -> None:
    assert is_confirmed((7.5, 10.2), 5.0, between=(0.0, -30.0))
    assert not is_confirmed((5.5, 8.2), 5.0, between=(0.0, -30.0))


@pytest.mark.parametrize(
    "checked, driven_m, confirmed", [(1.5, 0.0, True), (0.5, 0.0, False), (-1.0, 0.9, False), (-1.0, 1.1, True)]
)
def test_the_scan_that_chose_a_place_does_not_confirm_it_alone(
    checked: float, driven_m: float, confirmed: bool
) -> None:
    assert is_confirmed((20.0, 5.0), checked, driven_m=driven_m) == confirmed
