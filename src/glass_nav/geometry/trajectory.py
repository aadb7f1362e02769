"""A path of stamped planar poses, and its pose between two stamps.

N poses; stamps in integer nanoseconds, because a float in seconds resolves only 0.2 microseconds today.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from glass_nav.geometry import angles

if TYPE_CHECKING:
    from numpy.typing import ArrayLike  # numpy 1.20; Noetic has 1.17


@dataclass(frozen=True)
class Trajectory:
    """Poses of one frame in another, by ascending time."""

    stamps_ns: np.ndarray  # (N,) int64, strictly ascending
    poses: np.ndarray  # (N, 3) x [m], y [m], yaw [rad]

    def __post_init__(self) -> None:
        if self.poses.shape != (len(self.stamps_ns), 3):
            raise ValueError(
                f"expected stamps_ns (N,) and poses (N, 3), got {self.stamps_ns.shape} and {self.poses.shape}"
            )
        if not np.all(np.diff(self.stamps_ns) > 0):
            raise ValueError("stamps of a trajectory must ascend")

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def covers(self, stamp_ns: ArrayLike, slack_ns: int = 0) -> np.ndarray:
        """Whether a pose at that time follows without extrapolating by more than slack_ns."""
        if not len(self):
            return np.zeros(np.shape(stamp_ns), bool)
        stamp_ns = np.asarray(stamp_ns)
        return (stamp_ns >= self.stamps_ns[0] - slack_ns) & (stamp_ns <= self.stamps_ns[-1] + slack_ns)

    def at(self, stamp_ns: ArrayLike) -> np.ndarray:
        """Poses (..., 3) at stamps (...), linear in x and y, and by the shorter turn in yaw.

        Outside the recorded time the pose of the nearest end is returned; check covers() first.
        """
        if not len(self):
            raise ValueError("an empty trajectory has no pose")
        stamp_ns = np.asarray(stamp_ns)
        after = np.clip(np.searchsorted(self.stamps_ns, stamp_ns), 1, max(len(self) - 1, 1))
        after = np.minimum(after, len(self) - 1)
        before = np.maximum(after - 1, 0)
        span = np.maximum(self.stamps_ns[after] - self.stamps_ns[before], 1)
        share = np.clip((stamp_ns - self.stamps_ns[before]) / span, 0.0, 1.0)[..., None]
        step = self.poses[after] - self.poses[before]
        step[..., 2] = angles.wrap(step[..., 2])
        pose = self.poses[before] + share * step
        pose[..., 2] = angles.wrap(pose[..., 2])
        return pose
