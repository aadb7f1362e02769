"""Odometry from topics with encoder counts, in place of tf; sensing/wheel_odometry.py integrates them."""

from __future__ import annotations

import threading
from typing import Any, Callable

import numpy as np
import roslib.message
import rospy
import tf2_ros

from glass_nav.ros import conversions
from glass_nav.ros.localization.params import LocalizationParams
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.tf_transforms import TfTransforms
from glass_nav.sensing import wheel_odometry
from glass_nav.sensing.wheel_odometry import WheelOdometry


class WheelTransforms(TfTransforms):
    """Odometry by the wheels; where the lidars sit still comes from tf."""

    def __init__(self, p: LocalizationParams, tf: tf2_ros.Buffer, log: LogThrottle) -> None:
        super().__init__(tf, p.node.odom_frame_id, p.node.base_frame_id)
        self._p, self._log = p, log
        self._lock = threading.Lock()  # counts come by other threads
        self._odometry = WheelOdometry(p.wheels, p.localizer.odometry.wheel_base_m)
        self._told_resets = (0, 0)
        self._broadcaster = tf2_ros.TransformBroadcaster() if p.node.publish_wheel_tf else None

    def subscribe(self) -> None:
        """Subscribe to the counts, whatever their type."""
        for number, topic in enumerate(self._p.wheels.wheel_topics):
            rospy.Subscriber(topic, rospy.AnyMsg, self._taker(number), queue_size=100, tcp_nodelay=True)

    def reconfigure(self, p: LocalizationParams) -> None:
        """Use another distance between the wheels from now on."""
        with self._lock:
            self._odometry.wheel_base_m = p.localizer.odometry.wheel_base_m

    def restart(self) -> None:
        """Time has jumped: the counts start over."""
        with self._lock:
            self._odometry.restart()

    @property
    def odometry_name(self) -> str:
        """The names of the topics, for messages."""
        return " and ".join(rospy.resolve_name(topic) for topic in self._p.wheels.wheel_topics)

    def has_odometry(self) -> bool:
        """Whether both wheels have been heard."""
        return len(self._odometry.trajectory) > 0

    def odom_from_base(self, stamp_ns: int) -> np.ndarray:
        with self._lock:
            return self._odometry.odom_from_base(stamp_ns)

    def _taker(self, number: int) -> Callable[[rospy.AnyMsg], None]:
        return lambda msg: self._take(number, msg)

    def _take(self, number: int, packed: rospy.AnyMsg) -> None:
        kind = packed._connection_header["type"]
        message_class = roslib.message.get_message_class(kind)
        if message_class is None:
            self._log.error(f"wheel counts not used: {kind} is not installed")
            return
        msg: Any = message_class().deserialize(packed._buff)
        try:
            told = wheel_odometry.counts(msg, number, self._p.wheels)
        except ValueError as err:
            self._log.error(f"wheel counts not used: {err}")
            return
        stamp_ns = conversions.ns_from_stamp(msg.header.stamp if hasattr(msg, "header") else rospy.Time.now())
        with self._lock:
            news_ns = self._odometry.add(stamp_ns, told, wheel_odometry.wraps_at(kind))
            poses = self._odometry.trajectory.at(news_ns) if len(news_ns) else np.zeros((0, 3))
            resets = self._odometry.resets
        if resets != self._told_resets:
            self._told_resets = resets
            self._log.warn(
                f"an encoder restarted (left {resets[0]}, right {resets[1]} times): its wheel is assumed to have stood still"
            )
        if self._broadcaster is not None:
            for news, pose in zip(news_ns.tolist(), poses):
                self._broadcaster.sendTransform(
                    conversions.transform_stamped(news, self._odom_frame, self._base_frame, pose)
                )
