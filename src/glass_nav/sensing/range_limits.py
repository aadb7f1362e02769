"""The longest range of a lidar: its range_max, or what its scans show if the driver sets no limit.

pointcloud_to_laserscan writes range_max inf by default, other drivers the largest float. B beams.
"""

from __future__ import annotations

from typing import Dict

import numpy as np

FARTHEST_M = 500.0  # no 2D lidar sees farther: a larger range_max is no limit, a larger range no range
_BEYOND_M = 0.01  # added to the longest range seen, which itself is an answer


def is_open(range_max_m: float) -> bool:
    """Whether a range_max limits nothing. NaN and those <= 0 are not open but wrong: scan_from_fields() rejects them."""
    return range_max_m > FARTHEST_M


def warning(lidar: str, range_max_m: float) -> str:
    """The line on an open range_max."""
    return (
        f"range_max of lidar {lidar!r} is {range_max_m:g} m, which is no limit: the longest range seen so far is used "
        "instead; set range_max in its driver, or laser_max_range"
    )


class RangeLimits:
    """A finite range_max for every lidar, by its frame. Remembers the longest range of those that set none."""

    def __init__(self, laser_max_range_m: float = -1.0) -> None:
        """
        Args:
            laser_max_range_m: used where a lidar sets no limit; < 0: not given.
        """
        self._given_m = laser_max_range_m
        self._longest_m: Dict[str, float] = {}

    def use(self, laser_max_range_m: float) -> None:
        """Use another laser_max_range from now on; the ranges seen are kept."""
        self._given_m = laser_max_range_m

    def is_assumed(self, range_max_m: float) -> bool:
        """Whether range_max_m() answers by what was seen."""
        return is_open(range_max_m) and not 0.0 < self._given_m <= FARTHEST_M

    def range_max_m(self, lidar: str, range_max_m: float, range_min_m: float, ranges_m: np.ndarray) -> float:
        """The limit of one scan [m].

        Args:
            lidar: its frame.
            range_max_m, range_min_m: as the driver wrote them.
            ranges_m: (B,) as the driver wrote them.

        Returns:
            range_max_m where that is a limit, else laser_max_range, else the longest range that this lidar has shown.
        """
        if not is_open(range_max_m):
            return range_max_m
        if not self.is_assumed(range_max_m):
            return self._given_m
        ranges_m = np.asarray(ranges_m, float)
        with np.errstate(invalid="ignore"):
            longest_m = float(np.max(ranges_m[ranges_m <= FARTHEST_M], initial=0.0))
        self._longest_m[lidar] = longest_m = max(longest_m, self._longest_m.get(lidar, 0.0))
        return max(longest_m, range_min_m if np.isfinite(range_min_m) else 0.0) + _BEYOND_M
