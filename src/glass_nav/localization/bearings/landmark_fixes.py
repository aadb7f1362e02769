"""Computes fixes from incoming bearings, and decides when a fix becomes the initial pose."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.localization.bearings import triangulation
from glass_nav.localization.bearings.triangulation import Fix, TriangulationLimits
from glass_nav.sensing import bearings
from glass_nav.sensing.bearings import LandmarkBearing, LandmarkBearings, OdometryDrift
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.landmark_map import LandmarkMap

METHODS = ("least_squares", "document")


@dataclass(frozen=True)
class FixParams:
    """How fixes are made, and when one is sent to initialpose. Units by REP 103."""

    method: str = "least_squares"  # or "document": the average over all triples
    window_s: float = 90.0  # bearings older than the newest by more than this are dropped
    max_age_s: float = 120.0  # of a fix that ~send_initialpose sends
    rescue_states: str = "UNKNOWN LOST GLOBAL_SEARCH"  # of the localization: a fix goes to initialpose; "": never
    rescue_period_s: float = 10.0
    min_position_sigma_m: float = 0.05  # of initialpose: particles at one point would not find the scan's best pose
    min_heading_sigma_rad: float = 0.02

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"~method must be one of {', '.join(METHODS)}, got {self.method!r}")
        for name in ("window_s", "max_age_s", "rescue_period_s", "min_position_sigma_m", "min_heading_sigma_rad"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be >= 0 and finite, got {getattr(self, name)}")
        unknown = [state for state in self.rescue_states.split() if state not in LocalizationState.__members__]
        if unknown:
            raise ValueError(f"~rescue_states must be words of {', '.join(LocalizationState)}, got {unknown[0]!r}")


@dataclass(frozen=True)
class PlacedFix:
    """A fix, with its bearings and the odometry at its stamp."""

    fix: Fix
    bearings: LandmarkBearings
    odom_from_base: np.ndarray  # (3,)


class LandmarkFixes:
    """The newest bearing of each landmark, and the last fix.

    A sweep of the sensor takes up to a minute; odometry carries the bearings of one fix along.
    """

    def __init__(self, landmarks: LandmarkMap, p: FixParams, limits: TriangulationLimits, drift: OdometryDrift) -> None:
        """
        Raises:
            ValueError: fewer than three landmarks.
        """
        if len(landmarks) < 3:
            raise ValueError(f"three landmarks are needed for a position, it has {len(landmarks)}")
        self._landmarks, self._p, self._limits, self._drift = landmarks, p, limits, drift
        self.restart("no bearings came yet")

    def restart(self, why_none: str) -> None:
        """Forget everything: at the start, or after time has jumped."""
        self._newest: Dict[str, Tuple[LandmarkBearing, np.ndarray]] = {}  # with odom_from_base at its stamp
        self._last: Optional[PlacedFix] = None
        self._sent_ns = self._rescued_ns = 0  # stamps of fixes
        self.localization_state = ""  # not reported yet
        self.why_none = why_none  # why there is no newer fix

    def take(
        self, taken: Sequence[Tuple[LandmarkBearing, np.ndarray]], base_from_sensor: np.ndarray
    ) -> Optional[PlacedFix]:
        """Add bearings, each with odom_from_base (3,) at its stamp; returns a fix, or None without a known landmark.

        Raises:
            TriangulationError: there is no fix; why_none holds the reason, too.
        """
        self._newest.update({bearing.landmark_id: (bearing, odometry) for bearing, odometry in taken})
        if not self._newest:
            self.why_none = "no known landmark was seen"
            return None
        newest_ns = max(bearing.stamp_ns for bearing, _ in self._newest.values())
        self._newest = {
            name: each for name, each in self._newest.items() if newest_ns - each[0].stamp_ns <= self._p.window_s * 1e9
        }
        in_order = sorted(self._newest.values(), key=lambda each: each[0].stamp_ns)
        collected = bearings.collected(
            [bearing for bearing, _ in in_order],
            np.array([odometry for _, odometry in in_order]),
            base_from_sensor,
            self._drift,
        )
        solve = triangulation.average if self._p.method == "document" else triangulation.triangulate
        try:
            fix = solve(collected, self._landmarks, self._limits)
        except triangulation.TriangulationError as err:
            self.why_none = str(err)
            raise
        self._last = PlacedFix(fix, collected, in_order[-1][1])
        return self._last

    @property
    def rescue_states(self) -> List[str]:
        """States of the localization in which a fix goes to initialpose without a request."""
        return self._p.rescue_states.split()

    def due_for_rescue(self) -> Optional[PlacedFix]:
        """The last fix, if the localization does not know where it is: once for each fix, and not too often."""
        last = self._last
        if last is None or self.localization_state not in self.rescue_states:
            return None
        stamp_ns = last.fix.stamp_ns
        if stamp_ns <= self._sent_ns or (stamp_ns - self._rescued_ns) * 1e-9 < self._p.rescue_period_s:
            return None
        self._rescued_ns = stamp_ns
        return last

    def requested(self, now_s: float) -> PlacedFix:
        """The last fix. ValueError if there is none, or if it is too old."""
        if self._last is None:
            raise ValueError(f"there is no position: {self.why_none}")
        age_s = now_s - self._last.fix.stamp_ns * 1e-9
        if age_s > self._p.max_age_s:
            raise ValueError(
                f"the last position is {age_s:.0f} s old, allowed {self._p.max_age_s:g} s; since then: {self.why_none}"
            )
        return self._last

    def initial_pose(self, last: PlacedFix, stamp_ns: int, odom_from_base: np.ndarray) -> Fix:
        """A fix carried along to the newest odometry; it counts as sent.

        The receiver need not store the odometry of a whole sweep. Its covariance is widened, see FixParams.
        """
        self._sent_ns = last.fix.stamp_ns
        step = se2.compose(se2.inverse(last.odom_from_base), odom_from_base)
        fix = triangulation.carried_along(last.fix, stamp_ns, step, self._drift)
        floor = np.diag(np.square([self._p.min_position_sigma_m] * 2 + [self._p.min_heading_sigma_rad]))
        return replace(fix, covariance=fix.covariance + floor)
