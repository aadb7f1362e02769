"""When the driver seeks a meetpoint by itself: at the start, for a waiting search, after an edge that led nowhere."""

from __future__ import annotations


class SeekPolicy:
    """Decides whether to seek a meetpoint, with a limited number of attempts in a row."""

    def __init__(self, attempts: int) -> None:
        """
        Args:
            attempts: tasks of the search that may fail in a row, >= 1; then it is for others to go on.
        """
        self._attempts = attempts
        self.reset()

    def reset(self) -> None:
        """Starts over."""
        self._sought = False
        self._failures = 0

    @property
    def sought(self) -> bool:
        """Whether it has been sought since the start."""
        return self._sought

    def seeks(self) -> None:
        """The robot is on its way to a meetpoint."""
        self._sought = True

    def fails(self) -> None:
        """The task of the search, or the drive to a meetpoint, failed."""
        self._failures += 1

    def succeeds(self) -> None:
        """The robot arrived, or a new search was requested: earlier failures do not count."""
        self._failures = 0

    def leave_to_others(self) -> None:
        """A task with another origin failed: its client continues, or succeeds() is called."""
        self._failures = self._attempts

    def is_due(self, waits: bool, searching: bool) -> bool:
        """Whether to seek now, while the robot is not at a meetpoint and nothing is on.

        Args:
            waits: a search waits for a meetpoint.
            searching: one has begun and has not ended.
        """
        return self._failures < self._attempts and (not self._sought or waits or (searching and self._failures > 0))
