"""The forest against the document's words, and what it makes of a detector that errs."""

from __future__ import annotations

import made_atlases
import numpy as np
import pytest
from literal_forest import LiteralForest, Observed

from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import Meetpoint, ObservationError, Traversal
from glass_nav.topology.search.matching import Matcher, Tolerances
from glass_nav.topology.search.search_forest import SearchForest

LIMITS = Tolerances()
SYSTEMS = 500


def seen_from(atlas: Atlas, dart: int, rank: int, rng: np.random.Generator) -> "tuple[int, Observed]":
    """Where a turn leads, and what a robot measures there; now and then too wrong to match."""
    departure = int(atlas.clockwise(np.array(dart), np.array(rank)))
    node, edge = int(atlas.darts.node[departure ^ 1]), departure // 2
    spread = rng.choice([1.0, 8.0], p=[0.85, 0.15])
    length = float(atlas.edges.length_m[edge] + spread * rng.normal(0.0, 0.1))
    chord = float(abs(atlas.edges.chord_m[edge] + spread * rng.normal(0.0, 0.1)))
    r = float(abs(atlas.nodes.r_m[node] + spread * rng.normal(0.0, 0.05)) + 1e-3)
    return departure ^ 1, Observed(len(atlas.rings[node]), r, rank, max(length, 0.01), chord)


