"""The private parameters of the driver node; config/driver.yaml explains them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from glass_nav.driving.driver_params import DriveParams
from glass_nav.driving.input_watch import InputNames
from glass_nav.ros.localization.params import LocalizationNodeParams
from glass_nav.sensing.deskew import Deskew

INTERNAL, MOVE_BASE = "internal", "move_base"


@dataclass(frozen=True)
class DriverNodeParams:
    """Parameters of the node itself. Units by REP 103."""

    atlas: str = ""  # atlas.json, its folder, or the name of a shipped one: for goto_node
    backend: str = INTERNAL  # of goto_node; or move_base
    use_scan_surfaces: bool = True  # not scan, while the localization is LOCALIZED
    move_base_wait_s: float = 5.0  # for the action server
    transform_wait_s: float = 1.0  # a scan waits so long for odom <- base <- laser
    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"
    global_frame_id: str = "map"

    def __post_init__(self) -> None:
        if self.backend not in (INTERNAL, MOVE_BASE):
            raise ValueError(f"~backend must be {INTERNAL} or {MOVE_BASE}, got {self.backend!r}")
        for name in ("move_base_wait_s", "transform_wait_s"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be > 0 and finite, got {getattr(self, name)}")
        self.of_scans("scan")  # checks the frames

    def of_scans(self, topic: str) -> LocalizationNodeParams:
        """Parameters of the scan input for one topic."""
        return LocalizationNodeParams(
            odom_frame_id=self.odom_frame_id,
            base_frame_id=self.base_frame_id,
            global_frame_id=self.global_frame_id,
            scan_topics=(topic,),
            transform_wait_s=self.transform_wait_s,
        )

    def input_names(self, localization: str) -> InputNames:
        """Names of the inputs for messages, given the topic of the localization's status."""
        return InputNames(self.odom_frame_id, self.base_frame_id, self.global_frame_id, localization)


@dataclass(frozen=True)
class DriverParams:
    """All parameters of the node, one flat set of names."""

    node: DriverNodeParams = field(default_factory=DriverNodeParams)
    deskew: Deskew = field(default_factory=Deskew)
    drive: DriveParams = field(default_factory=DriveParams)
