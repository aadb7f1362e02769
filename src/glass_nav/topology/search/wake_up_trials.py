"""Simulates searches of robots that wake up somewhere in an atlas, without a building."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Dict, Iterator, List, Optional, Tuple

import numpy as np

from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.atlas_robot import AtlasRobot, Surroundings, TrialParams
from glass_nav.topology.search.search_estimate import SearchEstimate
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState

WRONG, UNDECIDED = "WRONG", "UNDECIDED"


@dataclass(frozen=True)
class Trial:
    """How one search ended."""

    outcome: str  # CONFIRMED, AMBIGUOUS, LOST, WRONG or UNDECIDED
    edges: int  # driven
    detection_errors: int  # that the robot's detector made
    truth_lost_at: Optional[int]  # depth from which on the true dart was no candidate; None: never, or no truth
    step_ms: List[float]  # CPU time of each step
    estimate: SearchEstimate  # the last


def run(
    localizer: AtlasLocalizer,
    world: Surroundings,
    p: TrialParams,
    rng: np.random.Generator,
    in_atlas: bool = True,
    dart: Optional[int] = None,
) -> Trial:
    """Simulates one robot, from waking up (at a dart, or anywhere) to the end of its search."""
    robot = AtlasRobot(world, p, rng)
    step_ms: List[float] = []
    truth_lost_at: Optional[int] = None
    for estimate, spent_ms in _search(localizer, robot, p.max_edges, dart):
        step_ms.append(spent_ms)
        if in_atlas and truth_lost_at is None and not robot.on_edge and robot.dart not in estimate.dart:
            truth_lost_at = estimate.depth
    outcome = estimate.state if estimate.done else UNDECIDED
    there = in_atlas and not robot.on_edge and robot.dart in estimate.dart
    if outcome in (SearchState.CONFIRMED, SearchState.AMBIGUOUS) and not there:
        outcome = WRONG
    return Trial(outcome, estimate.depth, robot.detection_errors, truth_lost_at, step_ms, estimate)


def _search(
    localizer: AtlasLocalizer, robot: AtlasRobot, max_edges: int, dart: Optional[int]
) -> Iterator[Tuple[SearchEstimate, float]]:
    meetpoint = robot.wake_up(dart)
    started = time.process_time()
    estimate = localizer.start(meetpoint)
    yield estimate, 1e3 * (time.process_time() - started)
    while estimate.choice is not None and estimate.depth < max_edges:
        traversal, meetpoint = robot.drive(estimate.choice.rank)
        started = time.process_time()
        estimate = localizer.update(traversal, meetpoint)
        yield estimate, 1e3 * (time.process_time() - started)


def trials(
    atlas: Atlas, params: SearchParams, p: TrialParams, count: int, seed: int, elsewhere: bool = False
) -> Iterator[Trial]:
    """A number of robots, each with its own random numbers: trial k does not depend on the others.

    Args:
        atlas: that they are given.
        params: of the search.
        p: of the robots.
        count: of trials.
        seed: of the random numbers.
        elsewhere: the robots are not in the atlas, but each in a shuffled one.
    """
    localizer, world = AtlasLocalizer(atlas, params), Surroundings.of(atlas)
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        yield run(localizer, world.shuffled(rng) if elsewhere else world, p, rng, not elsewhere)


def metrics(done: List[Trial]) -> Dict[str, float]:
    """Shares of outcomes, edges driven until the outcome, CPU time of the slowest step."""
    count = len(done)
    edges = np.array([trial.edges for trial in done])
    shares = {
        f"{name.lower()}_share": sum(trial.outcome == name for trial in done) / count
        for name in (SearchState.CONFIRMED, WRONG, SearchState.AMBIGUOUS, SearchState.LOST, UNDECIDED)
    }
    return {
        **shares,
        "edges_mean": float(edges.mean()),
        "edges_p95": float(np.percentile(edges, 95)),
        "step_ms_max": max(max(trial.step_ms) for trial in done),
        "trials": count,
        "truth_lost_share": sum(trial.truth_lost_at is not None for trial in done) / count,
    }
