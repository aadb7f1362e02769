"""Progress of a long job: a bar on a terminal, a line every few seconds elsewhere. Writes to stderr only."""

from __future__ import annotations

import sys
import time
from typing import Optional, TextIO

BAR_PERIOD_S, LINE_PERIOD_S = 0.1, 10.0
WIDTH = 30


class Progress:
    """Counts `total` things; step() once each, finish() at the end."""

    def __init__(self, what: str, total: int, stream: Optional[TextIO] = None, unit: str = "scans") -> None:
        self._what, self._total, self._unit = what, total, unit
        self._stream = sys.stderr if stream is None else stream
        self._tty = self._stream.isatty()
        self._start = self._shown = time.monotonic()
        self._done = 0

    def step(self, count: int = 1) -> None:
        """Adds steps that are done."""
        self._done += count
        now = time.monotonic()
        if now - self._shown >= (BAR_PERIOD_S if self._tty else LINE_PERIOD_S):
            self._shown = now
            self._show(now)

    def finish(self) -> None:
        """Ends the progress, complete or not; closes the line of a bar."""
        if self._tty:
            self._show(time.monotonic())
            self._stream.write("\n")
            self._stream.flush()

    def _show(self, now: float) -> None:
        share = min(self._done / self._total, 1.0) if self._total else 1.0
        left = (now - self._start) * (1.0 - share) / share if share else 0.0
        text = f"{self._what}: {self._done} of {self._total} {self._unit}, {clock(left)} left"
        if self._tty:
            filled = int(WIDTH * share)
            self._stream.write(f"\r[{'#' * filled}{'.' * (WIDTH - filled)}] {text}\x1b[K")
        else:
            self._stream.write(text + "\n")
        self._stream.flush()


def clock(seconds: float) -> str:
    """75.2 -> 1:15."""
    whole = int(round(seconds))
    hours, rest = divmod(whole, 3600)
    minutes, rest = divmod(rest, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
