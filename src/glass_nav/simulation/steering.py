"""Steers the simulated robot by cmd_vel or a path, and decides when its time advances."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.simulation.path_follower import PathFollower

COMMAND_TIMEOUT_NS = 500_000_000  # a robot without commands for this long stops
DRIVER_LAG_NS = 200_000_000  # a driver whose last command to move is older than this does not keep up
START_WAIT_S = 30.0  # for the localization's first answer; then the path begins without it
BEHIND_S = 1.0  # behind the wall clock: longer delays are not caught up

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Audience:
    """The localization that the robot waits for."""

    answers: int  # received transforms map -> odom
    listeners: int  # to its scans
    waited_s: float  # since the start, by the wall clock


class Steering:
    """A fresh command takes precedence over the path; a path begins once there is a subscriber."""

    def __init__(self, follower: Optional[PathFollower], repeat: bool, wait_for_answer: bool) -> None:
        """
        Args:
            follower: of the path, None: commands only.
            repeat: drive back and forth along the path forever.
            wait_for_answer: a listener must have answered with its pose.
        """
        self._follower, self._repeat, self._wait_for_answer = follower, repeat, wait_for_answer
        self._command, self._command_until_ns = np.zeros(3), 0
        self._given_up = False  # waiting for the command that comes after the present one
        self._driving = False

    @property
    def waits(self) -> bool:
        """Whether there is a path that has not begun."""
        return self._follower is not None and not self._driving

    def take(self, velocity: np.ndarray, stamp_ns: int) -> None:
        """A command (3,) at a simulated time."""
        self._command, self._command_until_ns = velocity, stamp_ns + COMMAND_TIMEOUT_NS
        self._given_up = False

    def is_overdue(self, stamp_ns: int) -> bool:
        """Whether the robot moves by a command that is older than a driver that keeps up lets it become."""
        command_ns = self._command_until_ns - COMMAND_TIMEOUT_NS
        return not self._given_up and bool(np.any(self._command)) and stamp_ns - command_ns >= DRIVER_LAG_NS

    def give_up_waiting(self) -> None:
        """Nothing is overdue until there is another command: the driver has stopped sending them."""
        self._given_up = True

    def velocity(self, stamp_ns: int, map_from_base: np.ndarray, audience: Audience) -> np.ndarray:
        """(3,) wanted now."""
        if stamp_ns < self._command_until_ns:
            return self._command
        if self._follower is None or not self._may_drive(self._follower, audience):
            return np.zeros(3)
        if self._follower.done and self._repeat:
            self._follower = self._follower.back()
        return self._follower.command(map_from_base)

    def _may_drive(self, follower: PathFollower, audience: Audience) -> bool:
        """False until there are listeners, which would miss the start of the drive."""
        if self._driving:
            return True
        self._driving = audience.listeners > 0
        if self._wait_for_answer:
            overdue = audience.waited_s > START_WAIT_S
            self._driving = audience.answers > 0 or overdue
            if overdue and not audience.answers:
                _log.warning(f"the path begins without a localization: no answer for {START_WAIT_S:g} s")
        if self._driving:
            _log.info(f"driving {follower.length_m:.1f} m")
        return self._driving


class Pace:
    """Simulated time against the wall clock."""

    def __init__(self, stamp_ns: int, now_s: float) -> None:
        self._stamp_ns, self._due_s = stamp_ns, now_s

    def wait_s(self, stamp_ns: int, factor: float, now_s: float) -> float:
        """How long to wait until that simulated time is due; negative: that much too late, and not caught up.

        Args:
            stamp_ns: simulated time.
            factor: simulated seconds per second; 0: as fast as possible.
            now_s: the wall clock.
        """
        if factor == 0.0:
            self._stamp_ns, self._due_s = stamp_ns, now_s
            return 0.0
        wait_s = self._due_s + (stamp_ns - self._stamp_ns) * 1e-9 / factor - now_s
        if wait_s >= -BEHIND_S:
            return max(wait_s, 0.0)
        self._due_s -= wait_s
        return wait_s
