"""What the robot observes on its path through the Voronoi graph: meetpoints, and edges between them.

These are the match nodes and match edges of the seed document global_localization_procedure.txt. The edges of a
meetpoint have ranks: 0 is the reference edge, along which the robot came (any edge at the first meetpoint); the
others count clockwise, seen from above. Rank 1 is to the LEFT, the last one to the RIGHT, rank 0 a U_TURN.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from glass_nav.sensing.scan import Scan

UNKNOWN = math.nan
U_TURN, LEFT, RIGHT, FORWARD = "U_TURN", "LEFT", "RIGHT", "FORWARD"


class ObservationError(ValueError):
    """An impossible report; one line: what, what was given, what is allowed."""


@dataclass(frozen=True)
class Meetpoint:
    """A place where several edges of the graph meet, or where one ends."""

    degree: int  # number of edges, the one that the robot came along included
    r_m: float  # equidistance: mean distance of the nearest obstacles from the meetpoint
    sigma_r_m: float = 0.0  # 0: as the tolerances say
    bearings_rad: np.ndarray = field(default_factory=lambda: np.zeros(0))  # (degree,) or (0,) not measured: directions
    # of the edges in the robot's frame, by rank
    centre_m: np.ndarray = field(default_factory=lambda: np.zeros(2))  # (2,) of the meetpoint in the robot's frame
    stamp_ns: int = 0
    scan: Optional[Scan] = None  # taken there, to judge candidates by it
    odom_from_base: Optional[np.ndarray] = None  # (3,) of the robot by dead reckoning, to follow poses

    def __post_init__(self) -> None:
        if self.degree < 1:
            raise ObservationError(f"meetpoint: degree must be >= 1, got {self.degree}")
        if not (math.isfinite(self.r_m) and self.r_m > 0.0):
            raise ObservationError(f"meetpoint: r must be finite and > 0 m, got {self.r_m}")
        if not (math.isfinite(self.sigma_r_m) and self.sigma_r_m >= 0.0):
            raise ObservationError(f"meetpoint: sigma_r must be finite and >= 0 m, got {self.sigma_r_m}")
        if self.bearings_rad.shape not in ((0,), (self.degree,)):
            raise ObservationError(
                f"meetpoint: {self.degree} edges need {self.degree} bearings or none, got {len(self.bearings_rad)}"
            )
        if not np.isfinite(self.bearings_rad).all():
            raise ObservationError(f"meetpoint: bearings must be finite, got {self.bearings_rad.tolist()}")
        turn = float(self.gaps_rad[-1]) if self.degree > 1 and len(self.bearings_rad) else 0.0
        if np.any(np.diff(self.gaps_rad) < 0.0) or turn >= 2.0 * math.pi:
            raise ObservationError(
                f"meetpoint: bearings must run clockwise from the first, got "
                f"{np.round(self.bearings_rad, 3).tolist()} rad"
            )
        if self.centre_m.shape != (2,) or not np.isfinite(self.centre_m).all():
            raise ObservationError(f"meetpoint: its place needs finite x and y, got {self.centre_m.tolist()}")
        odom = self.odom_from_base
        if odom is not None and (odom.shape != (3,) or not np.isfinite(odom).all()):
            raise ObservationError(f"meetpoint: its odometry needs finite x, y and yaw, got {odom.tolist()}")

    @property
    def gaps_rad(self) -> np.ndarray:
        """(degree,) or (0,) angles from the reference edge to each, clockwise, in [0, 2 pi)."""
        if not len(self.bearings_rad):
            return self.bearings_rad
        return np.mod(self.bearings_rad[0] - self.bearings_rad, 2.0 * np.pi)


@dataclass(frozen=True)
class Traversal:
    """An edge that the robot followed from one meetpoint to the next; by dead reckoning. NaN: not measured."""

    rank: int  # of the edge at the meetpoint that it left
    length_m: float  # travelled; NaN: along no edge, as after one that was blocked
    chord_m: float  # in a straight line
    sigma_length_m: float = 0.0  # 0: as the tolerances say
    sigma_chord_m: float = 0.0
    chord_bearing_rad: float = UNKNOWN  # direction of the chord, counterclockwise from that in which the edge left
    turn_rad: float = UNKNOWN  # direction of travel at the end, counterclockwise from that in which the edge left
    segments_m: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))  # (n, 4) x1 y1 x2 y2 seen, in the frame
    # at the start, x along the edge

    def __post_init__(self) -> None:
        if self.rank < 0:
            raise ObservationError(f"edge traversal: rank must be >= 0, got {self.rank}")
        if not (math.isnan(self.length_m) or 0.0 < self.length_m < math.inf):
            raise ObservationError(f"edge traversal: length must be finite and > 0 m, or NaN, got {self.length_m}")
        if not (math.isnan(self.chord_m) or (math.isfinite(self.chord_m) and self.chord_m >= 0.0)):
            raise ObservationError(f"edge traversal: chord must be >= 0 m, or NaN, got {self.chord_m}")
        for name in ("sigma_length", "sigma_chord"):
            value = getattr(self, f"{name}_m")
            if not (math.isfinite(value) and value >= 0.0):
                raise ObservationError(f"edge traversal: {name} must be finite and >= 0 m, got {value}")
        for name in ("chord_bearing", "turn"):
            if math.isinf(getattr(self, f"{name}_rad")):
                raise ObservationError(
                    f"edge traversal: {name} must be finite, or NaN, got {getattr(self, name + '_rad')}"
                )
        if self.segments_m.ndim != 2 or self.segments_m.shape[1:] != (4,) or not np.isfinite(self.segments_m).all():
            raise ObservationError(
                f"edge traversal: segments must be finite rows of x1 y1 x2 y2, got shape {self.segments_m.shape}"
            )

    @property
    def was_followed(self) -> bool:
        """Whether the robot came along an edge; else only dead reckoning knows its path from the last meetpoint."""
        return not math.isnan(self.length_m)


NOT_FOLLOWED = Traversal(0, UNKNOWN, UNKNOWN)


def turn_name(rank: int, degree: int) -> str:
    """The word for leaving a meetpoint of that degree by that rank: U_TURN, LEFT, RIGHT, FORWARD or RANK_k."""
    if rank == 0:
        return U_TURN
    if degree == 2:
        return FORWARD
    if rank == 1:
        return LEFT
    return RIGHT if rank == degree - 1 else f"RANK_{rank}"


def refuse_rank(rank: int, degree: int) -> None:
    """Raises ObservationError if a meetpoint of that degree has no such edge."""
    if not 0 <= rank < degree:
        raise ObservationError(
            f"turn of rank {rank}: the meetpoint it left has degree {degree}, allowed 0 to {degree - 1}"
        )
