"""Scans of one or several lidars, from their topics; sensing/scan_queue.py decides how they are used."""

from __future__ import annotations

from typing import Callable, List, Optional

import rospy
import tf2_ros
from sensor_msgs.msg import LaserScan

from glass_nav.ros import conversions
from glass_nav.ros.localization.params import LocalizationNodeParams
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.tf_transforms import TfTransforms
from glass_nav.sensing.deskew import Deskew
from glass_nav.sensing.range_limits import RangeLimits
from glass_nav.sensing.scan_placement import ScanPlacement, Transforms
from glass_nav.sensing.scan_queue import ScanQueue


class ScanInput(ScanQueue):
    """A queue of scans that is fed by topics and gets its transforms from tf."""

    def __init__(
        self,
        p: LocalizationNodeParams,
        deskew: Deskew,
        tf: tf2_ros.Buffer,
        log: LogThrottle,
        laser_max_range_m: float = -1.0,
        transforms: Optional[Transforms] = None,
    ) -> None:
        """
        Args:
            p, deskew: parameters of the node.
            tf: where transforms are looked up.
            log: of the node.
            laser_max_range_m: where a lidar sets none.
            transforms: in place of tf's.
        """
        self._tf, self._transforms = tf, transforms
        self._limits = RangeLimits(laser_max_range_m)
        super().__init__(self._placement_by_tf(p, deskew), p.transform_wait_s, rospy.get_time(), log.warn)
        self._topics = p.scan_topics or ("scan",)
        self._subscribers: List[rospy.Subscriber] = []

    def reconfigure(self, p: LocalizationNodeParams, deskew: Deskew, laser_max_range_m: float) -> None:
        """Change the parameters."""
        self._limits.use(laser_max_range_m)
        self.use(self._placement_by_tf(p, deskew), p.transform_wait_s)

    def subscribe(self, put: Callable[[LaserScan], None]) -> None:
        """Subscribe; put is called by other threads."""
        self._subscribers = [  # Nagle's algorithm would hold small messages for 40 ms
            rospy.Subscriber(topic, LaserScan, put, queue_size=100, buff_size=2**22, tcp_nodelay=True)
            for topic in self._topics
        ]

    def receive(self, msg: LaserScan, now_s: float, unusable: Optional[str]) -> Optional[str]:
        """A message of one of the topics; as add()."""
        return self.add(conversions.raw_scan_from_msg(msg), now_s, unusable)

    @property
    def unpublished(self) -> str:
        """The topics, if none has a publisher; else ""."""
        if any(subscriber.get_num_connections() for subscriber in self._subscribers):
            return ""
        return ", ".join(rospy.resolve_name(topic) for topic in self._topics)

    def silence(self, now_s: float) -> str:
        """The log line about missing scans."""
        topics = ", ".join(rospy.resolve_name(topic) for topic in self._topics)
        publishers = sum(subscriber.get_num_connections() for subscriber in self._subscribers)
        return f"no scan on {topics} for {now_s - self.last_arrival_s:.0f} s: " + (
            "its publisher is silent" if publishers else "nobody publishes it"
        )

    def _placement_by_tf(self, p: LocalizationNodeParams, deskew: Deskew) -> ScanPlacement:
        transforms = self._transforms or TfTransforms(self._tf, p.odom_frame_id, p.base_frame_id)
        return ScanPlacement(transforms, deskew.deskew, self._limits)
