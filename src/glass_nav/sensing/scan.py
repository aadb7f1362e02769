"""One sweep of a 2D lidar, with checked fields.

B beams. Ranges follow REP 117: -inf too near, +inf nothing met, NaN no measurement.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Optional

import numpy as np

_ONE_PIECE_M = 0.25  # edge of a square of the floor: beams that end in one are one piece of evidence


class ScanError(ValueError):
    """A scan that cannot be used.

    The text says why, with the scan's stamp where it is given; `reason` leaves the stamp out, so that equal reasons can
    be counted.
    """

    def __init__(self, reason: str, stamp_ns: Optional[int] = None) -> None:
        super().__init__(reason if stamp_ns is None else f"scan at {stamp_ns * 1e-9:.3f} s: {reason}")
        self.reason = reason


@dataclass(frozen=True)
class Scan:
    """Ranges along the beams of one lidar, and where that lidar sits on the robot."""

    stamp_ns: int  # time of the data [ns]
    ranges_m: np.ndarray  # (B,) along each beam, REP 117
    angles_rad: np.ndarray  # (B,) direction of each beam in the laser's frame
    range_min_m: float
    range_max_m: float
    base_from_laser: np.ndarray  # (3,) planar pose of the laser on the robot
    lidar: str = ""  # which one of several: by its frame
    time_increment_s: float = 0.0  # from each beam to the next; 0: all at the stamp
    origins_m: Optional[np.ndarray] = None  # (B, 2) where in the laser's frame each beam began; None: at (0, 0)
    intensities: Optional[np.ndarray] = None  # (B,) of the echoes, in the driver's unit; None: it gives none

    def __len__(self) -> int:
        return len(self.ranges_m)

    @property
    def answered(self) -> np.ndarray:
        """(B,) bool: the beam came back with a range."""
        return np.isfinite(self.ranges_m)

    def points_in_base(self) -> np.ndarray:
        """(B, 2) end points [m] in the robot's frame, not to be changed; NaN where the beam did not answer."""
        return self._points_in_base

    @cached_property
    def _points_in_base(self) -> np.ndarray:
        x, y, yaw = self.base_from_laser
        bearing = self.angles_rad + yaw
        ranges_m = np.where(self.answered, self.ranges_m, np.nan)
        points_m = np.stack([x + ranges_m * np.cos(bearing), y + ranges_m * np.sin(bearing)], axis=-1)
        points_m.flags.writeable = False
        return points_m

    @cached_property
    def _one_of_each_piece(self) -> np.ndarray:
        beams = np.flatnonzero(self.answered)
        squares = np.floor(self.points_in_base()[beams] / _ONE_PIECE_M).astype(np.int64)
        _, first = np.unique(squares @ [1, 2**31], return_index=True)
        pieces = np.sort(beams[first])
        pieces.flags.writeable = False
        return pieces

    def as_measured(self, ranges_m: np.ndarray) -> np.ndarray:
        """(B,) ranges from where each beam began, of points on the beams with these ranges from the laser at the stamp.

        They differ for a scan that was deskewed, see deskew.py: the driver's ranges are from where each beam began.
        """
        if self.origins_m is None:
            return ranges_m
        finite = np.isfinite(ranges_m)
        along_m = np.where(finite, ranges_m, 0.0)
        return np.where(
            finite,
            np.hypot(
                along_m * np.cos(self.angles_rad) - self.origins_m[:, 0],
                along_m * np.sin(self.angles_rad) - self.origins_m[:, 1],
            ),
            ranges_m,
        )

    def limited(self, min_range_m: float, max_range_m: float) -> "Scan":
        """The same scan without the ranges outside these limits; a negative limit is the scan's own.

        Raises:
            ScanError: no range is left between the limits.
        """
        if min_range_m < 0.0 and max_range_m < 0.0:
            return self
        low = max(self.range_min_m, min_range_m)
        high = min(self.range_max_m, max_range_m) if max_range_m >= 0.0 else self.range_max_m
        if not low < high:
            raise ScanError(f"no range is left between {low:g} m and {high:g} m", self.stamp_ns)
        ranges_m = self.ranges_m.copy()
        with np.errstate(invalid="ignore"):
            ranges_m[ranges_m < low] = -np.inf
            ranges_m[ranges_m >= high] = np.inf
        return replace(self, ranges_m=ranges_m, range_min_m=low, range_max_m=high)


