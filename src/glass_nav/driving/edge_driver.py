"""Scans, odometry -> commands along the edges of the Voronoi graph, and what the robot reports of them.

No pose in a map is needed: the graph is that of a small map around the robot, see local_map.py, made by the same code
as the atlas, so that both see the same meetpoints. All poses are odom_from_base (3,).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.sensing.scan import Scan
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.voronoi_graph import VoronoiParams

# phases
IDLE = "IDLE"            # stands, nothing asked for
SEEKING = "SEEKING"      # on its way to the graph and along it to any meetpoint
FOLLOWING = "FOLLOWING"  # along an edge
HOMING = "HOMING"        # the last way to a meetpoint, and a look around there
ARRIVED = "ARRIVED"      # stands at a meetpoint
FAILED = "FAILED"        # stands: cannot go on

# why it FAILED
NO_GRAPH, BLOCKED, NO_WAY = "NO_GRAPH", "BLOCKED", "NO_WAY"


@dataclass(frozen=True)
class EdgeDriverParams:
    """How edges are followed and meetpoints found."""
    limits: BaseLimits = field(default_factory=BaseLimits)
    graph: VoronoiParams = field(default_factory=VoronoiParams)  # as the atlas was built with


@dataclass(frozen=True)
class Arrival:
    """What is reported at a meetpoint."""
    stamp_ns: int                   # of the scan that showed it
    meetpoint: Meetpoint
    traversal: Optional[Traversal]  # None: it was sought, not reached along an edge that began at a meetpoint


@dataclass(frozen=True)
class Progress:
    """Where the driver is."""
    phase: str
    reason: str          # one sentence
    travelled_m: float   # since the last meetpoint
    failure: str = ""    # NO_GRAPH, BLOCKED or NO_WAY if FAILED


class EdgeDriver:
    """see() every scan, ask for a command() at every control step; seek(), leave() and stop() say what to do."""

    def __init__(self, p: EdgeDriverParams) -> None:
        self._p = p

    def reset(self) -> None:
        """Forget all: odometry began anew, or the robot was carried."""

    def see(self, scan: Scan, odom_from_base: np.ndarray) -> None:
        """Take in a scan (deskewed or not), with odometry's pose at its stamp; in any phase."""

    def seek(self) -> None:
        """Drive to a meetpoint."""

    def leave(self, rank: int) -> None:
        """Follow the edge of that rank from the meetpoint where the robot stands.

        Raises:
            ObservationError: it stands at none, or that has no such edge; nothing is changed.
        """

    def stop(self) -> None:
        """Stand, whatever was asked for; it can be taken up again by seek()."""

    def command(self, odom_from_base: np.ndarray, dt_s: float) -> np.ndarray:
        """(3,) velocity forward, left [m/s], turn [rad/s] within the limits, the last one given taken into account;
        zero unless SEEKING, FOLLOWING or HOMING."""
        raise NotImplementedError

    def take_arrival(self) -> Optional[Arrival]:
        """The report of a meetpoint, once."""
        raise NotImplementedError

    @property
    def progress(self) -> Progress:
        raise NotImplementedError
