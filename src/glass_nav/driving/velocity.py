"""Limits a desired velocity to the speeds and accelerations of the base.

Velocities (3,) forward, left [m/s], turn [rad/s].
"""

from __future__ import annotations

import numpy as np

from glass_nav.driving.base_limits import BaseLimits


def limited(wanted: np.ndarray, last: np.ndarray, limits: BaseLimits, dt_s: float) -> np.ndarray:
    """The next command.

    Args:
        wanted: (3,); too fast, it is slowed as a whole, so that the curve stays the same. Never sideways.
        last: (3,) the command before.
        limits: of the base.
        dt_s: since the command before, >= 0.
    """
    forward, turn = float(wanted[0]), float(wanted[2])
    share = min(1.0, limits.max_speed_m_s / max(abs(forward), 1e-9), limits.max_turn_rad_s / max(abs(turn), 1e-9))
    return np.array(
        [
            _approached(float(last[0]), share * forward, limits.max_acceleration_m_s2 * dt_s),
            0.0,
            _approached(float(last[2]), share * turn, limits.max_turn_acceleration_rad_s2 * dt_s),
        ]
    )


def _approached(last: float, wanted: float, most: float) -> float:
    return min(max(wanted, last - most), last + most)