def scan_from_fields(
    stamp_ns: int,
    ranges_m: np.ndarray,
    angle_min_rad: float,
    angle_increment_rad: float,
    range_min_m: float,
    range_max_m: float,
    base_from_laser: np.ndarray,
    upside_down: bool = False,
    lidar: str = "",
    time_increment_s: float = 0.0,
    intensities: Optional[np.ndarray] = None,
) -> Scan:
    """The fields of a LaserScan as a Scan, by REP 117.

    A range at or beyond range_max is +inf (nothing met), one below range_min -inf (too near),
    NaN stays NaN; many old drivers write 0 or range_max + 1 for "no answer", and both land where
    REP 117 wants them (0 is a failed measurement, so NaN).

    Args:
        stamp_ns: time of the scan [ns].
        ranges_m: (B,) as the driver wrote them.
        angle_min_rad, angle_increment_rad: first beam and step in the laser's frame.
        range_min_m, range_max_m: the sensor's limits.
        base_from_laser: (3,) planar pose of the laser on the robot.
        upside_down: the laser's z points down; its angles run clockwise seen from above.
        lidar: name of the lidar where there are several.
        time_increment_s: from each beam to the next.
        intensities: (B,) as the driver wrote them; of any other length: there are none.

    Raises:
        ScanError: no beams, or fields that describe no lidar.
    """
    ranges_m = np.array(ranges_m, dtype=float).reshape(-1)
    _check_lidar(stamp_ns, len(ranges_m), angle_min_rad, angle_increment_rad, range_min_m, range_max_m)
    if np.shape(base_from_laser) != (3,) or not np.all(np.isfinite(base_from_laser)):
        raise ScanError(f"the laser's pose on the robot must be finite x, y, yaw, got {base_from_laser}", stamp_ns)
    angles_rad = angle_min_rad + angle_increment_rad * np.arange(len(ranges_m))
    with np.errstate(invalid="ignore"):
        ranges_m[ranges_m >= range_max_m] = np.inf
        failed = ranges_m == 0.0
        ranges_m[ranges_m < range_min_m] = -np.inf
        ranges_m[failed] = np.nan
    return Scan(
        int(stamp_ns),
        ranges_m,
        -angles_rad if upside_down else angles_rad,
        float(range_min_m),
        float(range_max_m),
        np.asarray(base_from_laser, float),
        lidar,
        time_increment_s,
        intensities=None
        if intensities is None or len(intensities) != len(ranges_m)
        else np.asarray(intensities, float),
    )


def _check_lidar(
    stamp_ns: int,
    beams: int,
    angle_min_rad: float,
    angle_increment_rad: float,
    range_min_m: float,
    range_max_m: float,
) -> None:
    """Raise ScanError for fields that describe no lidar."""
    if not beams:
        raise ScanError("no ranges, a scan needs at least 1", stamp_ns)
    if not (np.isfinite(angle_increment_rad) and angle_increment_rad != 0.0) and beams > 1:
        raise ScanError(f"angle_increment must be finite and not 0 rad, got {angle_increment_rad}", stamp_ns)
    if not np.isfinite(angle_min_rad):
        raise ScanError(f"angle_min must be finite, got {angle_min_rad}", stamp_ns)
    if not (np.isfinite(range_max_m) and range_max_m > 0.0):
        raise ScanError(f"range_max must be finite and > 0 m, got {range_max_m}", stamp_ns)
    if not 0.0 <= range_min_m < range_max_m:
        raise ScanError(f"range_min must be in [0, range_max = {range_max_m}) m, got {range_min_m}", stamp_ns)


def spread_evenly(usable: np.ndarray, count: int) -> np.ndarray:
    """Indices of at most count beams that are usable (> 0), spread evenly over those there are."""
    beams = np.flatnonzero(usable > 0)
    if len(beams) <= count:
        return beams
    steps = np.arange(count) * ((len(beams) - 1) / max(count - 1, 1))
    return beams[np.rint(steps).astype(int)]


def one_of_each_piece(scan: Scan) -> np.ndarray:
    """Indices of beams that returned, one for each square of the floor that any ended in.

    Neighbouring beams that end at one thing tell one thing. By angle, most beams end at what is close: a person beside the
    robot would outvote all walls behind. Not to be changed.
    """
    return scan._one_of_each_piece
