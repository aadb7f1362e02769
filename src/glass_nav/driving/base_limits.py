"""The limits of the base: what it can do, and what it is allowed to do."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class BaseLimits:
    """Limits of a base that drives forward and turns. The defaults are those of a slow indoor robot of 50 kg."""

    robot_radius_m: float = 0.22  # of its round outline
    margin_m: float = 0.02  # kept between outline and obstacles
    max_speed_m_s: float = 0.5
    max_turn_rad_s: float = 1.0
    max_acceleration_m_s2: float = 0.5
    max_turn_acceleration_rad_s2: float = 2.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (0.0 < value < math.inf or name == "margin_m" and value == 0.0):
                raise ValueError(f"~{name} must be > 0 and finite, got {value}")
