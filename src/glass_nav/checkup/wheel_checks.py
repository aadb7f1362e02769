"""Finds the wheel with a wrong radius or slip, from the motion by scans and by odometry. N pairs of scans.

By the glass document's equations (3) and (4) a wheel's increment is the forward motion plus or minus half the turn times the
distance between the wheels: both motions say what each wheel did.
"""

from __future__ import annotations

from typing import Iterator, Tuple

import numpy as np

from glass_nav.checkup import motion_checks
from glass_nav.checkup.finding import Finding
from glass_nav.checkup.motion_checks import Moves
from glass_nav.geometry import angles

WHEEL_BASE_M = 0.4  # assumed: who is at fault depends little on it
_MIN_PAIRS = 6
_BEND_RAD_M = 0.03  # of what odometry calls straight
_SPREAD_RAD_M = 0.03  # interquartile range; more, and nothing is known
_SLIP_M, _SLIP_SHARE, _MIN_SLIPS = 0.08, 0.1, 3
_SIDES = ("left", "right")


def check(moves: Moves, link: str) -> Iterator[Finding]:
    """Findings on single wheels; for odometry that moves, and whose turns have the right sign.

    Args:
        moves: of one lidar.
        link: odometry's frames, for the text.
    """
    bent = [*_check_radius(moves, link)]
    yield from bent
    if not bent:
        yield from _check_slip(moves, link)


def _check_radius(moves: Moves, link: str) -> Iterator[Finding]:
    by_odometry, by_scans = motion_checks.straight(moves)
    if len(by_odometry) < _MIN_PAIRS:
        return
    way_m = np.hypot(by_odometry[:, 0], by_odometry[:, 1])
    excess_rad_m = angles.wrap(by_scans[:, 2] - by_odometry[:, 2]) / way_m
    low, bend, high = np.percentile(excess_rad_m, [25, 50, 75])
    if abs(bend) < _BEND_RAD_M or high - low > _SPREAD_RAD_M:
        return
    ways = motion_checks.way_ratio(moves)
    scale = ways.middle if ways.is_known else 1.0
    half = 0.5 * bend * WHEEL_BASE_M
    radii = scale - half, scale + half
    worst = int(abs(radii[1] - 1.0) > abs(radii[0] - 1.0))
    yield Finding(
        "wheel-radius",
        f"where {link} goes straight the scans turn {np.degrees(abs(bend)):.1f} degrees to the "
        f"{_SIDES[int(bend < 0.0)]} for each metre ({len(way_m)} pairs of scans): the {_SIDES[worst]} wheel is "
        f"{'larger' if radii[worst] > 1.0 else 'smaller'} than the base's driver assumes",
        f"multiply the radius of the {_SIDES[worst]} wheel by {radii[worst]:.3f} (for wheels {WHEEL_BASE_M:g} m apart), "
        "or pump up its tyre",
    )


def _check_slip(moves: Moves, link: str) -> Iterator[Finding]:
    count = len(moves.by_odometry)
    if count < _MIN_PAIRS:
        return
    too_far_m = np.stack(_rolled(moves.by_odometry)) - np.stack(_rolled(moves.by_scans))  # (2, N)
    slips = too_far_m > _SLIP_M
    worst = int(slips[1].sum() > slips[0].sum())
    slipped = int(slips[worst].sum())
    if slipped < max(_MIN_SLIPS, _SLIP_SHARE * count) or slipped < 2 * slips[1 - worst].sum():
        return
    yield Finding(
        "wheel-slips",
        f"in {slipped} of {count} pairs of scans the {_SIDES[worst]} wheel of {link} counts "
        f"{np.median(too_far_m[worst][slips[worst]]):.2f} m more than it moved",
        f"accelerate less, put more weight on the {_SIDES[worst]} wheel or clean its tyre; until then raise "
        f"wheel_{_SIDES[worst]}_noise_m (odom_model_type wheels)",
    )


def _rolled(moves: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """(N,) increments left and right [m] of moves (N, 3)."""
    turn = angles.wrap(moves[:, 2])
    way_m = np.hypot(moves[:, 0], moves[:, 1])
    half_m = 0.5 * WHEEL_BASE_M * turn
    return way_m - half_m, way_m + half_m
