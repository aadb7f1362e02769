from __future__ import annotations

import made_atlases

from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search.graph_verdict import GraphVerdict
from glass_nav.topology.search.matching import Matcher
from glass_nav.topology.search.search_estimate import TurnChoice
from glass_nav.topology.search.search_forest import SearchForest
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState

# A corridor with a side corridor: degree 3 at node 1 only, and no two edges are equally long.
ATLAS = made_atlases.corridors([(0, 0), (6, 0), (15, 0), (6, 4)], [0.5, 1.3, 1.1, 1.7], [(0, 1), (1, 2), (1, 3)])
PARAMS = SearchParams(max_detection_errors=0, confirm_edges=1)


def test_a_claim_waits_for_its_edges_and_begins_anew_with_the_search() -> None:
    matcher = Matcher(ATLAS, PARAMS.tolerances, False)
    forest = SearchForest(matcher, 0)
    verdict = GraphVerdict(matcher, forest, PARAMS)
    for _ in range(2):
        verdict.begin()
        forest.begin(Meetpoint(1, 0.5))
        first = verdict.estimate()
        assert (first.state, first.reason) == (
            SearchState.TENTATIVE,
            "one candidate, to be confirmed by 1 more edges",
        )
        assert first.choice == TurnChoice(0, 1)
        forest.step(Traversal(0, 6.0, 6.0), Meetpoint(3, 1.3))
        second = verdict.estimate()
        assert (second.state, second.choice) == (SearchState.CONFIRMED, None)
        assert second.reason == "the only place that matches, confirmed by 1 edges"


def test_where_nothing_matches_the_robot_is_lost() -> None:
    matcher = Matcher(ATLAS, PARAMS.tolerances, False)
    forest = SearchForest(matcher, 0)
    forest.begin(Meetpoint(5, 0.5))
    estimate = GraphVerdict(matcher, forest, PARAMS).estimate()
    assert (estimate.state, estimate.reason) == (SearchState.LOST, "no node of the atlas matches what was seen")
    assert estimate.done and estimate.choice is None
