"""The private parameters of the driver node; explained in config/driver.yaml."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from glass_nav.driving.edge_driver import EdgeDriverParams
from glass_nav.driving.recovery import RecoveryParams
from glass_nav.driving.route_follower import FollowerParams
from glass_nav.ros.localization.params import LocalizationNodeParams
from glass_nav.sensing.deskew import Deskew

INTERNAL, MOVE_BASE = "internal", "move_base"


@dataclass(frozen=True)
class DriverNodeParams:
    """What the node itself needs. Units by REP 103."""

    atlas: str = ""  # atlas.json, its folder, or the name of a shipped one: for goto_node
    backend: str = INTERNAL  # of goto_node; or move_base
    follow_turn_choice: bool = True  # drive as the topology node says
    seek_at_start: bool = True  # drive to a meetpoint at the start, and whenever a search waits for one
    seek_attempts: int = 3  # of a search in a row, before it waits for somebody
    control_rate_hz: float = 20.0  # of cmd_vel
    use_scan_surfaces: bool = True  # not scan, while the localization is LOCALIZED
    scan_timeout_s: float = 0.6  # an older scan stops the robot
    odometry_timeout_s: float = 0.5  # older odometry stops the robot
    status_timeout_s: float = 3.0  # an older word of the localization stops a goal in the map
    patience_s: float = 10.0  # of an action, while one of these stops it
    move_base_wait_s: float = 5.0  # for the action server
    transform_wait_s: float = 1.0  # a scan waits so long for odom <- base <- laser
    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"
    global_frame_id: str = "map"

    def __post_init__(self) -> None:
        if self.backend not in (INTERNAL, MOVE_BASE):
            raise ValueError(f"~backend must be {INTERNAL} or {MOVE_BASE}, got {self.backend!r}")
        if self.seek_attempts < 1:
            raise ValueError(f"~seek_attempts must be >= 1, got {self.seek_attempts}")
        if not 1.0 <= self.control_rate_hz <= 200.0:
            raise ValueError(f"~control_rate_hz must be 1 to 200 Hz, got {self.control_rate_hz}")
        for name in (
            "scan_timeout_s",
            "odometry_timeout_s",
            "status_timeout_s",
            "patience_s",
            "move_base_wait_s",
            "transform_wait_s",
        ):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be > 0 and finite, got {getattr(self, name)}")
        self.of_scans("scan")  # checks the frames

    def of_scans(self, topic: str) -> LocalizationNodeParams:
        """For the input of scans of one topic."""
        return LocalizationNodeParams(
            odom_frame_id=self.odom_frame_id,
            base_frame_id=self.base_frame_id,
            global_frame_id=self.global_frame_id,
            scan_topics=(topic,),
            transform_wait_s=self.transform_wait_s,
        )


@dataclass(frozen=True)
class DriverParams:
    """Everything the node reads, one flat set of names."""

    node: DriverNodeParams = field(default_factory=DriverNodeParams)
    deskew: Deskew = field(default_factory=Deskew)
    edge: EdgeDriverParams = field(default_factory=EdgeDriverParams)
    follower: FollowerParams = field(default_factory=FollowerParams)
    recovery: RecoveryParams = field(default_factory=RecoveryParams)
