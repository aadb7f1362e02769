"""The simulated robot against geometry, and what trials promise."""

from __future__ import annotations

import math

import made_atlases
import pytest

from glass_nav.topology.search import wake_up_trials
from glass_nav.topology.search.atlas_robot import TrialParams
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState


@pytest.mark.long_run
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


@pytest.mark.long_run
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


def test_lost_is_an_outcome() -> None:
    atlas = made_atlases.voronoi(100, 28)
    outcomes = {
        trial.outcome for trial in wake_up_trials.trials(atlas, SearchParams(), TrialParams(), 20, 0, elsewhere=True)
    }
    assert SearchState.LOST in outcomes
