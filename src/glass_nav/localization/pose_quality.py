"""Is it lost?  The filter's own signs -> a state and a reason in words.

Covariance alone does not tell: a filter that settled in the wrong corridor is sure of itself. What
tells is how much of the scan the map explains at the pose, over several scans.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav.localization.pose_estimate import PoseEstimate

UNKNOWN, GLOBAL_SEARCH, LOCALIZED, UNCERTAIN, LOST = (
    "UNKNOWN", "GLOBAL_SEARCH", "LOCALIZED", "UNCERTAIN", "LOST")
STATES = (UNKNOWN, GLOBAL_SEARCH, LOCALIZED, UNCERTAIN, LOST)


@dataclass(frozen=True)
class QualityLimits:
    """When a pose is trusted."""
    localized_max_position_sigma_m: float = 0.3
    localized_max_heading_sigma_rad: float = 0.2
    localized_min_cluster_share: float = 0.8
    uncertain_used_share: float = 0.4   # of the answering beams explained, mean of the last updates
    lost_used_share: float = 0.2

    def __post_init__(self) -> None:
        for name in ("localized_max_position_sigma_m", "localized_max_heading_sigma_rad"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"~{name} must be > 0, got {getattr(self, name)}")
        if not 0.0 <= self.lost_used_share <= self.uncertain_used_share <= 1.0:
            raise ValueError("~lost_used_share and ~uncertain_used_share must ascend in [0, 1], got "
                             f"{self.lost_used_share} and {self.uncertain_used_share}")
        if not 0.0 <= self.localized_min_cluster_share <= 1.0:
            raise ValueError(f"~localized_min_cluster_share must be in [0, 1], got "
                             f"{self.localized_min_cluster_share}")


class PoseQuality:
    """Remembers how well the last scans were explained."""

    _MEMORY = 0.8  # weight of the past per update: about five updates

    def __init__(self, limits: QualityLimits, searching: bool = False) -> None:
        self._limits = limits
        self._searching = searching
        self._used_share = float("nan")

    def observe(self, used_share: float) -> None:
        """Take in one update; NaN when no beam answered, which says nothing."""
        if np.isfinite(used_share):
            past = used_share if np.isnan(self._used_share) else self._used_share
            self._used_share = self._MEMORY * past + (1.0 - self._MEMORY) * used_share

    def judge(self, best: PoseEstimate) -> Tuple[str, str]:
        """State and reason."""
        limits = self._limits
        position_sigma_m = float(np.sqrt(np.linalg.eigvalsh(best.covariance[:2, :2])[-1]))
        heading_sigma_rad = float(np.sqrt(best.covariance[2, 2]))
        wide = (position_sigma_m > limits.localized_max_position_sigma_m
                or heading_sigma_rad > limits.localized_max_heading_sigma_rad
                or best.share < limits.localized_min_cluster_share)
        spread = (f"{best.share:.0%} of the weight in one place, sigma {position_sigma_m:.2f} m, "
                  f"{np.degrees(heading_sigma_rad):.1f} deg")
        if np.isnan(self._used_share):
            return UNCERTAIN, f"no scan has been used yet; {spread}"
        explained = f"the map explains {self._used_share:.0%} of the answering beams"
        if self._searching and wide:
            return GLOBAL_SEARCH, spread
        if self._used_share < limits.lost_used_share:
            return LOST, explained
        if wide or self._used_share < limits.uncertain_used_share:
            return UNCERTAIN, f"{explained}; {spread}"
        self._searching = False
        return LOCALIZED, f"{explained}; {spread}"
