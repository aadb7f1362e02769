"""Bearings to landmarks, stored from their topic until a scan passes them to the filter."""

from __future__ import annotations

from collections import deque
from typing import Callable, Deque

import numpy as np
import rospy
import tf2_ros

from glass_nav.localization.method import PoseFilter
from glass_nav.msg import LandmarkBearings
from glass_nav.ros import conversions
from glass_nav.ros.landmarks import bearing_messages
from glass_nav.ros.localization.params import LocalizationNodeParams
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.sensing import bearings
from glass_nav.sensing.scan_placement import Transforms
from glass_nav.world import landmark_file, landmark_map

WAITING = 100  # messages that may wait for a scan


class BearingInput:
    """Stores bearings until a scan that is not older, and logs unusable ones; inactive without ~landmark_file."""

    def __init__(self, p: LocalizationNodeParams, tf: tf2_ros.Buffer, transforms: Transforms, log: LogThrottle) -> None:
        """
        Raises:
            LandmarkError: the landmark file is unusable; one line.
        """
        self._p, self._tf, self._transforms, self._log = p, tf, transforms, log
        self._landmarks = landmark_file.load(p.landmark_file) if p.landmark_file else landmark_map.NONE
        self._waiting: Deque[LandmarkBearings] = deque(maxlen=WAITING)

    def subscribe(self, put: Callable[[LandmarkBearings], None]) -> None:
        """Subscribe, if there are landmarks; put is called by other threads."""
        if len(self._landmarks):
            rospy.Subscriber("landmark_bearings", LandmarkBearings, put, queue_size=10)

    def receive(self, msg: LandmarkBearings) -> None:
        """Store a message for the next scan."""
        self._waiting.append(msg)

    def give(self, localizer: PoseFilter, scan_ns: int) -> None:
        """Pass the filter all bearings with odometry that are not newer than the scan that follows."""
        for msg in list(self._waiting):
            if conversions.ns_from_stamp(msg.header.stamp) > scan_ns:
                continue
            self._waiting.remove(msg)
            try:
                self._add(localizer, msg)
            except (ValueError, tf2_ros.TransformException) as err:
                self._log.warn(f"bearings not used: {err}")

    def restart(self) -> None:
        """Drop stored messages: time has jumped."""
        self._waiting.clear()

    def _add(self, localizer: PoseFilter, msg: LandmarkBearings) -> None:
        """Add the bearings of one message to known landmarks."""
        mounting = conversions.mounting_from_transform(
            self._tf.lookup_transform(
                self._p.base_frame_id, conversions.frame_id(msg.header.frame_id), rospy.Time(0)
            ).transform
        )
        known = [
            bearing
            for bearing in bearing_messages.bearings_from_msg(msg, mounting)
            if bearing.landmark_id in self._landmarks
        ]
        if len(known) < len(msg.ids):
            self._log.warn(f"bearings to landmarks that are not in {self._p.landmark_file} are not used")
        if known:
            odometry = np.array([self._transforms.odom_from_base(bearing.stamp_ns) for bearing in known])
            localizer.add_bearings(
                bearings.collected(known, odometry, mounting.base_from_laser), self._landmarks, odometry[-1]
            )
