"""A goal in the map that is delegated to move_base.

It is sent once move_base is there, cancelled while the driver has no scan, no odometry or no pose, and then sent
again. If move_base was killed or hangs, the goal ends after the patience of the driver.
"""

from __future__ import annotations

import math
import time
from typing import Callable, Optional, Protocol

import numpy as np

from glass_nav.driving.tasks import Ending, Moment
from glass_nav.vocabulary import DriverPhase, Outcome


class MoveBaseClient(Protocol):
    """The client of move_base's action, as far as the task needs it."""

    name: str  # of the action, for people

    @property
    def is_there(self) -> bool:
        """Whether the action server is connected."""

    def was_heard(self) -> bool:
        """Whether its status came since the last call."""

    def send(self, map_from_goal: np.ndarray, done: Callable[[Ending], None]) -> None:
        """Drive to that pose (3,); done may be called by another thread."""

    def cancel(self) -> None:
        """The goal that was sent last."""


class MoveBaseTask:
    """Sends one goal once move_base is there, and reports how that ends."""

    needs_pose, steers = True, False

    def __init__(self, move_base: MoveBaseClient, map_from_goal: np.ndarray, wait_s: float, patience_s: float) -> None:
        """
        Args:
            move_base: that drives.
            map_from_goal: (3,).
            wait_s: for the action server, by the wall clock.
            patience_s: without a status of the action server, by the time of the control steps.
        """
        self._move_base, self._goal = move_base, map_from_goal
        self._wait_s, self._patience_s, self._began_s = wait_s, patience_s, time.monotonic()
        self._sendings = 0  # an ending of an earlier one is no news
        self._is_sent = False
        self._silent_s = 0.0
        self._ended: Optional[Ending] = None  # written by the thread of the client
        self.remaining_m = math.nan
        self.ending: Optional[Ending] = None

    @property
    def phase(self) -> DriverPhase:
        return DriverPhase.GOING

    @property
    def reason(self) -> str:
        return f"{self._move_base.name} drives" if self._is_sent else f"waiting for {self._move_base.name}"

    def step(self, now: Moment) -> np.ndarray:
        """Zero: it does not steer."""
        if now.map_from_base is not None:
            self.remaining_m = float(np.hypot(*(self._goal[:2] - now.map_from_base[:2])))
        if self._is_sent:
            self._listen(now.dt_s)
        elif self._move_base.is_there:
            self._send()
        elif time.monotonic() - self._began_s > self._wait_s:
            self.ending = Ending(
                Outcome.NO_MOVE_BASE,
                f"no action server {self._move_base.name} within {self._wait_s:g} s: "
                "start move_base, or set ~backend to internal",
            )
        if self._ended is not None:
            self.ending = self._ended
        return np.zeros(3)

    def hold(self) -> None:
        """Cancel the goal until the next step()."""
        if self._is_sent and self._ended is None:
            self._is_sent = False
            self._sendings += 1
            self._began_s = time.monotonic()
            self._move_base.cancel()

    def cancel(self) -> None:
        if self._is_sent and self._ended is None:
            self._move_base.cancel()

    def _send(self) -> None:
        self._is_sent, self._silent_s = True, 0.0
        number = self._sendings = self._sendings + 1
        self._move_base.send(self._goal, lambda ending: self._done(number, ending))

    def _done(self, number: int, ending: Ending) -> None:
        if number == self._sendings:
            self._ended = ending

    def _listen(self, dt_s: float) -> None:
        self._silent_s = 0.0 if self._move_base.was_heard() else self._silent_s + dt_s
        if self._silent_s > self._patience_s:
            self.ending = Ending(
                Outcome.NO_MOVE_BASE,
                f"{self._move_base.name} is silent for {self._silent_s:.0f} s: move_base has ended or hangs",
            )
