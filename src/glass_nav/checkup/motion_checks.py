"""Checks odometry and the lidar's mounting against the motion between scans. N pairs of scans."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterator, List, Sequence, Tuple

import numpy as np

from glass_nav.checkup.finding import Finding
from glass_nav.checkup.scan_motion import MIN_POINTS, EarlierScan
from glass_nav.geometry import angles, se2

PAIRS = 24  # with a turn, and as many straight ahead
_AHEAD = 60  # scans that are looked through for the later one of a pair
_WAY_M, _TURN_RAD = 0.3, 0.2  # of a pair
_MAX_M, _MAX_RAD = 1.0, 0.6
_REACH_M, _REACH_RAD = 1.5, 0.9
_STILL_M, _STILL_RAD = 0.02, 0.02
_MIN_PAIRS = 6
_SCALE, _TURN_SCALE = 0.1, 0.2  # that an odometry may be off by
_SPREAD = 0.4  # interquartile range over the median: more, and nothing is known
_ASKEW_RAD, _ASKEW_SPREAD = np.radians(8.0), np.radians(12.0)


@dataclass(frozen=True)
class Moves:
    """How the lidar moved between the scans of each pair, (N, 3) each in the earlier one's frame."""

    by_odometry: np.ndarray
    by_scans: np.ndarray
    idle: bool  # odometry did not move at all; the pairs are far apart in time


def measure(points_m: Sequence[np.ndarray], odom_from_laser: np.ndarray) -> Moves:
    """Pairs of scans with some motion, measured by scans and by odometry.

    Args:
        points_m: of each scan, (B, 2) finite end points in the lidar's frame.
        odom_from_laser: (S, 3) at each scan.
    """
    idle = bool(
        np.ptp(odom_from_laser[:, :2], axis=0).max() < _WAY_M
        and np.abs(angles.wrap(odom_from_laser[:, 2] - odom_from_laser[0, 2])).max() < _TURN_RAD
    )
    pairs = _far_apart(len(points_m)) if idle else _pairs(odom_from_laser)
    rows: List[Tuple[np.ndarray, np.ndarray]] = []
    for first, later in pairs:
        if min(len(points_m[first]), len(points_m[later])) < MIN_POINTS:
            continue
        motion = EarlierScan(points_m[first]).motion_to(points_m[later], _REACH_M, _REACH_RAD)
        if motion is not None:
            odometry = se2.compose(se2.inverse(odom_from_laser[first]), odom_from_laser[later])
            rows.append((odometry, motion.earlier_from_later))
    both = np.array(rows, float).reshape(-1, 2, 3)
    return Moves(both[:, 0], both[:, 1], idle)


