"""Compares a smoothed trajectory with the filter and with the ground truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict

from glass_nav.evaluation.metrics import pose_errors
from glass_nav.evaluation.metrics.pose_errors import PoseErrors
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.geometry.trajectory import Trajectory


@dataclass(frozen=True)
class SmoothedScore:
    """How far apart they are, at each scan."""

    filter_off: PoseErrors  # of the filter's poses from the smoothed ones
    smoothed_off: PoseErrors  # of the smoothed poses from the ground truth

    def metrics(self) -> Dict[str, Any]:
        """The figures under `smoothed` of metrics.json."""
        return {
            "filter_from_smoothed": pose_errors.summary(self.filter_off),
            "smoothed_from_truth": pose_errors.summary(self.smoothed_off),
        }


def of(smoothed: Trajectory, result: ReplayResult) -> SmoothedScore:
    """The scores of a replay.

    Args:
        smoothed: map_from_base of the same scans.
        result: the filter's poses, and the ground truth if there is one.
    """
    return SmoothedScore(
        pose_errors.of(result.stamps_ns, result.map_from_base, smoothed),
        pose_errors.of(smoothed.stamps_ns, smoothed.poses, result.reference),
    )
