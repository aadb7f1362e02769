"""Odometry from encoder counts of two wheels: odom_from_base at any recorded time.

The odometry of bases that send no tf (`wheel_topics`), by equations (2) to (4) of the glass document
(geometry/wheel_steps.py). Both wheels may report at different times: each is interpolated to the stamps of the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.geometry import wheel_steps
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.params import number
from glass_nav.sensing.scan_placement import NoTransform

KEPT_NS = 30_000_000_000  # of the past
SLACK_NS = 100_000_000  # a base that does not report for a beat has not stopped: as for tf in a bag
MAX_SPEED_M_S = 20.0  # of a wheel; faster counts are those of encoders that were set to zero
_WRAPS = {"Int8": 2**8, "UInt8": 2**8, "Int16": 2**16, "UInt16": 2**16, "Int32": 2**32, "UInt32": 2**32}


@dataclass(frozen=True)
class WheelParams:
    """Which messages hold the counts, and what a count is worth."""

    wheel_topics: Tuple[str, ...] = ()  # empty: odometry from tf. One: a JointState or two numbers; two: left, right
    wheel_joints: Tuple[str, ...] = ("left_wheel_joint", "right_wheel_joint")  # left, right, in a JointState
    wheel_left_scale_m: float = number(0.1, -100.0, 100.0)  # distance for each unit: the radius, or that of a tick
    wheel_right_scale_m: float = number(0.1, -100.0, 100.0)  # negative: the encoder counts backwards

    def __post_init__(self) -> None:
        if len(self.wheel_topics) > 2 or len(set(self.wheel_topics)) < len(self.wheel_topics):
            raise ValueError(f"~wheel_topics must be one topic, or two: left, right; got {list(self.wheel_topics)}")
        if not all(self.wheel_topics):
            raise ValueError(f"~wheel_topics must name topics, got {list(self.wheel_topics)}")
        if len(set(self.wheel_joints)) != 2:
            raise ValueError(f"~wheel_joints must be the joints of the left and the right wheel, got {self._joints}")
        for name in ("wheel_left_scale_m", "wheel_right_scale_m"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) != 0.0):
                raise ValueError(f"~{name} must be finite and not 0, got {getattr(self, name)}")

    @property
    def _joints(self) -> List[str]:
        return list(self.wheel_joints)


@dataclass(frozen=True)
class Counts:
    """The encoder counts in one message; None: none."""

    left: Optional[float]
    right: Optional[float]


def counts(message: Any, topic_number: int, p: WheelParams) -> Counts:
    """The counts in a message of rospy or of a bag, as duck typing tells it.

    Args:
        message: JointState (name, position), an array of two numbers (data), or one number (data).
        topic_number: of its topic in wheel_topics, from 0.
        p: names of the joints, and the topics.

    Raises:
        ValueError: it is none of these; what it is and what is allowed.
    """
    if hasattr(message, "position") and hasattr(message, "name"):
        found = dict(zip(message.name, message.position))
        return Counts(*(None if found.get(joint) is None else float(found[joint]) for joint in p.wheel_joints))
    data: Any = getattr(message, "data", None)
    kind = type(message).__name__.split("__")[-1]
    if np.ndim(data) == 1 and len(data) == 2 and len(p.wheel_topics) == 1:
        return Counts(float(data[0]), float(data[1]))
    if np.ndim(data) == 0 and isinstance(data, (int, float, np.number)) and len(p.wheel_topics) == 2:
        return Counts(float(data), None) if topic_number == 0 else Counts(None, float(data))
    raise ValueError(
        f"{p.wheel_topics[topic_number]}: a {kind} holds no counts of wheels: allowed are a JointState or an array of "
        "two numbers, or two topics with a number each"
    )


def wraps_at(kind: str) -> int:
    """Counts after which an encoder of that message type starts over ("std_msgs/Int16"); 0: never."""
    return _WRAPS.get(kind.split("/")[-1].replace("MultiArray", ""), 0)


@dataclass
class _Wheel:
    """Distance rolled by one wheel, from its counts."""

    scale_m: float
    stamps_ns: List[int] = field(default_factory=list)
    rolled_m: List[float] = field(default_factory=list)  # since the first count
    last: float = 0.0
    resets: int = 0  # of its encoder

    def add(self, stamp_ns: int, count: float, wraps: int) -> None:
        if not np.isfinite(count) or (self.stamps_ns and stamp_ns <= self.stamps_ns[-1]):
            return
        change = 0.0 if not self.stamps_ns else count - self.last
        if wraps:
            change = (change + 0.5 * wraps) % wraps - 0.5 * wraps
        moved_m = change * self.scale_m
        if self.stamps_ns and abs(moved_m) > MAX_SPEED_M_S * (stamp_ns - self.stamps_ns[-1]) * 1e-9:
            moved_m, self.resets = 0.0, self.resets + 1
        self.last = count
        self.stamps_ns.append(stamp_ns)
        self.rolled_m.append((self.rolled_m[-1] if self.rolled_m else 0.0) + moved_m)

    def forget(self, before_ns: int) -> None:
        """Counts that no later step needs; the last one before stays."""
        keep = max(int(np.searchsorted(self.stamps_ns, before_ns, side="right")) - 1, 0)
        del self.stamps_ns[:keep], self.rolled_m[:keep]


class WheelOdometry:
    """Adds up the counts of both wheels; the frame odom is the pose at the first of them."""

    def __init__(self, p: WheelParams, wheel_base_m: float, kept_ns: Optional[int] = KEPT_NS) -> None:
        """
        Args:
            p: what a count is worth.
            wheel_base_m: between the wheels.
            kept_ns: how long poses are remembered; None: for ever, as for a recording.
        """
        self._p, self.wheel_base_m, self._kept_ns = p, wheel_base_m, kept_ns
        self.restart()

    def restart(self) -> None:
        """Start anew: time has jumped."""
        self._wheels = _Wheel(self._p.wheel_left_scale_m), _Wheel(self._p.wheel_right_scale_m)
        self._trajectory = Trajectory(np.zeros(0, np.int64), np.zeros((0, 3)))

    @property
    def trajectory(self) -> Trajectory:
        """odom_from_base, as far as it is remembered."""
        return self._trajectory

    @property
    def resets(self) -> Tuple[int, int]:
        """How often the encoders of the left and the right wheel started over."""
        return self._wheels[0].resets, self._wheels[1].resets

    def add(self, stamp_ns: int, told: Counts, wraps: int = 0) -> np.ndarray:
        """Take in a message.

        Args:
            stamp_ns: of it; one that is not after the last of a wheel is left out.
            told: the counts.
            wraps: see wraps_at().

        Returns:
            (K,) stamps of the poses that this adds, mostly one.
        """
        for wheel, count in zip(self._wheels, (told.left, told.right)):
            if count is not None:
                wheel.add(stamp_ns, count, wraps)
        return self._advance()

    def add_all(self, stamps_ns: Sequence[int], told: Sequence[Counts], wraps: Sequence[int]) -> None:
        """Take in the messages of a recording at once, each as add() does."""
        for stamp_ns, each, wrap in zip(stamps_ns, told, wraps):
            for wheel, count in zip(self._wheels, (each.left, each.right)):
                if count is not None:
                    wheel.add(int(stamp_ns), count, wrap)
        self._advance()

    def odom_from_base(self, stamp_ns: int) -> np.ndarray:
        """(3,) at that time; NoTransform if the wheels did not tell it."""
        if not self._trajectory.covers(np.int64(stamp_ns), SLACK_NS if self._kept_ns is None else 0):
            topics = " and ".join(self._p.wheel_topics)
            raise NoTransform(f"no counts of both wheels on {topics} at {stamp_ns * 1e-9:.3f} s")
        return self._trajectory.at(np.int64(stamp_ns))

    def _advance(self) -> np.ndarray:
        """Add poses up to the last time that both wheels have reported."""
        left, right = self._wheels
        if not (left.stamps_ns and right.stamps_ns):
            return np.zeros(0, np.int64)
        known = self._trajectory
        first_ns = max(left.stamps_ns[0], right.stamps_ns[0]) if not len(known) else int(known.stamps_ns[-1])
        knots_ns = np.unique(np.array(left.stamps_ns + right.stamps_ns, np.int64))
        knots_ns = knots_ns[(knots_ns > first_ns) & (knots_ns <= min(left.stamps_ns[-1], right.stamps_ns[-1]))]
        at_ns = np.append(np.int64(first_ns), knots_ns)
        increments = [np.diff(np.interp(at_ns - first_ns, *_since(wheel, first_ns))) for wheel in (left, right)]
        start = known.poses[-1] if len(known) else np.zeros(3)
        poses = wheel_steps.followed(start, increments[0], increments[1], self.wheel_base_m)
        if not len(known):
            if min(left.stamps_ns[-1], right.stamps_ns[-1]) < first_ns:
                return np.zeros(0, np.int64)
            known = Trajectory(at_ns[:1], start[None])
        oldest_ns = 0 if self._kept_ns is None else int(at_ns[-1]) - self._kept_ns
        keep = known.stamps_ns >= oldest_ns
        self._trajectory = Trajectory(
            np.concatenate([known.stamps_ns[keep], knots_ns]), np.concatenate([known.poses[keep], poses])
        )
        for wheel in (left, right):
            wheel.forget(int(at_ns[-1]))
        return knots_ns


def _since(wheel: _Wheel, first_ns: int) -> Tuple[np.ndarray, np.ndarray]:
    """Stamps [ns] relative to a time, exact as floats, and the distances rolled until then [m]."""
    return np.array(wheel.stamps_ns, np.int64) - first_ns, np.array(wheel.rolled_m)
