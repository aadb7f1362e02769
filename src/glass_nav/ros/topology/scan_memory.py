"""The last scans, placed on request: by the stamp of a meetpoint, or the newest."""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Deque, Optional

import rospy
import tf2_ros
from sensor_msgs.msg import LaserScan

from glass_nav.ros import conversions
from glass_nav.ros.tf_transforms import TfTransforms
from glass_nav.sensing.range_limits import RangeLimits
from glass_nav.sensing.scan import Scan, ScanError
from glass_nav.sensing.scan_placement import NoTransform, PlacedScan, RawScan, ScanPlacement

_KEPT = 100  # scans
_MAX_WAIT_S, _POLL_S = 0.5, 0.02  # for a scan or a transform that is still on its way, by the wall clock


class ScanMemory:
    """Subscribes to scan; at() and newest() are for one other thread."""

    def __init__(self, odom_frame: str) -> None:
        self._odom_frame = odom_frame
        self._scans: Deque[RawScan] = deque(maxlen=_KEPT)
        self._limits = RangeLimits()
        self._given_ns = -1  # stamp of the last of newest()
        self._came = threading.Condition()
        self._tf = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._tf)
        self._subscriber = rospy.Subscriber(
            "scan", LaserScan, self._keep, queue_size=10, buff_size=2**22, tcp_nodelay=True
        )

    def _keep(self, msg: LaserScan) -> None:
        with self._came:
            self._scans.append(conversions.raw_scan_from_msg(msg))
            self._came.notify_all()

    def at(self, stamp: rospy.Time, base_frame: str) -> "tuple[Optional[Scan], str]":
        """The scan of that stamp, deskewed; or None and why there is none."""
        transforms = TfTransforms(self._tf, self._odom_frame, conversions.frame_id(base_frame))
        placement = ScanPlacement(transforms, limits=self._limits)
        deadline_s = time.monotonic() + _MAX_WAIT_S
        while True:
            try:
                return placement.scan(self._find(conversions.ns_from_stamp(stamp))), ""
            except (LookupError, NoTransform) as err:
                if time.monotonic() >= deadline_s:
                    return None, str(err)
            except ScanError as err:
                return None, str(err)
            with self._came:
                self._came.wait(_POLL_S)

    def newest(self, base_frame: str) -> Optional[PlacedScan]:
        """The newest scan that can be placed, deskewed and with odometry; None: there is none since the last call."""
        transforms = TfTransforms(self._tf, self._odom_frame, conversions.frame_id(base_frame))
        placement = ScanPlacement(transforms, limits=self._limits)
        with self._came:
            scans = [raw for raw in self._scans if raw.stamp_ns > self._given_ns]
        for raw in reversed(scans):
            try:
                placed = placement.place(raw)
            except ScanError:  # its transforms are on their way, or it is of no use
                continue
            self._given_ns = raw.stamp_ns
            return placed
        return None

    def forget(self) -> None:
        """Forget all scans: time jumped back."""
        with self._came:
            self._scans.clear()
        self._given_ns = -1

    def _find(self, stamp_ns: int) -> RawScan:
        with self._came:
            for raw in reversed(self._scans):
                if raw.stamp_ns == stamp_ns:
                    return raw
        raise LookupError(f"no scan on {self._subscriber.resolved_name} has the stamp {stamp_ns * 1e-9:.3f} s")
