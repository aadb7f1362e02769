"""Simulates a base on a floor with obstacles: two driven wheels, or omnidirectional.

Poses (3,) x [m], y [m], yaw [rad] in the frame map. Velocities (3,) forward, left [m/s], turn [rad/s] in the robot's
own frame (REP 103). A twist (3,) is a velocity times a time: forward, left [m], turn [rad] along one arc.
S segments.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Tuple

import numpy as np

KINDS = ("diff", "omni")
BISECTIONS = 20  # of the path to a contact: to below a micrometre


@dataclass(frozen=True)
class RobotParams:
    """Limits of the base. The defaults suit a slow indoor robot of 50 kg."""

    kind: str = "diff"  # "diff": two driven wheels, never sideways; "omni": any direction
    radius_m: float = 0.22  # of the round outline that stops at obstacles
    max_speed_m_s: float = 1.0
    max_turn_rad_s: float = 1.5
    max_acceleration_m_s2: float = 0.8
    max_turn_acceleration_rad_s2: float = 3.0
    braking_factor: float = 1.0  # deceleration over acceleration

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"robot must be {' or '.join(KINDS)}, got {self.kind!r}")
        for name in (
            "radius_m",
            "max_speed_m_s",
            "max_turn_rad_s",
            "max_acceleration_m_s2",
            "max_turn_acceleration_rad_s2",
            "braking_factor",
        ):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} of the robot must be > 0 and finite, got {getattr(self, name)}")


class Obstacles:
    """Obstacles on the floor as segments: how near is the nearest?"""

    def __init__(self, segments_m: np.ndarray) -> None:
        """
        Args:
            segments_m: (S, 2, 2) both ends of each segment, in the frame map; S may be 0.
        """
        segments_m = np.asarray(segments_m, float).reshape(-1, 2, 2)
        self._start_m = segments_m[:, 0]
        self._along_m = segments_m[:, 1] - segments_m[:, 0]
        self._length2 = np.maximum((self._along_m**2).sum(axis=1), 1e-12)  # a point counts as a short segment

    def clearance(self, point_m: np.ndarray) -> float:
        """Distance [m] from a point (2,) to the nearest segment, inf where there is none."""
        if not len(self._start_m):
            return math.inf
        offset = point_m - self._start_m
        share = np.minimum(np.maximum((offset * self._along_m).sum(axis=1) / self._length2, 0.0), 1.0)
        gap = offset - share[:, None] * self._along_m
        return math.sqrt(float((gap * gap).sum(axis=1).min()))


def arc(twist: np.ndarray) -> np.ndarray:
    """(3,) pose after a twist, seen from the pose before it: x = v sin(w)/w and so on, exact for any turn w.

    The exponential map of the plane's rigid motions; Thrun, Burgard, Fox, Probabilistic Robotics (2005), eq. 5.9,
    with sideways motion.
    """
    forward, left, turn = twist.tolist()
    if abs(turn) < 1e-6:  # the series: 1 - cos(w) loses all its digits there
        along, across = 1.0 - turn * turn / 6.0, turn / 2.0
    else:
        along, across = math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn
    return np.array([along * forward - across * left, across * forward + along * left, turn])


def moved(pose: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """(3,) pose after a twist: compose(pose, arc(twist)), for one pose, without numpy: five times as fast."""
    x, y, yaw = pose.tolist()
    ahead, aside, turn = arc(twist).tolist()
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.array(
        [
            x + cos * ahead - sin * aside,
            y + sin * ahead + cos * aside,
            (yaw + turn + math.pi) % (2.0 * math.pi) - math.pi,
        ]
    )


class Robot:
    """A base that takes commands: its pose, its velocity, and whether an obstacle blocks it."""

    def __init__(self, params: RobotParams, map_from_base: np.ndarray, obstacles: Obstacles) -> None:
        self.params = params
        self.map_from_base = np.array(map_from_base, float)  # (3,)
        self.velocity = np.zeros(3)
        self.blocked = False  # the last step ended at an obstacle
        self._obstacles = obstacles
        self._room_m = 0.0  # lower bound of the distance to the nearest obstacle

    @property
    def standing(self) -> bool:
        return not self.velocity.any()

    def step(self, command: np.ndarray, dt_s: float) -> np.ndarray:
        """Move for a given time.

        Args:
            command: (3,) wanted velocity; beyond the base's limits it gets as close as possible.
            dt_s: short: within it the velocity changes linearly, and the path is the arc of its mean.

        Returns:
            (3,) twist that the base made, up to the obstacle if there is one in the way.

        Raises:
            ValueError: the command is not finite.
        """
        if not np.all(np.isfinite(command)):
            raise ValueError(f"a velocity command must be finite, got {np.asarray(command).tolist()}")
        before = self.velocity
        self.velocity, mean = self._accelerated(np.asarray(command, float), dt_s)
        self.blocked = False
        parts = max(1, math.ceil(math.hypot(mean[0], mean[1]) * dt_s / (0.5 * self.params.radius_m)))  # no jump over
        made = np.zeros(3)
        for _ in range(parts):  # each at the mean velocity, along one arc: their twists add up
            twist = mean * (dt_s / parts)
            share = self._free_share(twist)
            made = made + share * twist
            self.map_from_base = moved(self.map_from_base, share * twist)
            if share < 1.0:
                self.blocked, self.velocity = True, np.zeros_like(before)
                break
        return made

    def _accelerated(self, command: np.ndarray, dt_s: float) -> "Tuple[np.ndarray, np.ndarray]":
        """Velocity at the end of the step and its mean over the step: a ramp up to the commanded velocity."""
        p = self.params
        wanted = command.copy()
        if p.kind == "diff":
            wanted[1] = 0.0
        wanted[:2] *= min(1.0, p.max_speed_m_s / max(math.hypot(wanted[0], wanted[1]), 1e-12))
        wanted[2] = min(max(wanted[2], -p.max_turn_rad_s), p.max_turn_rad_s)
        change = wanted - self.velocity
        slower = (
            math.hypot(wanted[0], wanted[1]) < math.hypot(self.velocity[0], self.velocity[1]),
            abs(wanted[2]) < abs(self.velocity[2]),
        )
        brakes = [p.braking_factor if each else 1.0 for each in slower]
        ramps_s = np.array(
            [math.hypot(change[0], change[1]) / (brakes[0] * p.max_acceleration_m_s2)] * 2
            + [abs(change[2]) / (brakes[1] * p.max_turn_acceleration_rad_s2)]
        )
        share = np.minimum(dt_s / np.maximum(ramps_s, 1e-12), 1.0)  # of the wanted change that is reached
        end = np.where(share < 1.0, self.velocity + share * change, wanted)
        mean = end - 0.5 * share * change * np.minimum(ramps_s / dt_s, 1.0)
        return end, mean

    def _free_share(self, twist: np.ndarray) -> float:
        """Share of the twist that can be driven before the base touches an obstacle; 1: all of it."""
        self._room_m -= math.hypot(twist[0], twist[1])
        if self._room_m >= self.params.radius_m:
            return 1.0

        def clearance(share: float) -> float:
            return self._obstacles.clearance(moved(self.map_from_base, share * twist)[:2])

        allowed = min(self.params.radius_m, clearance(0.0))  # it may always move away, and turn in place
        self._room_m = clearance(1.0)
        if self._room_m >= allowed - 1e-9:
            return 1.0
        self._room_m = 0.0
        free, hit = 0.0, 1.0
        for _ in range(BISECTIONS):
            middle = 0.5 * (free + hit)
            free, hit = (middle, hit) if clearance(middle) >= allowed else (free, middle)
        return free
