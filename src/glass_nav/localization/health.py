"""The entries of the localization for /diagnostics: pose, scans, beams, time, map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Dict, List, Optional

import numpy as np

from glass_nav.health import Health, Level
from glass_nav.localization.localizer import Estimate
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.scan_queue import ScanCounts
from glass_nav.vocabulary import CASES_IN_ORDER, LocalizationState
from glass_nav.world.grid_map import GridMap

FEW_BEAMS = 20  # that answered; a pose does not follow from fewer


@dataclass(frozen=True)
class Situation:
    """The data for the entries."""

    estimate: Optional[Estimate]  # the last one, None before the first
    scan: Optional[Scan]  # that it was made of
    trouble: Optional[str]  # why no scan is being used, None while all is well
    grid_map: Optional[GridMap]
    map_origin: str  # where the map came from, or why there is none
    scan_period_s: Optional[float]  # from one scan to the next, of any lidar; None: not known yet
    lidars: List[str]  # their frames
    lacking_glass: Optional[str] = None  # how much glass the map lacks, in words; None: none was found


ENTRIES = ("pose", "scans", "beams", "timing", "map")


class LocalizationHealth:
    """The entries about one situation; some cover the time since the last report."""

    def __init__(self, warn_deviations: np.ndarray, counts: ScanCounts) -> None:
        """
        Args:
            warn_deviations: (3,) standard deviations of x [m], y [m], yaw [rad] above which the pose is a warning.
            counts: of the scans, as they go on.
        """
        self.warn_deviations = warn_deviations
        self._counts, self._reported = counts, replace(counts)
        self._cpu_s: List[float] = []  # of the updates since the last report
        self._wall_s: List[float] = []

    def add_update(self, cpu_s: float, wall_s: float) -> None:
        """Add the CPU time and the duration of an update."""
        self._cpu_s.append(cpu_s)
        self._wall_s.append(wall_s)

    def report(self, now: Situation) -> Dict[str, Health]:
        """All entries by name; those over a period start again."""
        entries = {
            "pose": self._pose(now),
            "scans": self._scans(now),
            "beams": self._beams(now),
            "timing": self._timing(now),
            "map": self._map(now),
        }
        self._cpu_s, self._wall_s, self._reported = [], [], replace(self._counts)
        return entries

    def _pose(self, now: Situation) -> Health:
        estimate = now.estimate
        if estimate is None:
            return Health(Level.WARN, "no pose yet")
        std = np.sqrt(np.maximum(np.diag(estimate.covariance), 0.0))
        values = dict(
            zip(("std_x [m]", "std_y [m]", "std_yaw [rad]"), np.round(std, 4)),
            particles=len(estimate.particles),
            used_share=round(float(estimate.inlier_ratio), 3),
            reliability=round(float(estimate.confidence), 3),
            state=estimate.state,
        )
        if estimate.state == LocalizationState.LOST:
            return Health(Level.ERROR, f"LOST: {estimate.reason}", values)
        wide = [axis for axis, over in zip(("x", "y", "yaw"), std > self.warn_deviations) if over]
        text = f"{estimate.state}: {estimate.reason}"
        if wide:
            text += f"; standard deviation of {', '.join(wide)} above ~std_warn_level"
        return Health(
            Level.OK if estimate.state == LocalizationState.LOCALIZED and not wide else Level.WARN, text, values
        )

    def _scans(self, now: Situation) -> Health:
        values = {**vars(self._counts), "lidars": ", ".join(now.lidars)}
        if now.trouble is not None:
            return Health(Level.ERROR, now.trouble, values)
        lately = {name: count - getattr(self._reported, name) for name, count in vars(self._counts).items()}
        lost = [
            f"{lately[name]} {words}"
            for name, words in (
                ("refused", "refused"),
                ("dropped_no_transform", "dropped without a transform"),
                ("superseded", "passed over for newer ones"),
            )
            if lately[name] > 0
        ]
        text = f"{lately['used']} scans used since the last report" + (f", {', '.join(lost)}" if lost else "")
        bad = lately["refused"] > 0 or lately["dropped_no_transform"] > 0
        return Health(Level.WARN if bad else Level.OK, text, values)

    def _beams(self, now: Situation) -> Health:
        if now.estimate is None or now.scan is None:
            return Health(Level.OK, "no scan used yet")
        answered, beams = int(now.scan.answered.sum()), len(now.scan)
        shares = now.estimate.cases.share()
        values = {case.label: f"{shares[case]:.1%}" for case in CASES_IN_ORDER}
        text = f"{answered} of {beams} beams returned"
        if answered < FEW_BEAMS:
            return Health(Level.WARN, f"only {text}: odometry leads", values)
        if np.isnan(now.estimate.inlier_ratio):
            return Health(Level.OK, f"{text}, none from mapped space", values)
        return Health(Level.OK, f"{text}, the map explains {now.estimate.inlier_ratio:.0%} of those it covers", values)

    def _timing(self, now: Situation) -> Health:
        if not self._wall_s:
            return Health(Level.OK, "no update since the last report")
        mean_s, most_s = float(np.mean(self._wall_s)), max(self._wall_s)
        values = {
            "cpu per update [ms]": round(1e3 * float(np.mean(self._cpu_s)), 1),
            "update [ms]": round(1e3 * mean_s, 1),
            "longest update [ms]": round(1e3 * most_s, 1),
        }
        text = f"an update takes {1e3 * mean_s:.0f} ms"
        if now.scan_period_s is None:
            return Health(Level.OK, text, values)
        values["scan period [ms]"] = round(1e3 * now.scan_period_s, 1)
        text += f", a scan comes every {1e3 * now.scan_period_s:.0f} ms"
        if mean_s > now.scan_period_s:
            return Health(Level.WARN, f"{text}: not all of them are used", values)
        return Health(Level.OK, text, values)

    def _map(self, now: Situation) -> Health:
        if now.grid_map is None:
            return Health(Level.ERROR, now.map_origin)
        height, width = now.grid_map.occupancy.shape
        x, y, yaw = now.grid_map.map_from_grid
        text = f"{width} x {height} cells of {now.grid_map.resolution_m:g} m from {now.map_origin}"
        return Health(
            Level.OK if now.lacking_glass is None else Level.WARN,
            text if now.lacking_glass is None else f"{text}; {now.lacking_glass}",
            {
                "digest": now.grid_map.digest,
                "origin": f"x {x:.3f} m, y {y:.3f} m, yaw {yaw:.4f} rad",
                "occupied": now.grid_map.occupied_count,
                "free": now.grid_map.free_count,
            },
        )
