"""Transforms of a robot that moves at a constant velocity, known up to a time that the test sets."""

from __future__ import annotations

from typing import Dict, List

import numpy as np

from glass_nav.sensing.mounting import Mounting
from glass_nav.sensing.scan_placement import NoTransform, RawScan, Transforms

STAMP_NS = 1_000_000_000_000


def raw_scan(stamp_ns: int = STAMP_NS, lidar: str = "laser", **fields: object) -> RawScan:
    """Five beams over 1 rad, each 2 m long."""
    values: Dict[str, object] = dict(
        ranges_m=np.full(5, 2.0),
        angle_min_rad=-0.5,
        angle_max_rad=0.5,
        angle_increment_rad=0.25,
        range_min_m=0.1,
        range_max_m=10.0,
    )
    return RawScan(stamp_ns, lidar, **{**values, **fields})  # type: ignore[arg-type]


class MadeTransforms(Transforms):
    """Straight odometry from (0, 0) at STAMP_NS on; a lidar for each mounting."""

    def __init__(self, **mountings: Mounting) -> None:
        self.mountings = mountings or {"laser": Mounting(np.array([0.2, 0.0, 0.0]), 0.4)}
        self.velocity = np.array([1.0, 0.0, 0.0])  # [m/s], [m/s], [rad/s]
        self.known_until_ns = STAMP_NS + 10**12
        self.asked_ns: List[int] = []  # for odometry

    def odom_from_base(self, stamp_ns: int) -> np.ndarray:
        self.asked_ns.append(stamp_ns)
        if stamp_ns > self.known_until_ns:
            raise NoTransform("no transform odom <- base")
        return self.velocity * (stamp_ns - STAMP_NS) * 1e-9

    def mounting(self, lidar: str, stamp_ns: int) -> Mounting:
        if lidar not in self.mountings:
            raise NoTransform(f"no transform base <- {lidar}")
        return self.mountings[lidar]
