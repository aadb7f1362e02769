"""All messages of a robot before anything is chosen or rejected, for the checks of the doctor.

The same whether it was read from a bag or heard on a running robot.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, List, Tuple

import numpy as np


@dataclass(frozen=True)
class HeardScan:
    """One LaserScan, as the driver wrote it."""

    stamp_ns: int
    heard_ns: int  # when it was recorded, or came in
    frame: str
    ranges_m: np.ndarray  # (B,) float32, nothing changed
    angle_min_rad: float
    angle_max_rad: float
    angle_increment_rad: float
    range_min_m: float
    range_max_m: float
    time_increment_s: float
    scan_time_s: float


@dataclass(frozen=True)
class HeardTransform:
    """One link of tf."""

    stamp_ns: int
    heard_ns: int
    parent: str
    child: str
    translation_m: Tuple[float, float, float]
    rotation_xyzw: Tuple[float, float, float, float]
    static: bool
    sender: str = ""  # name of the node; "": not known


@dataclass(frozen=True)
class HeardOdometry:
    """One Odometry message."""

    stamp_ns: int
    heard_ns: int
    frame: str
    child: str


@dataclass
class Observed:
    """Everything received, by topic where there is one, in the order of arrival."""

    name: str  # of the log, or of the robot
    topics: Dict[str, str] = field(default_factory=dict)  # topic -> type
    scans: Dict[str, List[HeardScan]] = field(default_factory=dict)
    transforms: List[HeardTransform] = field(default_factory=list)
    odometry: Dict[str, List[HeardOdometry]] = field(default_factory=dict)
    damage: str = ""  # where reading had to stop, in words
