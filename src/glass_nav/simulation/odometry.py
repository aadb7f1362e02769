"""Simulates wheel odometry: wrong radii, a wrong wheel base, slip.

The errors are those of Borenstein, Feng, Measurement and correction of systematic odometry errors in mobile robots
(1996): systematic ones, drawn once per robot, and others, drawn as it drives. Poses and twists as in robot.py.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from glass_nav.simulation.robot import moved

WHEEL_RADIUS_M = 0.1
JOINTS = ("left_wheel_joint", "right_wheel_joint")
SPIN_S = 0.2  # time until a slipping wheel regains its grip
DRAWS = 7  # random numbers per step, used or not: the events of one step do not change the others
LEAST_MOTION = (
    1e-12  # m, rad in a step; less is rounding, which differs between machines, and its square root would not be small
)


@dataclass(frozen=True)
class OdometryParams:
    """How wrong the wheels are, as standard deviations. With the defaults a drive of 30 m ends 1 to 3 % of its
    length from the truth, which is typical of a calibrated indoor robot.
    """

    wheel_base_m: float = 0.4
    wheel_radius_sigma: float = 0.008  # share, both wheels together: a floor's length, worn tyres
    wheel_mismatch_sigma: float = 0.0003  # share, one wheel against the other: bends what is straight
    wheel_base_sigma: float = 0.008  # share: turns are reported too large or too small
    slip_m_per_sqrt_m: float = 0.008  # along the path, and sideways for an omnidirectional base
    slip_rad_per_sqrt_m: float = 0.005
    slip_rad_per_sqrt_rad: float = 0.015
    slip_event_per_m: float = 0.01  # how often a wheel spins in place
    slip_event_max_m: float = 0.04  # how far at most

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if not 0.0 <= value < math.inf:
                raise ValueError(f"{field.name} of the odometry must be >= 0 and finite, got {value}")
        if self.wheel_base_m == 0.0:
            raise ValueError(f"wheel_base_m of the odometry must be > 0 m, got {self.wheel_base_m}")


EXACT = OdometryParams(0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Odometry:
    """Integrates what the wheels of one robot report; the frame odom is its start."""

    def __init__(self, p: OdometryParams, kind: str, rng: np.random.Generator) -> None:
        """
        Args:
            kind: of the base, "diff" or "omni".
            rng: draws this robot's wheels and everything that happens to them.
        """
        self._p, self._kind, self._rng = p, kind, rng
        radius, mismatch, base = rng.normal(size=3) * [p.wheel_radius_sigma, p.wheel_mismatch_sigma, p.wheel_base_sigma]
        forward, turn = 1.0 + radius, (1.0 + radius) / (1.0 + base)
        # (3, 3) twist reported for twist made. Diff: each wheel has its own radius; omni: three wheels, whose mismatch
        # skews forward motion to the left and back.
        half_m = 0.5 * p.wheel_base_m
        if kind == "diff":
            self._reported_by_made = np.array(
                [[forward, 0.0, mismatch * half_m], [0.0, 0.0, 0.0], [mismatch / half_m, 0.0, turn]]
            )
        else:
            self._reported_by_made = np.array(
                [[forward, mismatch, 0.0], [-mismatch, forward, 0.0], [mismatch / half_m, 0.0, turn]]
            )
        self.odom_from_base = np.zeros(3)
        self.rolled_m = np.zeros(2) if kind == "diff" else None  # (2,) as the left and the right wheel count it
        self.velocity = np.zeros(3)  # as reported: forward, left [m/s], turn [rad/s]
        self._spin, self._spin_left_s = np.zeros(3), 0.0  # velocity reported by a spinning wheel, and its time left

    def step(self, twist: np.ndarray, dt_s: float) -> None:
        """Add a twist (3,) that the base made in this time."""
        p = self._p
        draws = self._rng.random(DRAWS)
        normals = _normal(draws[:2], draws[2:4])  # 4 of them
        way_m, turn_rad = (
            motion if motion > LEAST_MOTION else 0.0 for motion in (math.hypot(*twist[:2]), abs(twist[2]))
        )
        reported = self._reported_by_made @ twist
        reported[0] += p.slip_m_per_sqrt_m * math.sqrt(way_m) * normals[0]
        if self._kind == "omni":
            reported[1] += p.slip_m_per_sqrt_m * math.sqrt(way_m) * normals[1]
        reported[2] += (
            p.slip_rad_per_sqrt_m * math.sqrt(way_m) * normals[2]
            + p.slip_rad_per_sqrt_rad * math.sqrt(turn_rad) * normals[3]
        )
        if draws[4] < p.slip_event_per_m * way_m:
            self._spin, self._spin_left_s = self._spinning(draws[5], draws[6]) / SPIN_S, SPIN_S
        spun_s = min(dt_s, self._spin_left_s)
        reported += spun_s * self._spin
        self._spin_left_s -= spun_s
        self.odom_from_base = moved(self.odom_from_base, reported)
        if self.rolled_m is not None:
            half_m = 0.5 * p.wheel_base_m * reported[2]
            self.rolled_m = self.rolled_m + [reported[0] - half_m, reported[0] + half_m]
        self.velocity = reported / dt_s

    def _spinning(self, how_far: float, which: float) -> np.ndarray:
        """(3,) reported by one wheel that spins in place; both draws are in [0, 1)."""
        extra_m = self._p.slip_event_max_m * how_far
        turn = math.copysign(extra_m / self._p.wheel_base_m, which - 0.5)
        if self._kind == "diff":
            return np.array([0.5 * extra_m, 0.0, turn])
        direction = 2.0 * math.pi * which
        return np.array([0.5 * extra_m * math.cos(direction), 0.5 * extra_m * math.sin(direction), turn])


def _normal(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """2 N normal numbers from 2 N uniform ones (Box, Muller, 1958): a fixed number of draws, equal in every numpy."""
    radius = np.sqrt(-2.0 * np.log1p(-a))
    return np.concatenate([radius * np.cos(2.0 * np.pi * b), radius * np.sin(2.0 * np.pi * b)])
