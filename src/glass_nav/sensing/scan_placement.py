"""Makes a scan from a message or record: its pose on the robot, its odometry, and deskewed.

Every scan enters here, whether the robot runs, a bag is read, or a scan is looked up by its stamp. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Protocol

import numpy as np

from glass_nav.geometry.trajectory import Trajectory
from glass_nav.sensing import deskew, range_limits
from glass_nav.sensing.mounting import Mounting
from glass_nav.sensing.range_limits import RangeLimits
from glass_nav.sensing.scan import Scan, ScanError, scan_from_fields


class NoTransform(ScanError):
    """A transform is not known at that time. On a running robot it may still come; the text says which one it is."""


class Transforms(Protocol):
    """The transforms of the robot, from tf, a bag or a rawlog."""

    def odom_from_base(self, stamp_ns: int) -> np.ndarray:
        """(3,) odometry at that time; NoTransform without it, ScanError if it is no pose."""

    def mounting(self, lidar: str, stamp_ns: int) -> Mounting:
        """Pose of that lidar on the robot at that time; NoTransform if unknown, ScanError if it is not level."""


@dataclass(frozen=True)
class RawScan:
    """A sweep of a lidar as its driver sends it: the fields of a LaserScan."""

    stamp_ns: int  # of the first beam
    lidar: str  # by its frame, without a leading slash
    ranges_m: np.ndarray  # (B,)
    angle_min_rad: float
    angle_max_rad: float
    angle_increment_rad: float
    range_min_m: float
    range_max_m: float
    time_increment_s: float = 0.0  # from each beam to the next; 0: not known
    scan_time_s: float = 0.0  # from each sweep to the next; 0: not known
    intensities: Optional[np.ndarray] = None  # (B,) or empty, in the driver's unit

    @property
    def timing_fault(self) -> Optional[str]:
        """Why its beams cannot be as far apart in time as it says; None if they can."""
        return deskew.fault(len(self.ranges_m), self.time_increment_s, self.scan_time_s)

    @property
    def sweep_ns(self) -> int:
        """Time from the first beam to the last one; 0 if unknown or impossible."""
        if self.timing_fault is not None:
            return 0
        return deskew.sweep_ns(len(self.ranges_m), self.time_increment_s)


@dataclass(frozen=True)
class ScanTransforms:
    """Those that a scan is placed by."""

    odom_from_base: np.ndarray  # (3,) at its stamp
    mounting: Mounting


@dataclass(frozen=True)
class PlacedScan:
    """A scan with all that the filter needs."""

    raw: RawScan
    scan: Scan
    mounting: Mounting
    odom_from_base: np.ndarray  # (3,) at its stamp


def mounted(raw: RawScan, mounting: Mounting, limits: Optional[RangeLimits] = None) -> Scan:
    """The scan of a lidar that sits there, as measured. ScanError if its fields describe no lidar."""
    limits = limits or RangeLimits()
    return scan_from_fields(
        raw.stamp_ns,
        raw.ranges_m,
        raw.angle_min_rad,
        raw.angle_increment_rad,
        raw.range_min_m,
        limits.range_max_m(raw.lidar, raw.range_max_m, raw.range_min_m, raw.ranges_m),
        mounting.base_from_laser,
        mounting.upside_down,
        raw.lidar,
        raw.time_increment_s,
        raw.intensities,
    )


class ScanPlacement:
    """Places scans by the transforms of one robot."""

    def __init__(self, transforms: Transforms, deskews: bool = True, limits: Optional[RangeLimits] = None) -> None:
        """
        Args:
            transforms: of the robot.
            deskews: whether scans are deskewed.
            limits: what is known of the lidars so far; None: nothing.
        """
        self._transforms, self._deskews = transforms, deskews
        self._limits = limits or RangeLimits()

    def timing_fault(self, raw: RawScan) -> Optional[str]:
        """Why the scan cannot be deskewed although it should be; None if it can."""
        return raw.timing_fault if self._deskews else None

    def range_fault(self, raw: RawScan) -> Optional[str]:
        """A warning if the scan sets no range_max and the longest range seen stands in for it; else None."""
        assumed = self._limits.is_assumed(raw.range_max_m)
        return range_limits.warning(raw.lidar, raw.range_max_m) if assumed else None

    def transforms(self, raw: RawScan) -> ScanTransforms:
        """Those at the stamp of a scan, once all that place() needs are known. NoTransform if one is not; ScanError."""
        found = self._at_stamp(raw)
        if self._sweep_ns(raw):
            self._transforms.odom_from_base(raw.stamp_ns + raw.sweep_ns)
        return found

    def missing(self, raw: RawScan) -> Optional[str]:
        """The first transform that the scan lacks, in words; None if place() finds all that it needs."""
        try:
            self.transforms(raw)
        except NoTransform as err:
            return str(err)
        except ScanError:  # it is there, but of no use: for place() to say
            pass
        return None

    def place(self, raw: RawScan, transforms: Optional[ScanTransforms] = None) -> PlacedScan:
        """The scan with the odometry at its stamp.

        Args:
            raw: the scan.
            transforms: of it; None: they are looked up.

        Raises:
            NoTransform: one of its transforms is not known.
            ScanError: it cannot be used, whatever transforms come.
        """
        found = transforms or self._at_stamp(raw)
        scan = self._deskewed(raw, mounted(raw, found.mounting, self._limits))
        return PlacedScan(raw, scan, found.mounting, found.odom_from_base)

    def _at_stamp(self, raw: RawScan) -> ScanTransforms:
        return ScanTransforms(
            self._transforms.odom_from_base(raw.stamp_ns), self._transforms.mounting(raw.lidar, raw.stamp_ns)
        )

    def scan(self, raw: RawScan) -> Scan:
        """The scan alone; odometry is needed only to deskew it. Raises as place() does."""
        mounting = self._transforms.mounting(raw.lidar, raw.stamp_ns)
        return self._deskewed(raw, mounted(raw, mounting, self._limits))

    def _sweep_ns(self, raw: RawScan) -> int:
        return raw.sweep_ns if self._deskews else 0

    def _deskewed(self, raw: RawScan, scan: Scan) -> Scan:
        if not self._sweep_ns(raw):
            return scan
        stamps_ns = deskew.knots_ns(raw.stamp_ns, raw.sweep_ns)
        odometry = [self._transforms.odom_from_base(int(stamp_ns)) for stamp_ns in stamps_ns]
        return deskew.deskewed(scan, Trajectory(stamps_ns, np.array(odometry)))
