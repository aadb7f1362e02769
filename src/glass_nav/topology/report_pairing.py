"""Pairs the two reports of a driven edge, the edge_traversal and the meetpoint at its end, in whichever order they come."""

from __future__ import annotations

import logging
from typing import Optional, Tuple

from glass_nav.log_line import LogLine
from glass_nav.topology.observations import Meetpoint, Traversal


class ReportPairing:
    """Holds one report of each kind, the newest, until the other one has come."""

    def __init__(self, tolerance_s: float) -> None:
        """
        Args:
            tolerance_s: how far apart the stamps of a pair may be [s].
        """
        self._tolerance_s = tolerance_s
        self._meetpoint: Optional[Meetpoint] = None
        self._traversal: Optional[Tuple[Traversal, int]] = None  # with its stamp [ns]

    def clear(self) -> None:
        """Drop both."""
        self._meetpoint, self._traversal = None, None

    def put_meetpoint(self, meetpoint: Meetpoint) -> None:
        """Hold a meetpoint."""
        self._meetpoint = meetpoint

    def put_traversal(self, traversal: Traversal, stamp_ns: int) -> None:
        """Hold an edge traversal.

        Args:
            traversal: the edge.
            stamp_ns: of the report; 0: none.
        """
        self._traversal = traversal, stamp_ns

    def drop_older(self) -> Optional[LogLine]:
        """Drop the older of two reports that are too far apart in time, and say so; None: they are not."""
        if self._meetpoint is None or self._traversal is None:
            return None
        stamps_ns = self._meetpoint.stamp_ns, self._traversal[1]
        apart_s = 0.0 if 0 in stamps_ns else abs(stamps_ns[0] - stamps_ns[1]) * 1e-9
        if apart_s <= self._tolerance_s:
            return None
        meetpoint_is_older = stamps_ns[0] < stamps_ns[1]
        if meetpoint_is_older:
            self._meetpoint = None
        else:
            self._traversal = None
        return LogLine(
            f"a {'meetpoint' if meetpoint_is_older else 'traversal'} is dropped: the edge_traversal and the meetpoint "
            f"at its end are stamped {apart_s:.3f} s apart, allowed ~pairing_tolerance_s {self._tolerance_s:g} s",
            logging.WARNING,
            often=True,
        )

    def take(self) -> Optional[Tuple[Traversal, Meetpoint]]:
        """Both reports, which are held no longer; None: one is missing. Call drop_older() first."""
        if self._meetpoint is None or self._traversal is None:
            return None
        pair = self._traversal[0], self._meetpoint
        self.clear()
        return pair
