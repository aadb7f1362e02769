"""What the localization node tells diagnostic_aggregator and rqt_robot_monitor, once a second."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, List, Optional

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from glass_nav.localization.integrity.pose_state import LOCALIZED, LOST
from glass_nav.localization.localizer import Estimate
from glass_nav.ros.localization.beam_displays import CASE_NAMES
from glass_nav.ros.localization.params import LocalizationNodeParams
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.scan_queue import ScanCounts
from glass_nav.world.grid_map import GridMap

FEW_BEAMS = 20  # that answered; a pose does not follow from fewer

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


@dataclass(frozen=True)
class Situation:
    """What there is to report of."""

    estimate: Optional[Estimate]  # the last one, None before the first
    scan: Optional[Scan]  # that it was made of
    trouble: Optional[str]  # why no scan is being used, None while all is well
    grid_map: Optional[GridMap]
    map_origin: str  # where the map came from, or why there is none
    scan_period_s: Optional[float]  # from one scan to the next, of whatever lidar; None: not known yet
    lidars: List[str]  # their frames


class Diagnostics:
    """Five entries: the pose with its spread, the scans with where they went, the beams, the time, the map."""

    def __init__(self, p: LocalizationNodeParams, counts: ScanCounts) -> None:
        self._name = rospy.get_name().strip("/")
        self._counts, self._reported = counts, replace(counts)
        self._cpu_s: List[float] = []  # of the updates since the last report
        self._wall_s: List[float] = []
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=2)
        self.reconfigure(p)

    def reconfigure(self, p: LocalizationNodeParams) -> None:
        """Other parameters from now on."""
        self._levels = np.array([p.std_warn_level_x, p.std_warn_level_y, p.std_warn_level_yaw])

    def add_update(self, cpu_s: float, wall_s: float) -> None:
        """One scan took the process so much CPU time, and the loop so long."""
        self._cpu_s.append(cpu_s)
        self._wall_s.append(wall_s)

    def publish(self, now: Situation) -> None:
        """All entries; what is told of the time since the last report starts over."""
        msg = DiagnosticArray(
            status=[self._pose(now), self._scans(now), self._beams(now), self._timing(now), self._map(now)]
        )
        msg.header.stamp = rospy.Time.now()  # of the report, not of the data
        self._publisher.publish(msg)
        self._cpu_s, self._wall_s, self._reported = [], [], replace(self._counts)

    def _pose(self, now: Situation) -> DiagnosticStatus:
        estimate = now.estimate
        if estimate is None:
            return self._entry("pose", WARN, "no pose yet")
        std = np.sqrt(np.maximum(np.diag(estimate.covariance), 0.0))
        values = dict(
            zip(("std_x [m]", "std_y [m]", "std_yaw [rad]"), np.round(std, 4)),
            particles=len(estimate.particles),
            used_share=round(float(estimate.used_share), 3),
            reliability=round(float(estimate.reliability), 3),
            state=estimate.state,
        )
        if estimate.state == LOST:
            return self._entry("pose", ERROR, f"LOST: {estimate.reason}", **values)
        wide = [axis for axis, over in zip(("x", "y", "yaw"), std > self._levels) if over]
        text = f"{estimate.state}: {estimate.reason}"
        if wide:
            text += f"; standard deviation of {', '.join(wide)} above ~std_warn_level"
        return self._entry("pose", OK if estimate.state == LOCALIZED and not wide else WARN, text, **values)

    def _scans(self, now: Situation) -> DiagnosticStatus:
        values = dict(vars(self._counts), lidars=", ".join(now.lidars))
        if now.trouble is not None:
            return self._entry("scans", ERROR, now.trouble, **values)
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
        return self._entry("scans", WARN if bad else OK, text, **values)

    def _beams(self, now: Situation) -> DiagnosticStatus:
        if now.estimate is None or now.scan is None:
            return self._entry("beams", OK, "no scan used yet")
        answered, beams = int(now.scan.answered.sum()), len(now.scan)
        values = {CASE_NAMES[case]: f"{share:.1%}" for case, share in now.estimate.cases.share().items()}
        text = f"{answered} of {beams} beams answered"
        if answered < FEW_BEAMS:
            return self._entry("beams", WARN, f"only {text}: odometry leads", **values)
        return self._entry("beams", OK, f"{text}, {now.estimate.used_share:.0%} of them are understood", **values)

    def _timing(self, now: Situation) -> DiagnosticStatus:
        if not self._wall_s:
            return self._entry("timing", OK, "no update since the last report")
        mean_s, most_s = float(np.mean(self._wall_s)), max(self._wall_s)
        values = {
            "cpu per update [ms]": round(1e3 * float(np.mean(self._cpu_s)), 1),
            "update [ms]": round(1e3 * mean_s, 1),
            "longest update [ms]": round(1e3 * most_s, 1),
        }
        text = f"an update takes {1e3 * mean_s:.0f} ms"
        if now.scan_period_s is None:
            return self._entry("timing", OK, text, **values)
        values["scan period [ms]"] = round(1e3 * now.scan_period_s, 1)
        text += f", a scan comes every {1e3 * now.scan_period_s:.0f} ms"
        if mean_s > now.scan_period_s:
            return self._entry("timing", WARN, f"{text}: not all of them are used", **values)
        return self._entry("timing", OK, text, **values)

    def _map(self, now: Situation) -> DiagnosticStatus:
        if now.grid_map is None:
            return self._entry("map", ERROR, now.map_origin)
        height, width = now.grid_map.occupancy.shape
        x, y, yaw = now.grid_map.map_from_grid
        return self._entry(
            "map",
            OK,
            f"{width} x {height} cells of {now.grid_map.resolution_m:g} m from {now.map_origin}",
            digest=now.grid_map.digest,
            origin=f"x {x:.3f} m, y {y:.3f} m, yaw {yaw:.4f} rad",
            occupied=int(now.grid_map.occupied.sum()),
            free=int(now.grid_map.free.sum()),
        )

    def _entry(self, part: str, level: int, text: str, **values: Any) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=level,
            name=f"{self._name}: {part}",
            message=text,
            hardware_id="none",
            values=[KeyValue(key, str(value)) for key, value in values.items()],
        )
