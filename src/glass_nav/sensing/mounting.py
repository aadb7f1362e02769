"""The mounting of a planar sensor on the robot: level, upright or upside down."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glass_nav.sensing.scan import ScanError

MAX_TILT_RAD = math.radians(20.0)  # a plane tilted by 20 degrees shortens its ranges seen from above by 6 %


@dataclass(frozen=True)
class Mounting:
    """The place of a level sensor."""

    base_from_laser: np.ndarray  # (3,) planar pose of the sensor on the robot
    height_m: float = 0.0
    upside_down: bool = False


def level_mounting(base_from_laser: np.ndarray, height_m: float, upwardness: float) -> Mounting:
    """The mounting of a sensor that is level enough.

    Args:
        base_from_laser: (3,) its pose, seen from above.
        height_m: above the robot's frame.
        upwardness: cosine between the z axes of sensor and robot: 1 level, -1 upside down.

    Raises:
        ScanError: the sensor is tilted.
    """
    if abs(upwardness) < math.cos(MAX_TILT_RAD):
        raise ScanError(
            f"the laser is tilted by {math.degrees(math.acos(abs(upwardness))):.0f} degrees; level within "
            f"{math.degrees(MAX_TILT_RAD):.0f} degrees is needed, upright or upside down"
        )
    return Mounting(base_from_laser, height_m, upwardness < 0.0)
