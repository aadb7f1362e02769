"""The simulated robot against geometry, and what trials promise."""

from __future__ import annotations

import math

import made_atlases
import numpy as np
import pytest

from glass_nav.geometry import angles
from glass_nav.topology.search import distinguishability, wake_up_trials
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.search.wake_up_trials import AtlasRobot, Surroundings, TrialParams
from glass_nav.vocabulary import SearchState

EXACT = TrialParams(noise_limit=0.0)


@pytest.mark.parametrize("seed", range(10))
def test_what_the_robot_adds_up_by_dead_reckoning_is_the_geometry_of_the_atlas(seed: int) -> None:
    """Property: also over edges that missed meetpoints join, the chord leads from node to node."""
    rng = np.random.default_rng(seed)
    atlas = made_atlases.voronoi(80, seed)
    robot = AtlasRobot(Surroundings.of(atlas), TrialParams(noise_limit=0.0, missed=0.4), rng)
    here = robot.wake_up()
    joined = 0
    for _ in range(40):
        came, errors, rank = robot.dart, robot.detection_errors, int(rng.integers(here.degree))
        departure = int(atlas.clockwise(np.array(came), np.array(rank)))
        traversal, here = robot.drive(rank)
        joined += robot.detection_errors > errors
        start, end = atlas.nodes.position_m[atlas.darts.node[[departure, robot.dart]]]
        step = end - start
        assert traversal.chord_m == pytest.approx(math.hypot(*step), abs=1e-9)
        if traversal.chord_m > 0.01:
            ahead = math.atan2(step[1], step[0]) - atlas.darts.bearing_rad[departure]
            assert abs(angles.wrap(ahead - traversal.chord_bearing_rad)) < 1e-6
        turned = atlas.darts.bearing_rad[robot.dart] + np.pi - atlas.darts.bearing_rad[departure]
        assert abs(angles.wrap(turned - traversal.turn_rad)) < 1e-9
        assert (here.degree, here.r_m) == (
            len(atlas.rings[int(atlas.darts.node[robot.dart])]),
            atlas.nodes.r_m[atlas.darts.node[robot.dart]],
        )
        gaps = (
            atlas.darts.bearing_rad[robot.dart]
            - atlas.darts.bearing_rad[atlas.clockwise(np.full(here.degree, robot.dart), np.arange(here.degree))]
        )
        np.testing.assert_allclose(angles.wrap(here.gaps_rad - gaps), 0.0, atol=1e-6)
    assert joined > 5


def test_an_edge_that_is_split_adds_up_to_itself() -> None:
    atlas = made_atlases.corridors([(0, 0), (20, 0)], [1.0, 1.5], [(0, 1)])
    for seed in range(30):
        robot = AtlasRobot(
            Surroundings.of(atlas), TrialParams(noise_limit=0.0, spurious=0.5), np.random.default_rng(seed)
        )
        robot.wake_up(0)
        at, way = 0.0, 1.0
        for _ in range(10):
            turn = 0 if robot.on_edge == 0.0 or seed % 3 == 0 else 1
            way = -way if robot.on_edge and turn == 0 else way
            traversal, here = robot.drive(turn)
            at += way * traversal.length_m
            assert traversal.chord_m == pytest.approx(traversal.length_m)
            if robot.on_edge:
                travelled = 20.0 * robot.on_edge
                assert at == pytest.approx(travelled if robot.dart == 0 else 20.0 - travelled)
                assert here.degree in (1, 3)
            else:
                assert at == pytest.approx(20.0 if robot.dart == 1 else 0.0, abs=1e-9)
                way = -way


def test_shuffled_surroundings_have_the_same_parts() -> None:
    atlas = made_atlases.voronoi(200, 1)
    here = Surroundings.of(atlas)
    there = here.shuffled(np.random.default_rng(0))
    for name in ("r_m", "length_m", "chord_m", "chord_bearing_rad", "turn_rad"):
        one, other = getattr(here, name), getattr(there, name)
        np.testing.assert_array_equal(np.sort(one), np.sort(other))
        assert (one != other).mean() > 0.5
    np.testing.assert_allclose(np.sort(there.gap_rad), np.sort(here.gap_rad))


@pytest.mark.parametrize("nodes, seed", [(100, 21), (1500, 22)])
def test_the_truth_is_never_eliminated_while_errors_are_within_tolerance(nodes: int, seed: int) -> None:
    atlas = made_atlases.voronoi(nodes, seed)
    bounded = TrialParams(noise_limit=SearchParams().tolerances.z * 0.98)
    trials = list(wake_up_trials.trials(atlas, SearchParams(), bounded, 300, seed))
    assert all(trial.truth_lost_at is None for trial in trials)
    assert {trial.outcome for trial in trials} == {SearchState.CONFIRMED}


