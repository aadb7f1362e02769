"""Scans of one or several lidars, from their arrival until they can be placed.

Lidars are distinguished by their frames, as in AMCL, whatever topics their scans come on. Of the scans of one lidar the
newest that has its transforms wins, so that its stamps only ascend. Times in seconds are of the clock that the caller
reads.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Dict, List, Optional, Set, Tuple

from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_placement import NoTransform, PlacedScan, RawScan, ScanPlacement, ScanTransforms

STALE_SCANS = 20  # that many older scans of one lidar in a row: its clock was set back
MAX_LIDARS = 16  # a driver that makes up a frame for every scan must not fill the memory
MAX_PERIOD_S = 5.0  # scans farther apart are a pause
GRACE_S = 5.0  # after the first scan: until then maps and transforms may still be on their way
MAX_WAITING = 100  # scans of one lidar
_WARNING_PERIOD_S, _FAULT_PERIOD_S, _ONCE_S = 5.0, 60.0, float("inf")  # between two warnings of a kind


@dataclass
class ScanCounts:
    """Numbers of scans since the start; received is the sum of the others."""

    received: int = 0
    used: int = 0  # counted by the caller
    refused: int = 0  # malformed, or a stamp that is not after the last one used
    superseded: int = 0  # a newer one was ready too: the lidar is faster than the node or tf
    dropped_no_transform: int = 0  # no transform at its stamp within the limit
    waiting: int = 0  # for their transforms, now


@dataclass(frozen=True)
class ReadyScan:
    """A scan that need not wait any longer."""

    raw: RawScan
    transforms: Optional[ScanTransforms] = None  # None: one of them is of no use, which place() says


class ScanQueue:
    """Decides which scans wait, are used, rejected or dropped; counts them and says why."""

    def __init__(
        self,
        placement: ScanPlacement,
        max_wait_s: float,
        now_s: float,
        warn: Callable[[str, float], None],
        grace_s: float = GRACE_S,
    ) -> None:
        """
        Args:
            placement: where the scans get their transforms.
            max_wait_s: a scan that lacks a transform for longer is dropped.
            now_s: the time.
            warn: called with a warning, and with the time [s] in which one of its kind is enough.
            grace_s: since the first scan; what is missing at the start is not warned about before.
        """
        self._placement, self._max_wait_s, self._warn = placement, max_wait_s, warn
        self._grace_s = grace_s
        self._first_arrival_s: Optional[float] = None
        self.last_arrival_s = now_s
        self._lidars: Dict[str, _Waiting] = {}
        self._usable: Set[str] = set()  # lidars that had a scan with its transforms
        self.counts = ScanCounts()
        self.trouble = "no scan used yet"  # why the last scan that was not used was not

    def use(self, placement: ScanPlacement, max_wait_s: float) -> None:
        """Use other parameters from now on."""
        self._placement, self._max_wait_s = placement, max_wait_s

    @property
    def lidars(self) -> List[str]:
        """Frames of the lidars whose scans could be used so far."""
        return sorted(self._usable)

    @property
    def period_s(self) -> Optional[float]:
        """Time from one scan to the next, of any lidar; None: not known yet."""
        periods_s = [self._lidars[lidar].period_s for lidar in self._usable]
        rate_hz = sum(1.0 / period_s for period_s in periods_s if period_s is not None)
        return 1.0 / rate_hz if rate_hz > 0.0 else None

    @property
    def is_waiting(self) -> bool:
        """Whether a scan waits for its transforms."""
        return self.counts.waiting > 0

    def add(self, raw: RawScan, now_s: float, unusable: Optional[str] = None) -> Optional[str]:
        """Let a scan wait for its transforms, unless it cannot be used at all.

        Args:
            raw: as it came.
            now_s: when it came.
            unusable: why no scan can be used now; None if one can.

        Returns:
            why restart() is due: the lidar's clock was set back; None if it is not.
        """
        self.counts.received += 1
        self.last_arrival_s = now_s
        if self._first_arrival_s is None:
            self._first_arrival_s = now_s
        if unusable is not None:
            self._refuse(unusable, quietly=self._is_starting(now_s))
            return None
        fault = self._fault(raw)
        if fault is not None:
            self.refuse(fault)
            return None
        waiting = self._lidars.setdefault(raw.lidar, _Waiting(self.counts))
        if not waiting.add(raw, now_s):
            self.refuse(f"its stamp {raw.stamp_ns * 1e-9:.3f} s is not after that of the last one used")
        if waiting.stale < STALE_SCANS:
            return None
        return f"the last {STALE_SCANS} scans are older than the one before them"

    def refuse(self, why: str) -> None:
        """Count a scan that is not used, and say why."""
        self._refuse(why, quietly=False)

    def take_ready(self, now_s: float) -> List[ReadyScan]:
        """The newest scan of each lidar that has its transforms, by ascending stamps."""
        ready: List[ReadyScan] = []
        for lidar, waiting in self._lidars.items():
            newest, dropped = waiting.take_ready(self._ready, now_s, self._max_wait_s)
            if dropped:
                self._say_dropped(dropped[-1], quietly=self._is_starting(now_s))
            if newest is not None:
                self._usable.add(lidar)
                ready.append(newest)
        return sorted(ready, key=lambda scan: scan.raw.stamp_ns)

    def place(self, ready: ReadyScan) -> PlacedScan:
        """A scan that is ready, with its transforms. ScanError if it cannot be used: refuse() it."""
        raw = ready.raw
        fault = self._placement.timing_fault(raw)
        if fault is not None:
            self._warn(f"scans are not deskewed: {fault}", _FAULT_PERIOD_S)
        no_limit = self._placement.range_fault(raw)
        if no_limit is not None:
            self._warn(no_limit, _ONCE_S)
        return self._placement.place(raw, ready.transforms)

    def restart(self, now_s: float) -> None:
        """Forget what waits and which stamps were used: time has jumped."""
        for waiting in self._lidars.values():
            waiting.drop_all()
        self._lidars, self._usable = {}, set()
        self.last_arrival_s, self._first_arrival_s = now_s, None

    def _is_starting(self, now_s: float) -> bool:
        """Whether no scan could be used yet, and it is too early for a warning."""
        first_s = now_s if self._first_arrival_s is None else self._first_arrival_s
        return not self._usable and now_s - first_s < self._grace_s

    def _refuse(self, why: str, quietly: bool) -> None:
        self.counts.refused += 1
        self.trouble = f"scan refused: {why}"
        if not quietly:
            self._warn(self.trouble, _WARNING_PERIOD_S)

    def _fault(self, raw: RawScan) -> Optional[str]:
        if raw.stamp_ns == 0:
            return "it has no stamp"
        if not raw.lidar:
            return "it has no frame_id"
        if not self._has_room_for(raw.lidar):
            return (
                f"its frame {raw.lidar!r} would be that of the lidar number {MAX_LIDARS + 1}, the most are {MAX_LIDARS}"
            )
        return None

    def _has_room_for(self, lidar: str) -> bool:
        """Drop lidars whose scans never had transforms if room is needed; whether there is room."""
        if lidar not in self._lidars and len(self._lidars) >= MAX_LIDARS:
            for name in set(self._lidars) - self._usable:
                self._lidars.pop(name).drop_all()
        return lidar in self._lidars or len(self._lidars) < MAX_LIDARS

    def _ready(self, raw: RawScan) -> Optional[ReadyScan]:
        """The scan with its transforms; None while it lacks one."""
        try:
            return ReadyScan(raw, self._placement.transforms(raw))
        except NoTransform:
            return None
        except ScanError:
            return ReadyScan(raw)

    def _say_dropped(self, raw: RawScan, quietly: bool) -> None:
        missing = self._placement.missing(raw)
        if missing is None:
            if quietly:
                return
            self._warn(f"scan dropped: its transforms came later than {self._max_wait_s:g} s", _WARNING_PERIOD_S)
            return
        self.trouble = missing
        if not quietly:
            self._warn(f"scan dropped after {self._max_wait_s:g} s: {missing}", _WARNING_PERIOD_S)


class _Waiting:
    """The scans of one lidar that wait."""

    def __init__(self, counts: ScanCounts) -> None:
        self._counts = counts  # shared by all lidars
        self._scans: List[Tuple[float, RawScan]] = []  # with their times of arrival
        self._last_used_ns: Optional[int] = None
        self._last_ns: Optional[int] = None
        self.stale = 0  # scans in a row that were not after the last one used
        self.period_s: Optional[float] = None  # from scan to scan, a running mean

    def add(self, raw: RawScan, now_s: float) -> bool:
        """False if its stamp is not after that of the last one taken."""
        if self._last_used_ns is not None and raw.stamp_ns <= self._last_used_ns:
            self.stale += 1
            return False
        self.stale = 0
        self._learn_period(raw.stamp_ns)
        scans = [*self._scans, (now_s, raw)]
        self._counts.dropped_no_transform += max(len(scans) - MAX_WAITING, 0)
        self._keep(scans[-MAX_WAITING:])
        return True

    def take_ready(
        self, ready_or_none: Callable[[RawScan], Optional[ReadyScan]], now_s: float, max_wait_s: float
    ) -> "Tuple[Optional[ReadyScan], List[RawScan]]":
        """The scan with the newest stamp that is ready, and those that waited longer than the limit."""
        newest_first = sorted(self._scans, key=_newest_first)
        ready = next(filter(None, (ready_or_none(raw) for _, raw in newest_first)), None)
        if ready is not None:
            used_ns = self._last_used_ns = ready.raw.stamp_ns
            newer = [(arrival_s, raw) for arrival_s, raw in self._scans if raw.stamp_ns > used_ns]
            self._counts.superseded += len(self._scans) - len(newer) - 1
            self._keep(newer)
        dropped = [raw for arrival_s, raw in self._scans if now_s - arrival_s > max_wait_s]
        self._counts.dropped_no_transform += len(dropped)
        self._keep([(arrival_s, raw) for arrival_s, raw in self._scans if now_s - arrival_s <= max_wait_s])
        return ready, dropped

    def drop_all(self) -> None:
        self._counts.dropped_no_transform += len(self._scans)
        self._keep([])

    def _keep(self, scans: "List[Tuple[float, RawScan]]") -> None:
        self._counts.waiting += len(scans) - len(self._scans)
        self._scans = scans

    def _learn_period(self, stamp_ns: int) -> None:
        apart_s = 0.0 if self._last_ns is None else (stamp_ns - self._last_ns) * 1e-9
        self._last_ns = stamp_ns
        if 0.0 < apart_s < MAX_PERIOD_S:
            self.period_s = 0.9 * (self.period_s or apart_s) + 0.1 * apart_s


def _newest_first(waiting: "Tuple[float, RawScan]") -> int:
    return -waiting[1].stamp_ns
