"""How often the robot passed each edge of its meetpoints, to explore without an atlas.

A robot that always leaves by the edge that it passed least often covers every edge of any building: Tremaux's rule
for mazes (Lucas, Recreations mathematiques, 1882). Edges are recognized by where they leave and in which direction,
from odometry.
"""

from __future__ import annotations

from typing import List, Optional

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.topology.observations import Meetpoint

_SAME_M, _SAME_SHARE = 0.7, 0.02  # meetpoints nearer than that are one; odometry drifts by this share of the distance
_SAME_RAD = 0.5


class PassedEdges:
    """begin() with a meetpoint, then add() each edge to the next, or jump() there."""

    def __init__(self) -> None:
        self._forget()

    def _forget(self) -> None:
        self._ends: List[
            np.ndarray
        ] = []  # (4,) x, y, direction in odom of an end that was passed, distance driven then
        self._last: Optional[Meetpoint] = None
        self._driven_m = 0.0

    def begin(self, meetpoint: Meetpoint) -> None:
        """Start over."""
        self._forget()
        self._last = meetpoint

    def add(self, rank: int, meetpoint: Meetpoint, length_m: float) -> None:
        """The robot left the last meetpoint by an edge of that rank, and came to this one after that distance."""
        if self._last is not None:
            self._mark(self._last, rank)
        self._driven_m += length_m
        self._mark(meetpoint, 0)
        self._last = meetpoint

    def jump(self, meetpoint: Meetpoint) -> None:
        """The robot came to this meetpoint along no edge."""
        self._last = meetpoint

    def times(self, meetpoint: Meetpoint) -> Optional[np.ndarray]:
        """(degree,) how often each edge of the last meetpoint was passed, in either direction; None: not known."""
        if meetpoint.odom_from_base is None or not len(meetpoint.bearings_rad):
            return None
        centre, bearing = _in_odom(meetpoint)
        times = np.zeros(meetpoint.degree, np.int64)
        for x, y, direction, driven_m in self._ends:
            off = np.abs(angles.wrap(bearing - direction))
            near_m = _SAME_M + _SAME_SHARE * (self._driven_m - driven_m)
            if float(np.hypot(x - centre[0], y - centre[1])) < near_m and off.min() < _SAME_RAD:
                times[int(off.argmin())] += 1
        return times

    def _mark(self, meetpoint: Meetpoint, rank: int) -> None:
        if meetpoint.odom_from_base is not None and len(meetpoint.bearings_rad):
            centre, bearing = _in_odom(meetpoint)
            self._ends.append(np.array([centre[0], centre[1], bearing[rank], self._driven_m]))


def _in_odom(meetpoint: Meetpoint) -> "tuple[np.ndarray, np.ndarray]":
    """Position (2,) of the meetpoint in odom, and directions (degree,) of its edges."""
    assert meetpoint.odom_from_base is not None
    return (
        se2.transform_points(meetpoint.odom_from_base, meetpoint.centre_m),
        meetpoint.bearings_rad + meetpoint.odom_from_base[2],
    )