def test_errors_as_large_as_the_tolerance_all_at_once_do_not_eliminate_the_truth() -> None:
    atlas = made_atlases.voronoi(200, 23)
    limits = SearchParams().tolerances
    robot = TrialParams(noise_gain=1e3, noise_limit=0.98e-3 * limits.z / math.sqrt(2.0))  # all at the limit, either way
    trials = list(wake_up_trials.trials(atlas, SearchParams(), robot, 100, 0))
    assert all(trial.truth_lost_at is None for trial in trials)


@pytest.mark.long_run
def test_no_robot_in_the_atlas_is_told_a_wrong_place_few_with_a_poor_detector() -> None:
    atlas = made_atlases.voronoi(400, 24)
    figures = wake_up_trials.metrics(list(wake_up_trials.trials(atlas, SearchParams(), TrialParams(), 500, 1)))
    assert (figures["confirmed_share"], figures["wrong_share"]) == (1.0, 0.0)
    poor = TrialParams(missed=0.15, spurious=0.03)
    figures = wake_up_trials.metrics(list(wake_up_trials.trials(atlas, SearchParams(), poor, 500, 1)))
    assert figures["wrong_share"] <= 0.005 and figures["confirmed_share"] > 0.85
    assert figures["wrong_share"] + figures["confirmed_share"] + figures["lost_share"] + figures[
        "ambiguous_share"
    ] + figures["undecided_share"] == pytest.approx(1.0)


def test_robots_elsewhere_are_lost_with_the_documents_rule_many_are_told_a_place() -> None:
    atlas = made_atlases.voronoi(400, 25)
    figures = wake_up_trials.metrics(
        list(wake_up_trials.trials(atlas, SearchParams(), TrialParams(), 200, 2, elsewhere=True))
    )
    assert figures["wrong_share"] <= 0.01 and figures["lost_share"] >= 0.99
    document = SearchParams(vote_mode="seed", confirm_edges=0)
    figures = wake_up_trials.metrics(
        list(wake_up_trials.trials(atlas, document, TrialParams(angles=False), 200, 2, elsewhere=True))
    )
    assert figures["wrong_share"] > 0.05


def test_a_trial_is_the_same_whatever_others_do() -> None:
    atlas = made_atlases.voronoi(100, 26)
    many = list(wake_up_trials.trials(atlas, SearchParams(), TrialParams(missed=0.1), 20, 3))
    again = list(wake_up_trials.trials(atlas, SearchParams(), TrialParams(missed=0.1), 10, 3))
    assert [(t.outcome, t.edges) for t in many[:10]] == [(t.outcome, t.edges) for t in again]


def test_a_robot_that_may_not_drive_on_is_undecided() -> None:
    atlas = made_atlases.voronoi(400, 27)
    (trial,) = wake_up_trials.trials(atlas, SearchParams(), TrialParams(max_edges=1), 1, 0)
    assert (trial.outcome, trial.edges) == (wake_up_trials.UNDECIDED, 1)


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"missed": 1.0}, "missed must be in [0, 1), got 1.0"),
        ({"spurious": -0.1}, "spurious must be in [0, 1)"),
        ({"noise_gain": -1.0}, "noise_gain must be >= 0"),
        ({"max_edges": 0}, "max_edges must be >= 1, got 0"),
    ],
)
def test_trials_that_mean_nothing_are_refused(fields: "dict[str, float]", line: str) -> None:
    with pytest.raises(ValueError) as refused:
        TrialParams(**fields)  # type: ignore[arg-type]
    assert line in str(refused.value)


def test_places_that_half_a_turn_takes_to_each_other_are_found_indistinguishable() -> None:
    # A corridor with a side corridor to the left near either end; the stubs at the ends are alike.
    atlas = made_atlases.corridors(
        [(0, 0), (10, 0), (-5, 0), (15, 0), (0, 4), (10, -4)],
        [1.3, 1.3, 0.8, 0.8, 0.6, 0.6],
        [(0, 1), (2, 0), (1, 3), (0, 4), (1, 5)],
    )
    found = distinguishability.of(atlas, SearchParams())
    assert not found.confirmed.any() and not len(found.unresolved)
    # Half a turn about (5, 0) takes node 0 to 1, 2 to 3, 4 to 5.
    halfturn = {0: 1, 1: 0, 2: 5, 5: 2, 3: 4, 4: 3, 6: 8, 8: 6, 7: 9, 9: 7}
    assert {frozenset(alike) for alike in found.alike} == {frozenset(pair) for pair in halfturn.items()}


def test_where_all_differs_nothing_is_indistinguishable() -> None:
    steps = []
    atlas = made_atlases.voronoi(60, 5)
    found = distinguishability.of(atlas, SearchParams(), np.arange(0, len(atlas.darts), 5), lambda: steps.append(1))
    assert found.confirmed.all() and found.alike == [] and len(steps) == len(found.starts)
    assert found.edges.max() < 12


def test_lost_is_an_outcome() -> None:
    atlas = made_atlases.voronoi(100, 28)
    outcomes = {
        trial.outcome for trial in wake_up_trials.trials(atlas, SearchParams(), TrialParams(), 20, 0, elsewhere=True)
    }
    assert SearchState.LOST in outcomes
