"""What rostests in the room share: a node that is localized, and how far its pose is off. Serves static_map."""

from __future__ import annotations

import math
import unittest
from typing import Sequence

import numpy as np
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.srv import GetMap, GetMapResponse
from room_robot import Lidar, Robot, pose_message, room
from rostest_support import Heard, LogLines, Process, wait_until
from tf2_msgs.msg import TFMessage

from glass_nav.geometry import angles, se2
from glass_nav.msg import LocalizationStatus
from glass_nav.ros import conversions


class RoomTest(unittest.TestCase):
    """Each test begins with the node localized; after it, tf and amcl_pose were finite all the time."""

    lidars: Sequence[Lidar] = ()  # of the robot; one when there are none

    @classmethod
    def setUpClass(cls) -> None:
        cls.grid_map = room()
        cls.lines = LogLines()
        cls.poses = Heard("amcl_pose", PoseWithCovarianceStamped)
        cls.status = Heard("/glass_localization/status", LocalizationStatus)
        cls.transforms = Heard("/tf", TFMessage, lambda msg: msg.transforms[0].header.frame_id == "map")
        cls.initialpose = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=1)
        cls.map_msg = conversions.msg_from_map(cls.grid_map, rospy.Time.now(), "map")
        rospy.Service("static_map", GetMap, lambda _: GetMapResponse(cls.map_msg))
        cls.robot = Robot(cls.grid_map, lidars=cls.lidars)
        for service in ("global_localization", "request_nomotion_update", "set_map"):
            rospy.wait_for_service(service, timeout=20.0)

    def setUp(self) -> None:
        self.robot.reset()
        self.assertTrue(wait_until(self.initialpose.get_num_connections, 30.0), "nobody listens to initialpose")
        self.assertTrue(wait_until(lambda: len(self.transforms), 30.0), "no map -> odom within 30 s")
        self.poses.clear()
        self.lines.clear()
        self.initialpose.publish(pose_message(self.robot.map_from_base()))
        self.expect_line("starting at")
        self.expect_right_pose()
        self.lines.clear()

    def tearDown(self) -> None:
        for msg in self.transforms.all:
            numbers = conversions.planar_from_transform(msg.transforms[0].transform)  # raises on NaN
            self.assertTrue(np.all(np.isfinite(numbers)))
        for msg in self.poses.all:
            conversions.planar_from_pose(msg.pose.pose)
            self.assertTrue(np.all(np.isfinite(msg.pose.covariance)))

    def error_m(self) -> float:
        """How far the last map -> odom puts the robot off; its yaw counts as 1 m per rad."""
        map_from_odom = conversions.planar_from_transform(self.transforms.last.transforms[0].transform)
        truth = self.robot.map_from_base()
        off = se2.compose(map_from_odom, self.robot.odom_from_base()) - truth
        return float(np.hypot(off[0], off[1]) + abs(angles.wrap(off[2])))

    def expect_right_pose(self, timeout_s: float = 30.0) -> None:
        """A transform of a scan from now on puts the robot where it is."""
        self.transforms.clear()
        self.assertTrue(
            wait_until(lambda: len(self.transforms) and self.error_m() < 0.25, timeout_s),
            f"no right pose within {timeout_s:g} s; heard {len(self.transforms)} transforms, "
            f"error {self.error_m() if len(self.transforms) else math.nan:.2f} m; "
            f"{self.lines.having('')[-5:]}",
        )

    def expect_understood(self) -> None:
        """A scan from now on is explained by the map."""
        self.status.clear()
        self.assertTrue(
            wait_until(lambda: len(self.status) and self.status.last.used_share > 0.8, 30.0),
            f"no scan is understood: {self.status.last}",
        )

    def expect_line(self, *words: str) -> None:
        self.assertTrue(
            wait_until(lambda: self.lines.having(*words), 30.0),
            f"no log line with {words}; there are {self.lines.having('')[-10:]}",
        )

    def start(self, name: str, *private: str, script: str = "localization_node") -> Process:
        return Process(
            script,
            f"__name:={name}",
            "_tf_broadcast:=false",
            f"amcl_pose:=/{name}/pose",
            f"particlecloud:=/{name}/particlecloud",
            f"set_map:=/{name}/set_map",
            f"global_localization:=/{name}/global_localization",
            f"request_nomotion_update:=/{name}/request_nomotion_update",
            *private,
        )