def _far_apart(count: int) -> List[Tuple[int, int]]:
    step = max(1, count // 40)
    return [(first, first + max(1, step // 2)) for first in range(0, count - max(1, step // 2), step)]


def _pairs(odom_from_laser: np.ndarray) -> List[Tuple[int, int]]:
    """Pairs of scans with and without a turn between them, spread over the log."""
    turning: List[Tuple[int, int]] = []
    straight: List[Tuple[int, int]] = []
    for first in range(0, len(odom_from_laser) - 1, max(1, len(odom_from_laser) // 1500)):
        ahead = odom_from_laser[first + 1 : first + 1 + _AHEAD]
        move = se2.compose(se2.inverse(odom_from_laser[first]), ahead)
        way_m, turn = np.hypot(move[:, 0], move[:, 1]), np.abs(move[:, 2])
        enough = np.nonzero((way_m >= _WAY_M) | (turn >= _TURN_RAD))[0]
        if not len(enough):
            continue
        at = int(enough[0])
        chosen = turning if turn[at] >= _TURN_RAD else straight
        overlaps = bool(chosen) and first < (chosen[-1][0] + chosen[-1][1]) // 2  # holds nothing new
        if way_m[at] <= _MAX_M and turn[at] <= _MAX_RAD and not overlaps:
            chosen.append((first, first + 1 + at))
    return [
        pairs[index]
        for pairs in (turning, straight)
        if pairs
        for index in np.unique(np.linspace(0, len(pairs) - 1, PAIRS).astype(int))
    ]


@dataclass(frozen=True)
class Ratio:
    """Quotients of what scans and odometry say, by their quartiles."""

    count: int
    low: float
    middle: float
    high: float

    @property
    def is_known(self) -> bool:
        """Whether there are enough pairs, and they agree."""
        return self.count >= _MIN_PAIRS and self.high - self.low < _SPREAD * abs(self.middle)


def way_ratio(moves: Moves) -> Ratio:
    """Ratio of the distances between scans, for pairs with little turn."""
    by_odometry, by_scans = straight(moves)
    return _ratio(np.hypot(by_scans[:, 0], by_scans[:, 1]) / np.hypot(by_odometry[:, 0], by_odometry[:, 1]))


def turn_ratio(moves: Moves) -> Ratio:
    """Ratio of the turns; negative where scans and odometry turn opposite ways."""
    turning = np.abs(moves.by_odometry[:, 2]) >= 0.6 * _TURN_RAD
    return _ratio(moves.by_scans[turning, 2] / moves.by_odometry[turning, 2])


def straight(moves: Moves) -> Tuple[np.ndarray, np.ndarray]:
    """Motions of the lidar by odometry and by scans, (M, 3) each, of the pairs with little turn."""
    way_m, turn = np.hypot(moves.by_odometry[:, 0], moves.by_odometry[:, 1]), np.abs(moves.by_odometry[:, 2])
    straight = (way_m >= 0.6 * _WAY_M) & (turn < 0.25)
    return moves.by_odometry[straight], moves.by_scans[straight]


def _ratio(quotients: np.ndarray) -> Ratio:
    if not len(quotients):
        return Ratio(0, np.nan, np.nan, np.nan)
    low, middle, high = np.percentile(quotients, [25, 50, 75])
    return Ratio(len(quotients), float(low), float(middle), float(high))


def turns_are_opposite(moves: Moves) -> bool:
    """Scans turn the other way than odometry: one of the two is mirrored."""
    ratio = turn_ratio(moves)
    return ratio.is_known and ratio.middle < -0.5


def check(moves: Moves, lidar: str, link: str, opposite: bool) -> Iterator[Finding]:
    """Findings on odometry and on the lidar's place.

    Args:
        moves: of one lidar.
        lidar, link: names of its frame and of odometry's frames, for the text.
        opposite: turns_are_opposite(), explained elsewhere.
    """
    if moves.idle:
        moved = (np.hypot(moves.by_scans[:, 0], moves.by_scans[:, 1]) > 0.15) | (np.abs(moves.by_scans[:, 2]) > 0.1)
        if moved.sum() >= _MIN_PAIRS and moved.mean() > 0.3:
            yield Finding(
                "odometry-stands",
                f"{link} does not move, but the scans do",
                "the wheel encoders or their node do not work: rostopic echo the odometry while driving",
            )
        return
    ways, turns = way_ratio(moves), turn_ratio(moves)
    if ways.is_known and not 1.0 - _SCALE < ways.middle < 1.0 / (1.0 - _SCALE):
        yield Finding(
            "odometry-scale",
            f"for each metre of {link} the scans move {ways.middle:.2f} m ({ways.count} pairs of scans)",
            f"multiply the wheels' radius in the base's driver by {ways.middle:.2f}, or look for a wrong "
            "gear ratio or ticks per turn",
        )
    if turns.is_known and not opposite and not 1.0 - _TURN_SCALE < turns.middle < 1.0 / (1.0 - _TURN_SCALE):
        yield Finding(
            "odometry-turn-scale",
            f"for each degree that {link} turns the scans turn {turns.middle:.2f} degrees ({turns.count} "
            "pairs of scans)",
            f"divide the distance between left and right wheel in the base's driver by {turns.middle:.2f}; for a "
            "gyro, look at its scale",
        )
    if not opposite:
        yield from _askew(moves, lidar)


def _askew(moves: Moves, lidar: str) -> Iterator[Finding]:
    by_odometry, by_scans = straight(moves)
    if len(by_odometry) < _MIN_PAIRS:
        return
    off = angles.wrap(np.arctan2(by_odometry[:, 1], by_odometry[:, 0]) - np.arctan2(by_scans[:, 1], by_scans[:, 0]))
    middle = angles.mean(off)
    low, high = np.percentile(angles.wrap(off - middle), [25, 75])
    centre = float(angles.wrap(middle + np.median(angles.wrap(off - middle))))
    if high - low < _ASKEW_SPREAD and abs(centre) > _ASKEW_RAD:
        yield Finding(
            "lidar-turned",
            f"the scans move {np.degrees(abs(centre)):.0f} deg to the {'right' if centre > 0.0 else 'left'} "
            f"of where the robot drives ({len(off)} pairs of scans)",
            f"add {np.degrees(centre):+.0f} deg to the yaw of {lidar} in the URDF or "
            "static_transform_publisher: the lidar is mounted turned",
        )
