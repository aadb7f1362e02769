"""The parameters of the driver; config/driver.yaml explains them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from glass_nav.driving.edge_tracking.edge_driver import EdgeDriverParams
from glass_nav.driving.recovery import RecoveryParams
from glass_nav.driving.route_follower import RouteFollowerParams


@dataclass(frozen=True)
class DriverRules:
    """When the robot drives by itself, when it halts, and how long it waits."""

    follow_turn_choice: bool = True  # drive as the topology node says
    seek_at_start: bool = True  # drive to a meetpoint at the start, and whenever a search waits for one
    seek_attempts: int = 3  # failed attempts in a row after which a search waits for a request
    report_visits: bool = True  # of nodes passed on the way to a goal, from which the atlas learns
    control_rate_hz: float = 20.0  # of cmd_vel
    scan_timeout_s: float = 0.6  # an older scan stops the robot
    odometry_timeout_s: float = 0.5  # older odometry stops the robot
    status_timeout_s: float = 3.0  # an older status of the localization stops a goal in the map
    patience_s: float = 10.0  # of an action, while one of these stops it

    def __post_init__(self) -> None:
        if self.seek_attempts < 1:
            raise ValueError(f"~seek_attempts must be >= 1, got {self.seek_attempts}")
        if not 1.0 <= self.control_rate_hz <= 200.0:
            raise ValueError(f"~control_rate_hz must be 1 to 200 Hz, got {self.control_rate_hz}")
        for name in ("scan_timeout_s", "odometry_timeout_s", "status_timeout_s", "patience_s"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be > 0 and finite, got {getattr(self, name)}")


@dataclass(frozen=True)
class DriveParams:
    """All parameters of the driver."""

    rules: DriverRules = field(default_factory=DriverRules)
    edge: EdgeDriverParams = field(default_factory=EdgeDriverParams)
    follower: RouteFollowerParams = field(default_factory=RouteFollowerParams)
    recovery: RecoveryParams = field(default_factory=RecoveryParams)
