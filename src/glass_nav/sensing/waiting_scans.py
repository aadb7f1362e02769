"""Scans that wait for the transforms at their stamp, and a count of where every scan went.

Scans are opaque here; stamps are integer nanoseconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Generic, List, Optional, Tuple, TypeVar

T = TypeVar("T")


@dataclass
class ScanCounts:
    """Where the scans went since the start; received is the sum of the others.

    WaitingScans counts the last three, its user the first three; those of several lidars share one.
    """

    received: int = 0
    used: int = 0
    refused: int = 0  # nonsense fields, or a stamp that is not after the last one used
    superseded: int = 0  # a newer one was ready too: the lidar is faster than the node or tf
    dropped_no_transform: int = 0  # no transform at its stamp within the limit
    waiting: int = 0  # for their transform, now


class WaitingScans(Generic[T]):
    """Scans that wait for the transform at their stamp; the newest that has one wins.

    tf2_ros for Python has no MessageFilter. A scan that arrives before its transform waits here. A scan
    that is older than one already handed out is never handed out, so stamps only ascend.
    """

    def __init__(self, capacity: int, limit_s: float, counts: Optional[ScanCounts] = None) -> None:
        """Args:
        capacity: scans that may wait; the oldest goes first.
        limit_s: how long one may wait, by the clock that add() and take_ready() are given.
        counts: to be kept with those of other lidars; its own when not given.
        """
        self._waiting: List[Tuple[float, int, T]] = []  # arrival [s], stamp [ns], scan
        self._capacity = capacity
        self._newest_ns: Optional[int] = None
        self.limit_s = limit_s
        self.counts = ScanCounts() if counts is None else counts

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, scan: T, stamp_ns: int, now_s: float) -> bool:
        """Let a scan wait; False if its stamp is not after that of the last one handed out."""
        if self._newest_ns is not None and stamp_ns <= self._newest_ns:
            return False
        waiting = [*self._waiting, (now_s, stamp_ns, scan)]
        if len(waiting) > self._capacity:
            self.counts.dropped_no_transform += 1
        self._keep(waiting[-self._capacity :])
        return True

    def take_ready(self, is_ready: Callable[[T], bool], now_s: float) -> "Tuple[Optional[T], List[T]]":
        """The scan with the newest stamp that is ready, and those that waited longer than the limit."""
        ready: Optional[T] = None
        for _, stamp_ns, scan in sorted(self._waiting, key=lambda waiting: -waiting[1]):
            if is_ready(scan):
                ready, self._newest_ns = scan, stamp_ns
                newer = [waiting for waiting in self._waiting if waiting[1] > stamp_ns]
                self.counts.superseded += len(self._waiting) - len(newer) - 1
                self._keep(newer)
                break
        given_up = [scan for arrival_s, _, scan in self._waiting if now_s - arrival_s > self.limit_s]
        self._keep([waiting for waiting in self._waiting if now_s - waiting[0] <= self.limit_s])
        self.counts.dropped_no_transform += len(given_up)
        return ready, given_up

    def restart(self) -> None:
        """Forget what waits and which stamps were used: time has jumped."""
        self.counts.dropped_no_transform += len(self._waiting)
        self._keep([])
        self._newest_ns = None

    def _keep(self, waiting: "List[Tuple[float, int, T]]") -> None:
        self.counts.waiting += len(waiting) - len(self._waiting)
        self._waiting = waiting
