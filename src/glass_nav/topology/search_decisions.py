"""The decisions of a search session, for a node to carry out: status, turns, results, requests, log lines."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Optional, Union

import numpy as np

from glass_nav.log_line import LogLine
from glass_nav.topology.frame_relation import FrameRelation
from glass_nav.topology.search.belief import Belief
from glass_nav.topology.search.search_estimate import SearchEstimate, TurnChoice
from glass_nav.vocabulary import SearchState
from glass_nav.world.grid_map import GridMap


class GoalOutcome(Enum):
    """How a goal ended."""

    SUCCEEDED = "SUCCEEDED"  # CONFIRMED
    ABORTED = "ABORTED"  # AMBIGUOUS, LOST, or too many edges
    PREEMPTED = "PREEMPTED"


@dataclass(frozen=True)
class SearchStatus:
    """The status of the search, to be published."""

    state: SearchState
    reason: str  # one sentence
    stamp_ns: int = 0  # of the meetpoint that it follows from; 0: of none
    estimate: Optional[SearchEstimate] = None  # of the search; None before its first meetpoint
    poses: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  # (K, 3) map_from_base of the first candidates
    relation: Optional[FrameRelation] = None  # of the frames, if it is CONFIRMED and dead reckoning is known
    belief: Optional[Belief] = None  # of scans and forest; None: no scan has been evidence yet

    @property
    def map_from_base(self) -> Optional[np.ndarray]:
        """(3,) the pose, if it is CONFIRMED."""
        return self.poses[0] if self.state == SearchState.CONFIRMED else None


@dataclass(frozen=True)
class Progress:
    """Feedback for the goal."""

    status: SearchStatus


@dataclass(frozen=True)
class Turn:
    """The answer to a meetpoint."""

    choice: TurnChoice
    stamp_ns: int  # of the meetpoint


@dataclass(frozen=True)
class InitialPose:
    """The pose to be handed over to the localization."""

    map_from_base: np.ndarray  # (3,)
    stamp_ns: int  # of the meetpoint where the robot had this pose


@dataclass(frozen=True)
class GoalEnd:
    """The goal is over."""

    outcome: GoalOutcome
    reason: str
    status: SearchStatus


@dataclass(frozen=True)
class AtlasRequest:
    """An atlas of this map is to be made, and to be given to SearchSession.atlas_made()."""

    grid_map: GridMap


Decision = Union[SearchStatus, Progress, Turn, InitialPose, GoalEnd, LogLine, AtlasRequest]
