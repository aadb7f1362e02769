"""Recovery of a blocked robot: wait, back off, turn in place, next choice, abort. Each step can be cancelled.

A state machine without a clock of its own. After each step that may have changed the view of the robot, the drive is
tried again (RETRY). A drive that gets far enough resets the recovery. Velocities (3,) forward, left [m/s], turn
[rad/s]; poses (3,) odom_from_base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.geometry import angles, pure_pursuit

# what is going on
NONE = "NONE"  # nothing to recover from
WAIT = "WAIT"  # stands: people walk on
BACK_OFF = "BACK_OFF"  # a short distance back
TURN = "TURN"  # once round, to see what is there
RETRY = "RETRY"  # drive as before
NEXT_CHOICE = "NEXT_CHOICE"  # another path, if there is one
ABORT = "ABORT"  # nothing helped

LADDER = (WAIT, BACK_OFF, TURN, NEXT_CHOICE, ABORT)
MOVES = (WAIT, BACK_OFF, TURN)
STALL_TOLD_M = 0.4  # a base that was commanded to drive so far ...
STALL_MOVED_M = 0.1  # ... and did not come so far is held by something
STILL_S = 2.0  # a base that makes no progress for so long in a step cannot


@dataclass(frozen=True)
class RecoveryParams:
    """How much of each."""

    recovery_wait_s: float = 3.0
    recovery_back_off_m: float = 0.3
    recovery_speed_m_s: float = 0.1
    recovery_turn_rad: float = 2.0 * math.pi
    recovered_m: float = 0.5  # a drive that came so far forgets what was tried before

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            least = 0.0 if name in ("recovery_wait_s", "recovery_back_off_m", "recovery_turn_rad") else 1e-6
            if not least <= value < math.inf:
                raise ValueError(f"~{name} must be {'>=' if least == 0.0 else '>'} 0 and finite, got {value}")


@dataclass(frozen=True)
class Step:
    """The step to take now."""

    name: str
    command: np.ndarray  # (3,) wanted, by WAIT, BACK_OFF and TURN; else zero
    reason: str  # one sentence


class Stall:
    """Notices that the base makes no progress though it is commanded to: it stands at something that the lidar does not see."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """The robot is expected to move from now on."""
        self._from: Optional[np.ndarray] = None
        self._told_m = 0.0

    def is_on(self, last_command: np.ndarray, odom_from_base: np.ndarray, dt_s: float) -> bool:
        """Whether so much was commanded and so little came of it.

        Args:
            last_command: (3,) of the step that is over.
            odom_from_base: (3,) now.
            dt_s: how long it took.
        """
        here = np.asarray(odom_from_base, float)[:2]
        if self._from is None or float(np.hypot(*(here - self._from))) > STALL_MOVED_M:
            self._from, self._told_m = here, 0.0
        self._told_m += abs(float(last_command[0])) * dt_s
        return self._told_m > STALL_TOLD_M


class Recovery:
    """begin() when a drive is blocked, then step() at every control step until it says RETRY, NEXT_CHOICE or ABORT."""

    def __init__(self, p: RecoveryParams, limits: BaseLimits) -> None:
        self._p, self._limits = p, limits
        self.cancel()

    @property
    def is_on(self) -> bool:
        """A step is being made."""
        return self._step in MOVES

    def cancel(self) -> None:
        """Ends the recovery and forgets what was tried."""
        self._rung = -1
        self._step = NONE
        self._why = ""
        self._blocked_at: Optional[np.ndarray] = None
        self._from = self._last = np.zeros(3)
        self._spent_s = self._turned_rad = self._moved_s = 0.0

    def begin(self, why: str, odom_from_base: np.ndarray) -> None:
        """The drive is blocked, in words; the next rung of the ladder is tried."""
        if self._blocked_at is not None and self._away_m(self._blocked_at, odom_from_base) > self._p.recovered_m:
            self._rung = -1
        self._rung = min(self._rung + 1, len(LADDER) - 1)
        self._why, self._blocked_at = why, np.array(odom_from_base, float)
        self._enter(LADDER[self._rung], odom_from_base)

    def step(self, odom_from_base: np.ndarray, dt_s: float) -> Step:
        """The command of this control step, and why."""
        self._spent_s += dt_s
        self._turned_rad += abs(float(angles.wrap(odom_from_base[2] - self._last[2])))
        if self._away_m(self._last, odom_from_base) + abs(float(odom_from_base[2] - self._last[2])) > 1e-4:
            self._moved_s = self._spent_s
        self._last = np.array(odom_from_base, float)
        if self.is_on and self._is_over(odom_from_base):
            self._step = RETRY
        return Step(self._step, self._command(odom_from_base), self._reason())

    def no_other_choice(self) -> None:
        """NEXT_CHOICE cannot be done: the next begin() aborts."""
        self._rung = len(LADDER) - 2

    def _enter(self, name: str, odom_from_base: np.ndarray) -> None:
        self._step = name
        self._from = self._last = np.array(odom_from_base, float)
        self._spent_s = self._turned_rad = self._moved_s = 0.0

    def _is_over(self, odom_from_base: np.ndarray) -> bool:
        if self._step == WAIT:
            return self._spent_s >= self._p.recovery_wait_s
        if self._spent_s - self._moved_s > STILL_S:  # something stops this too
            return True
        if self._step == BACK_OFF:
            return self._away_m(self._from, odom_from_base) >= self._p.recovery_back_off_m
        return self._turned_rad >= self._p.recovery_turn_rad

    def _command(self, odom_from_base: np.ndarray) -> np.ndarray:
        if self._step == BACK_OFF:
            left_m = self._p.recovery_back_off_m - self._away_m(self._from, odom_from_base)
            speed = pure_pursuit.braking_speed(left_m, self._limits.max_acceleration_m_s2) + 0.02
            return np.array([-min(self._p.recovery_speed_m_s, self._limits.max_speed_m_s, speed), 0.0, 0.0])
        if self._step == TURN:
            return np.array([0.0, 0.0, 0.5 * self._limits.max_turn_rad_s])
        return np.zeros(3)

    def _reason(self) -> str:
        return {
            NONE: "nothing is in the way",
            RETRY: "tries to go on",
            ABORT: f"gives up: {self._why}",
            WAIT: f"waits: {self._why}",
            BACK_OFF: f"backs off: {self._why}",
            TURN: f"turns in place: {self._why}",
            NEXT_CHOICE: f"takes another way: {self._why}",
        }[self._step]

    @staticmethod
    def _away_m(first: np.ndarray, second: np.ndarray) -> float:
        return float(np.hypot(*(np.asarray(second)[:2] - np.asarray(first)[:2])))
