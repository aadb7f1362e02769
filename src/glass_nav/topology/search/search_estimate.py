"""The result of the search after a meetpoint: state, candidates, and the turn to take."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.topology.observations import turn_name
from glass_nav.vocabulary import SEARCH_IS_OVER, SearchState


@dataclass(frozen=True)
class TurnChoice:
    """The edge by which to leave the meetpoint."""

    rank: int
    degree: int

    @property
    def name(self) -> str:
        return turn_name(self.rank, self.degree)


@dataclass(frozen=True)
class SearchEstimate:
    """The result after a meetpoint."""

    state: SearchState
    reason: str  # why, in one sentence
    depth: int  # edges driven so far
    dart: np.ndarray  # (C,) candidates: the dart back along the edge on which the robot came
    errors: np.ndarray  # (C,) detection errors of each
    choice: Optional[TurnChoice]  # None: nothing is left to find out
    map_from_base: Optional[np.ndarray] = None  # (3,) CONFIRMED by the scans: the pose; dart is empty where the graph
    # does not have it
    node_count: Optional[int] = None  # nodes among the candidates, where those are the document's: at the first
    # meetpoint it has a candidate for each node

    @property
    def candidates(self) -> int:
        """How many places fit: as many as the reason says."""
        return len(self.dart) if self.node_count is None else self.node_count

    @property
    def done(self) -> bool:
        """Whether the search is over."""
        return self.state in SEARCH_IS_OVER
