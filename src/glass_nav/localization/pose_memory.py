"""Stores the last pose for the next start: on the parameter server, as AMCL does, and in ~pose_file."""

from __future__ import annotations

from dataclasses import replace
from typing import Callable, Optional

from glass_nav.geometry import se2
from glass_nav.localization import saved_pose
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.saved_pose import PoseFile, SavedPose
from glass_nav.rate_limiter import RateLimiter, period_s
from glass_nav.vocabulary import LocalizationState

QUIET_S = 30.0  # the file of a robot that stands is written no more often
MOVED_M, MOVED_RAD = 0.05, 0.05


class PoseMemory:
    """Keeps poses that can be trusted: none while the robot is lost or being searched for."""

    def __init__(self, file: PoseFile, keep: Callable[[SavedPose], None], warn: Callable[[str], None]) -> None:
        """
        Args:
            file: where the pose is written.
            keep: called with every pose that is due, whether or not the file needs it.
            warn: called with a line if something fails with an OSError.
        """
        self._path = file.path if file.pose_file else None
        self._keep, self._warn = keep, warn
        self._limiter = RateLimiter()
        self._last: Optional[SavedPose] = None  # the last one that can be trusted
        self._written: Optional[SavedPose] = None  # what the file says

    def take(self, estimate: Estimate, map_digest: str, rate_hz: float, now_s: float) -> None:
        """The estimate of a scan; saved if it is time, at once if the robot has just got lost."""
        if estimate.state in (LocalizationState.LOCALIZED, LocalizationState.UNCERTAIN):
            odom_from_base = se2.compose(se2.inverse(estimate.map_from_odom), estimate.map_from_base)
            self._last = SavedPose(
                estimate.stamp_ns,
                estimate.map_from_base,
                estimate.covariance,
                odom_from_base,
                map_digest,
                estimate.state,
            )
            if rate_hz > 0.0 and self._limiter.is_due(now_s, period_s(rate_hz)):
                self._save(self._last, even_if_it_stands=False)
        elif self._last is not None:  # the pose before it was lost is no start
            self._write(replace(self._last, state=estimate.state))
            self._last = None

    def save(self) -> None:
        """The node ends."""
        if self._last is not None:
            self._save(self._last, even_if_it_stands=True)

    def _save(self, saved: SavedPose, even_if_it_stands: bool) -> None:
        try:
            self._keep(saved)
        except OSError as err:
            self._warn(f"the pose is not saved: no parameter server ({err})")
        if even_if_it_stands or self._is_news(saved):
            self._write(saved)

    def _is_news(self, saved: SavedPose) -> bool:
        if self._written is None or self._written.state != saved.state or self._written.map_digest != saved.map_digest:
            return True
        path_m, turn_rad = se2.travelled(se2.compose(se2.inverse(self._written.map_from_base), saved.map_from_base))
        return bool(
            path_m > MOVED_M
            or turn_rad > MOVED_RAD
            or not 0.0 <= (saved.stamp_ns - self._written.stamp_ns) * 1e-9 < QUIET_S
        )

    def _write(self, saved: SavedPose) -> None:
        if self._path is None:
            return
        try:
            saved_pose.save(self._path, saved)
        except OSError as err:
            self._warn(f"the pose is not saved in {self._path}: {err}")
        else:
            self._written = saved
