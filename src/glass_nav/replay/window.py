"""The part of a log that is replayed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Iterable, Iterator, Optional

from glass_nav.recording.recording import Entry, Refusal


@dataclass(frozen=True)
class Window:
    """Which part of a log to replay."""

    start_s: float = 0.0  # from the first scan on
    duration_s: Optional[float] = None  # to the end
    every: int = 1  # 2: each second scan
    max_scans: Optional[int] = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.start_s < float("inf"):
            raise ValueError(f"--start must be >= 0 s, got {self.start_s}")
        if self.duration_s is not None and not self.duration_s > 0.0:
            raise ValueError(f"--duration must be > 0 s, got {self.duration_s}")
        if self.every < 1:
            raise ValueError(f"--every must be >= 1, got {self.every}")
        if self.max_scans is not None and self.max_scans < 1:
            raise ValueError(f"--max-scans must be >= 1, got {self.max_scans}")

    def expected(self, scan_count: int, log_s: Optional[float] = None) -> int:
        """About how many of `scan_count` scans in `log_s`: for a progress bar."""
        if log_s and (self.start_s > 0.0 or self.duration_s is not None):
            end_s = log_s if self.duration_s is None else min(self.start_s + self.duration_s, log_s)
            scan_count = math.ceil(scan_count * min(max(end_s - self.start_s, 0.0) / log_s, 1.0))
        count = -(-scan_count // self.every)
        return count if self.max_scans is None else min(count, self.max_scans)

    def of(self, entries: Iterable[Entry]) -> Iterator[Entry]:
        """The entries of that part; rejected scans within it are kept, to be counted."""
        first_ns: Optional[int] = None
        since_s = 0.0  # of the last scan that could be read: the stamp of a rejected one may be wrong
        seen = taken = 0
        for entry in entries:
            if isinstance(entry, Refusal):
                if since_s >= self.start_s:
                    yield entry
                continue
            first_ns = entry.scan.stamp_ns if first_ns is None else first_ns
            since_s = (entry.scan.stamp_ns - first_ns) * 1e-9
            if self.duration_s is not None and since_s > self.start_s + self.duration_s:
                return
            if since_s < self.start_s:
                continue
            seen += 1
            if (seen - 1) % self.every:
                continue
            taken += 1
            yield entry
            if taken == self.max_scans:
                return
