"""The last scans, to be looked up by their stamps: what did the robot see when it reported a meetpoint?"""

from __future__ import annotations

import threading
from collections import deque
from typing import Deque, Optional

import rospy
import tf2_ros
from sensor_msgs.msg import LaserScan

from glass_nav.ros import conversions
from glass_nav.sensing.scan import Scan, ScanError

_KEPT = 100  # scans
_WAIT_S = 0.5  # for one that is still on its way, by the wall clock


class ScanMemory:
    """Subscribes to scan; at() may be called from any thread."""

    def __init__(self) -> None:
        self._scans: Deque[LaserScan] = deque(maxlen=_KEPT)
        self._came = threading.Condition()
        self._tf = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._tf)
        self._subscriber = rospy.Subscriber(
            "scan", LaserScan, self._keep, queue_size=10, buff_size=2**22, tcp_nodelay=True
        )

    def _keep(self, msg: LaserScan) -> None:
        with self._came:
            self._scans.append(msg)
            self._came.notify_all()

    def at(self, stamp: rospy.Time, base_frame: str) -> "tuple[Optional[Scan], str]":
        """The scan of that stamp, or None and why there is none."""
        with self._came:
            self._came.wait_for(lambda: self._find(stamp) is not None, _WAIT_S)
            msg = self._find(stamp)
        if msg is None:
            return None, f"no scan on {self._subscriber.resolved_name} has the stamp {stamp.to_sec():.3f} s"
        laser_frame = conversions.frame_id(msg.header.frame_id)
        try:
            transform = self._tf.lookup_transform(conversions.frame_id(base_frame), laser_frame, stamp)
            return conversions.scan_from_msg(msg, conversions.mounting_from_transform(transform.transform)), ""
        except (tf2_ros.TransformException, ScanError, ValueError) as err:
            return None, str(err)

    def _find(self, stamp: rospy.Time) -> Optional[LaserScan]:
        return next((msg for msg in reversed(self._scans) if msg.header.stamp == stamp), None)
