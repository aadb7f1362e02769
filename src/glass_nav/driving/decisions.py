"""The decisions of the driver, for a node to carry out: commands, reports, results, requests, log lines."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Optional, Tuple, Union

import numpy as np

from glass_nav.driving.edge_tracking.edge_driver import Arrival
from glass_nav.driving.node_visits import NodeVisit
from glass_nav.driving.tasks import Ending
from glass_nav.log_line import LogLine
from glass_nav.vocabulary import DriverPhase


class Action(Enum):
    """The action whose client waits for the end of a task."""

    TRAVERSE_EDGE = "traverse_edge"
    GOTO_NODE = "goto_node"


@dataclass(frozen=True)
class Command:
    """A velocity command for the base."""

    velocity: np.ndarray  # (3,) forward, left [m/s], turn [rad/s]


@dataclass(frozen=True)
class TraversalReport:
    """The edge by which the robot came to a meetpoint, or that it came along none; the report of that follows."""

    arrival: Arrival  # its traversal is not None


@dataclass(frozen=True)
class MeetpointReport:
    """The meetpoint where the robot stands."""

    arrival: Arrival


@dataclass(frozen=True)
class DriveStatus:
    """The status of the driver, to be published."""

    phase: DriverPhase
    reason: str  # one sentence
    task: str = ""  # in words; empty: none is on
    travelled_m: float = 0.0  # since the task began
    remaining_m: float = math.nan  # to the goal; NaN: not known
    stamp_ns: int = 0  # of the last scan that was used


@dataclass(frozen=True)
class Feedback:
    """The status, for the client of the task."""

    action: Action
    status: DriveStatus


@dataclass(frozen=True)
class GoalEnd:
    """The goal of an action is over."""

    action: Action
    ending: Ending
    travelled_m: float = 0.0
    arrival: Optional[Arrival] = None  # at a meetpoint, if the goal led there
    map_from_base: Optional[np.ndarray] = None  # (3,) None: not known
    stamp_ns: int = 0  # of the odometry then


@dataclass(frozen=True)
class VisitReport:
    """The nodes that the robot passed on the way to a goal, with what it measured."""

    visits: Tuple[NodeVisit, ...]
    stamp_ns: int  # of the last scan


Decision = Union[Command, TraversalReport, MeetpointReport, DriveStatus, Feedback, GoalEnd, VisitReport, LogLine]
