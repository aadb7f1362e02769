"""What the localization node tells diagnostic_aggregator and rqt_robot_monitor, once a second."""

from __future__ import annotations

from typing import Any, List, Optional

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from glass_nav.localization.glass_mcl import Estimate
from glass_nav.ros.mailbox import ScanCounts
from glass_nav.ros.params import LocalizationNodeParams


class Diagnostics:
    """Two entries: the pose with its spread, and the scans with where they went."""

    def __init__(self, p: LocalizationNodeParams, counts: ScanCounts) -> None:
        self._name = rospy.get_name().strip("/")
        self._counts = counts
        self.reconfigure(p)
        self._cpu_s: List[float] = []  # of the updates since the last report
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=2)

    def reconfigure(self, p: LocalizationNodeParams) -> None:
        """Other parameters from now on."""
        self._levels = np.array([p.std_warn_level_x, p.std_warn_level_y, p.std_warn_level_yaw])

    def add_update(self, cpu_s: float) -> None:
        """The filter took that much CPU time for one scan."""
        self._cpu_s.append(cpu_s)

    def publish(self, estimate: Optional[Estimate], trouble: Optional[str]) -> None:
        """
        Args:
            estimate: the last one, None before the first.
            trouble: why no scan is being used, None while all is well.
        """
        msg = DiagnosticArray(status=[self._pose(estimate), self._scans(trouble)])
        msg.header.stamp = rospy.Time.now()  # of the report, not of the data
        self._publisher.publish(msg)
        self._cpu_s = []

    def _pose(self, estimate: Optional[Estimate]) -> DiagnosticStatus:
        if estimate is None:
            return self._entry("pose", DiagnosticStatus.WARN, "no pose yet")
        std = np.sqrt(np.maximum(np.diag(estimate.covariance), 0.0))
        values = dict(zip(("std_x [m]", "std_y [m]", "std_yaw [rad]"), np.round(std, 4)),
                      particles=len(estimate.particles), used_share=round(float(estimate.used_share), 3))
        if estimate.state == "LOST":
            return self._entry("pose", DiagnosticStatus.ERROR, f"LOST: {estimate.reason}", **values)
        wide = [axis for axis, over in zip(("x", "y", "yaw"), std > self._levels) if over]
        text = f"{estimate.state}: {estimate.reason}"
        if wide:
            text += f"; standard deviation of {', '.join(wide)} above ~std_warn_level"
        level = DiagnosticStatus.OK if estimate.state == "LOCALIZED" and not wide else DiagnosticStatus.WARN
        return self._entry("pose", level, text, **values)

    def _scans(self, trouble: Optional[str]) -> DiagnosticStatus:
        values = dict(vars(self._counts))
        if self._cpu_s:
            values["cpu per update [ms]"] = round(1e3 * sum(self._cpu_s) / len(self._cpu_s), 1)
        if trouble is not None:
            return self._entry("scans", DiagnosticStatus.ERROR, trouble, **values)
        return self._entry("scans", DiagnosticStatus.OK, "scans are being used", **values)

    def _entry(self, part: str, level: int, text: str, **values: Any) -> DiagnosticStatus:
        return DiagnosticStatus(level=level, name=f"{self._name}: {part}", message=text, hardware_id="none",
                                values=[KeyValue(key, str(value)) for key, value in values.items()])
