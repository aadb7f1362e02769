#!/usr/bin/env python3
"""Nodes started by the launch files of public robots: each localizes."""

from __future__ import annotations

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse
from room_robot import Robot, pose_message, room
from rostest_support import Heard, part, wait_until

from glass_nav.msg import LocalizationStatus
from glass_nav.ros import conversions

ROBOTS = ("turtlebot3", "husky", "jackal", "fetch")


class AmclLaunchFiles(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        grid_map = room()
        msg = conversions.msg_from_map(grid_map, rospy.Time.now(), "map")
        cls.maps = []
        for name in ROBOTS:
            rospy.Service(f"/{name}/static_map", GetMap, lambda _: GetMapResponse(msg))
            cls.maps.append(rospy.Publisher(f"/{name}/map", OccupancyGrid, queue_size=1, latch=True))
            cls.maps[-1].publish(msg)
        cls.poses = {name: Heard(f"/{name}/amcl_pose", PoseWithCovarianceStamped) for name in ROBOTS}
        cls.status = {name: Heard(f"/{name}/amcl/status", LocalizationStatus) for name in ROBOTS}
        cls.starts = {
            name: rospy.Publisher(f"/{name}/initialpose", PoseWithCovarianceStamped, queue_size=1) for name in ROBOTS
        }
        cls.footprint = tf2_ros.StaticTransformBroadcaster()  # the base frame of turtlebot3
        cls.footprint.sendTransform(conversions.transform_stamped(1, "base_link", "base_footprint", np.zeros(3)))
        cls.robot = Robot(grid_map)

    def test_each_of_them_localizes_the_robot(self) -> None:
        for name in ROBOTS:
            with part(name):
                self.assertTrue(
                    wait_until(self.starts[name].get_num_connections, 30.0), "nobody listens to initialpose"
                )
                self.assertTrue(wait_until(lambda name=name: self.poses[name].last is not None, 30.0), "no amcl_pose")
                self.starts[name].publish(pose_message(self.robot.map_from_base()))
        self.robot.make_steps(20)
        for name in ROBOTS:
            with part(name):

                def is_right(name: str = name) -> bool:
                    said = conversions.planar_from_pose(self.poses[name].last.pose.pose)
                    return bool(np.hypot(*(said - self.robot.map_from_base())[:2]) < 0.35)

                self.assertTrue(
                    wait_until(is_right, 30.0),
                    f"{self.poses[name].last.pose.pose.position} is not the "
                    f"place {self.robot.map_from_base()}: {self.status[name].last}",
                )


if __name__ == "__main__":
    rospy.init_node("amcl_launch_files_rostest")
    rostest.rosrun("glass_nav", "amcl_launch_files", AmclLaunchFiles)
