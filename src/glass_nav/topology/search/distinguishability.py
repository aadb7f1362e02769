"""Which places of an atlas are indistinguishable, and how many edges a robot needs to find its place.

The search of a robot without measurement errors is simulated from every dart. If it ends with several places, these
are indistinguishable (ambiguity.py has the proof), and so are the starts of such searches.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, FrozenSet, List, Optional, Set

import numpy as np

from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search import wake_up_trials
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.atlas_robot import Surroundings, TrialParams
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState


@dataclass(frozen=True)
class Distinguishability:
    """The result for the darts at which robots woke up."""

    starts: np.ndarray  # (S,) darts
    edges: np.ndarray  # (S,) driven until the search ended; those that confirm included
    confirmed: np.ndarray  # (S,) bool: it ended CONFIRMED
    alike: List[FrozenSet[int]]  # sets of two or more darts: a robot that begins at one of them may be at any
    unresolved: np.ndarray  # darts (U,) from which the search did not end


def of(
    atlas: Atlas, params: SearchParams, starts: Optional[np.ndarray] = None, step: Callable[[], None] = lambda: None
) -> Distinguishability:
    """Search from every start.

    Args:
        atlas: in question.
        params: of the search.
        starts: (S,) darts; all of them when not given.
        step: called once for each.
    """
    starts = np.arange(len(atlas.darts)) if starts is None else starts
    localizer, world = AtlasLocalizer(atlas, params), Surroundings.of(atlas)
    exact = TrialParams(noise_limit=0.0, angles=params.use_edge_angles and not params.document)
    rng = np.random.default_rng(0)  # nothing is left to chance
    edges, confirmed, unresolved = [], [], []
    alike: Set[FrozenSet[int]] = set()
    for dart in starts.tolist():
        trial = wake_up_trials.run(localizer, world, exact, rng, dart=dart)
        edges.append(trial.edges)
        confirmed.append(trial.outcome == SearchState.CONFIRMED)
        if trial.outcome == SearchState.AMBIGUOUS:
            alike.add(frozenset(int(localizer.path(int(end))[0]) for end in trial.estimate.dart))
        elif trial.outcome != SearchState.CONFIRMED:
            unresolved.append(dart)
        step()
    return Distinguishability(
        starts, np.array(edges), np.array(confirmed), _merged(alike), np.array(unresolved, np.int64)
    )


def _merged(alike: Set[FrozenSet[int]]) -> List[FrozenSet[int]]:
    """Sets that share a dart are united; returned by their smallest dart."""
    merged: List[Set[int]] = []
    for each in sorted(alike, key=min):
        touching = [other for other in merged if other & each]
        merged = [other for other in merged if not other & each]
        merged.append(set(each).union(*touching))
    return sorted((frozenset(each) for each in merged), key=min)