@pytest.mark.parametrize("block", range(10))
def test_the_same_candidates_are_active_as_in_the_forest_of_the_document(block: int) -> None:
    several, deepest = 0, 0
    for seed in range(block * SYSTEMS // 10, (block + 1) * SYSTEMS // 10):
        rng = np.random.default_rng(seed)
        atlas = made_atlases.rotation_system(rng)
        literal = LiteralForest(atlas, LIMITS.z, LIMITS.r_sigma_m, LIMITS.length_sigma_m, LIMITS.length_sigma_share)
        forest = SearchForest(Matcher(atlas, LIMITS, use_angles=False), max_errors=0)
        dart = int(rng.integers(len(atlas.darts)))
        node = int(atlas.darts.node[dart])
        first = Observed(len(atlas.rings[node]), float(atlas.nodes.r_m[node]))
        literal.begin(first)
        forest.begin(Meetpoint(first.degree, first.r_m))
        assert set(atlas.darts.node[forest.candidates()[0]].tolist()) == literal.active_nodes()
        degree = first.degree
        for depth in range(1, 9):
            rank = int(rng.integers(degree))
            dart, seen = seen_from(atlas, dart, rank, rng)
            literal.step(seen)
            forest.step(Traversal(rank, seen.length_m, seen.chord_m), Meetpoint(seen.degree, seen.r_m))
            assert forest.candidates()[0].tolist() == literal.active_arrivals(), f"system {seed}, depth {depth}"
            degree = seen.degree
            several += len(literal.active_arrivals()) > 1
            deepest = max(deepest, depth if literal.active_arrivals() else 0)
            if not literal.active_arrivals():
                break
    assert several > 15 and deepest == 8  # the systems are alike enough to say something


def corridor() -> Atlas:
    """Places 0 - 1 - 2 - 3 in a row with a side corridor at 1 and at 2, no two lengths or widths alike.

          4      5
          |      |
    0 --- 1 ---- 2 -------- 3
    """
    return made_atlases.corridors(
        [(0, 0), (6, 0), (14, 0), (26, 0), (6, 4), (14, 5)],
        [0.9, 1.3, 1.7, 0.5, 1.4, 1.9],
        [(0, 1), (1, 2), (2, 3), (1, 4), (2, 5)],
    )


def forest_of(atlas: Atlas, max_errors: int = 2) -> SearchForest:
    return SearchForest(Matcher(atlas, LIMITS, use_angles=True), max_errors)


def test_a_missed_meetpoint_joins_two_edges() -> None:
    forest = forest_of(corridor())
    forest.begin(Meetpoint(1, 0.9))  # at 0
    forest.step(Traversal(0, 14.0, 14.0), Meetpoint(3, 1.7))  # past 1 to 2
    dart, errors = forest.candidates()
    assert (dart.tolist(), errors.tolist()) == ([3], [1])  # edge 1 leads back from 2
    assert forest.path(3) == [(0, 0, False), (1, 3, False)]


def test_two_missed_meetpoints_join_three_edges() -> None:
    forest = forest_of(corridor())
    forest.begin(Meetpoint(1, 0.9))
    forest.step(Traversal(0, 26.0, 26.0), Meetpoint(1, 0.5))  # past 1 and 2 to 3
    assert [part.tolist() for part in forest.candidates()] == [[5], [2]]


def test_no_more_than_two_errors_are_forgiven() -> None:
    forest = forest_of(corridor())
    forest.begin(Meetpoint(1, 0.9))
    forest.step(Traversal(0, 14.0, 14.0), Meetpoint(3, 1.7))
    forest.step(Traversal(2, 3.0, 3.0), Meetpoint(3, 2.5))
    forest.step(Traversal(1, 3.0, 3.0), Meetpoint(3, 2.5))
    assert not len(forest.candidates()[0]) and not forest.between_meetpoints()


def test_a_meetpoint_that_is_none_splits_an_edge() -> None:
    forest = forest_of(corridor())
    forest.begin(Meetpoint(1, 0.5))  # at 3
    forest.step(Traversal(0, 5.0, 5.0), Meetpoint(3, 2.5))  # on the way to 2: nothing is like that
    assert not len(forest.candidates()[0]) and forest.between_meetpoints()
    forest.step(Traversal(1, 7.0, 7.0), Meetpoint(3, 1.7))
    assert [part.tolist() for part in forest.candidates()] == [[4], [1]]


def test_after_a_dead_end_that_was_none_the_robot_is_back_where_it_came_from() -> None:
    forest = forest_of(corridor())
    forest.begin(Meetpoint(3, 1.3))  # at 1; its darts are 1, 2 and 6
    forest.step(Traversal(1, 4.0, 4.0), Meetpoint(1, 2.5))  # shut
    assert not len(forest.candidates()[0]) and forest.between_meetpoints()
    forest.step(Traversal(0, 4.1, 4.1), Meetpoint(3, 1.3))
    dart, errors = forest.candidates()
    assert {1, 2} <= set(dart.tolist())  # it left by 1 or 2, which are longer than 4 m, and came back by it
    assert errors.tolist() == [1] * len(dart)


def test_a_search_that_began_at_no_meetpoint_begins_again_at_the_next() -> None:
    forest = forest_of(corridor())
    forest.begin(Meetpoint(4, 2.5))  # nothing like that
    assert not len(forest.candidates()[0]) and forest.between_meetpoints()
    forest.step(Traversal(2, 5.0, 5.0), Meetpoint(3, 1.7))  # on the way to 2, from 1 or from 3
    dart, errors = forest.candidates()
    assert sorted(dart.tolist()) == [3, 4, 8] and errors.tolist() == [1, 1, 1]


@pytest.mark.parametrize("seed", range(30))
def test_errors_of_the_detector_never_cost_the_truth(seed: int) -> None:
    """Property: with up to two joined or split edges the truth stays, once errors are considered."""
    from glass_nav.topology.search.atlas_robot import AtlasRobot, Surroundings, TrialParams

    rng = np.random.default_rng(seed)
    atlas = made_atlases.voronoi(60, seed)
    exact = TrialParams(noise_limit=1.0, missed=0.1, spurious=0.1)
    robot = AtlasRobot(Surroundings.of(atlas), exact, rng)
    forest = forest_of(atlas)
    here = robot.wake_up()
    forest.begin(here)
    for _ in range(12):
        traversal, here = robot.drive(int(rng.integers(1, here.degree)) if here.degree > 1 else 0)
        forest.step(traversal, here)
        if robot.detection_errors > 2:
            break
        dart, _ = forest.candidates()
        if forest.errors >= robot.detection_errors and not robot.on_edge:
            assert robot.dart in dart


def test_a_turn_that_no_dart_has_is_refused_in_one_line_and_changes_nothing() -> None:
    forest = forest_of(corridor())
    forest.begin(Meetpoint(3, 1.3))
    before = forest.candidates()[0].tolist()
    with pytest.raises(ObservationError) as refused:
        forest.step(Traversal(3, 8.0, 8.0), Meetpoint(3, 1.7))
    assert str(refused.value) == "turn of rank 3: the meetpoint it left has degree 3, allowed 0 to 2"
    assert forest.depth == 0 and forest.candidates()[0].tolist() == before


def test_every_step_of_a_path_leads_to_the_next() -> None:
    atlas = corridor()
    forest = forest_of(atlas)
    forest.begin(Meetpoint(1, 0.9))
    forest.step(Traversal(0, 6.0, 6.0), Meetpoint(3, 1.3))
    forest.step(Traversal(2, 8.0, 8.0), Meetpoint(3, 1.7))  # the side corridor is to the left, the way on to the right
    assert forest.path(3) == [(0, 0, False), (1, 1, True), (2, 3, True)]
