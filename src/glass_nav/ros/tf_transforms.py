"""The transforms of a running robot, in the form that the core needs."""

from __future__ import annotations

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Transform

from glass_nav.ros import conversions
from glass_nav.sensing.mounting import Mounting
from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_placement import NoTransform, Transforms


class TfTransforms(Transforms):
    """Looks transforms up in a tf2 buffer, which the node fills and clears."""

    def __init__(self, tf: tf2_ros.Buffer, odom_frame: str, base_frame: str) -> None:
        self._tf, self._odom_frame, self._base_frame = tf, odom_frame, base_frame

    @property
    def odometry_name(self) -> str:
        """The name of the transform, for messages."""
        return f"{self._odom_frame} <- {self._base_frame}"

    def has_odometry(self) -> bool:
        """Whether tf has heard of it at all."""
        return bool(self._tf.can_transform(self._odom_frame, self._base_frame, rospy.Time(0)))

    def odom_from_base(self, stamp_ns: int) -> np.ndarray:
        transform = self._lookup(self._odom_frame, self._base_frame, stamp_ns)
        try:
            return conversions.planar_from_transform(transform)
        except ValueError as err:
            raise ScanError(f"transform {self._odom_frame} <- {self._base_frame}: {err}") from err

    def mounting(self, lidar: str, stamp_ns: int) -> Mounting:
        return conversions.mounting_from_transform(self._lookup(self._base_frame, lidar, stamp_ns))

    def _lookup(self, parent: str, child: str, stamp_ns: int) -> Transform:
        try:
            return self._tf.lookup_transform(parent, child, conversions.stamp_from_ns(stamp_ns)).transform
        except tf2_ros.TransformException as err:
            raise NoTransform(f"no transform {parent} <- {child} at {stamp_ns * 1e-9:.3f} s: {err}") from err
