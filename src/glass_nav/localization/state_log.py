"""The log lines about the state of the localization: each change once, with place and reason."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.geometry import se2
from glass_nav.localization.localizer import Estimate
from glass_nav.log_line import LogLine
from glass_nav.vocabulary import LocalizationState

QUIET_S = 5.0  # a state that comes and goes is said to be lost at most that often


@dataclass(frozen=True)
class _Moment:
    """A reported pose and its time."""

    stamp_ns: int
    map_from_base: np.ndarray  # (3,)
    driven_m: float  # by odometry, since the log began


class StateLog:
    """Takes each estimate; gives a line when LOCALIZED is lost, comes back, or a global search ends."""

    def __init__(self) -> None:
        self._driven_m = 0.0
        self._odom_from_base: Optional[np.ndarray] = None
        self._was: Optional[LocalizationState] = None
        self._sure: Optional[_Moment] = None  # the last estimate that was LOCALIZED
        self._search: Optional[_Moment] = None  # when the global search that goes on began
        self._most_places = 0  # of that search
        self._loss_is_said = True  # nothing is to be said before the first LOCALIZED
        self._last_line_ns: Optional[int] = None

    def take(self, estimate: Estimate) -> Optional[LogLine]:
        """The line about this estimate, if something changed."""
        state = LocalizationState(estimate.state)
        self._drive(estimate)
        now = _Moment(estimate.stamp_ns, estimate.map_from_base, self._driven_m)
        line = self._line(estimate, state, now)
        if state == LocalizationState.LOCALIZED:
            self._sure, self._loss_is_said = now, False
        if state != LocalizationState.GLOBAL_SEARCH:
            self._search, self._most_places = None, 0
        if line is not None:
            self._last_line_ns = now.stamp_ns
        self._was = state
        return line

    def _line(self, estimate: Estimate, state: LocalizationState, now: _Moment) -> Optional[LogLine]:
        if state == LocalizationState.GLOBAL_SEARCH:
            if self._search is None:
                self._search = now
            self._most_places = max(self._most_places, estimate.places)
            return None
        if self._was == LocalizationState.GLOBAL_SEARCH and self._search is not None:
            return self._search_ended(estimate, state, now, self._search)
        if state == LocalizationState.LOCALIZED:
            return self._came_back(now)
        if self._loss_is_said or self._sure is None or not self._is_due(now):
            return None
        self._loss_is_said = True
        return LogLine(f"LOCALIZED is lost at {_place(self._sure)}, now {state}: {estimate.reason}", logging.WARNING)

    def _search_ended(self, estimate: Estimate, state: LocalizationState, now: _Moment, begin: _Moment) -> LogLine:
        most = f", of at most {self._most_places} places" if self._most_places > 1 else ""
        text = f"global search ended: {state} at {_place(now)} after {_since(begin, now)}{most}"
        self._loss_is_said = state != LocalizationState.LOCALIZED
        if state == LocalizationState.LOCALIZED:
            return LogLine(text)
        return LogLine(f"{text}: {estimate.reason}", logging.WARNING)

    def _came_back(self, now: _Moment) -> Optional[LogLine]:
        if self._sure is None:
            return LogLine(f"LOCALIZED at {_place(now)}") if self._was is not LocalizationState.LOCALIZED else None
        if self._was == LocalizationState.LOCALIZED or not self._loss_is_said:
            return None
        return LogLine(f"LOCALIZED again: from {_place(self._sure)} to {_place(now)} after {_since(self._sure, now)}")

    def _is_due(self, now: _Moment) -> bool:
        return self._last_line_ns is None or not 0 <= now.stamp_ns - self._last_line_ns < QUIET_S * 1e9

    def _drive(self, estimate: Estimate) -> None:
        odom_from_base = se2.compose(se2.inverse(estimate.map_from_odom), estimate.map_from_base)
        if self._odom_from_base is not None:
            self._driven_m += float(np.hypot(*(odom_from_base - self._odom_from_base)[:2]))
        self._odom_from_base = odom_from_base


def _place(moment: _Moment) -> str:
    x, y, yaw = moment.map_from_base
    return f"({x:.2f} m, {y:.2f} m, {np.degrees(yaw):.0f} deg)"


def _since(begin: _Moment, now: _Moment) -> str:
    return f"{now.driven_m - begin.driven_m:.1f} m and {(now.stamp_ns - begin.stamp_ns) * 1e-9:.1f} s"
