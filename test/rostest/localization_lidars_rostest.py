#!/usr/bin/env python3
"""The running node with three lidars, which are told apart by frame: two on one topic, one on a topic of its own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Set

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
import rospy
import rostest
from room_robot import Lidar, changed
from room_test import RoomTest
from rostest_support import Heard, part, wait_until
from sensor_msgs.msg import LaserScan

from glass_nav.ros import conversions

# One takes its beams one after the other, one hangs upside down and looks back, one sits on a mount that turns.
FRONT = Lidar("front/scan", "front_laser", (0.2, 0.1, 0.8), beams=(-1.0, 1.0), turn_s=0.08)
REAR = Lidar("rear/scan", "rear_laser", (-0.3, 0.0, 2.9), beams=(-1.2, 1.2), upside_down=True)
TOWER = Lidar("front/scan", "tower_laser", (0.0, 0.0, -0.5), beams=(-1.5, 0.5), swings=True)


class LocalizationLidars(RoomTest):
    lidars = (FRONT, REAR, TOWER)

    @classmethod
    def setUpClass(cls) -> None:
        super().setUpClass()
        cls.surfaces = Heard("scan_surfaces", LaserScan)

    def frames_used(self, steps: int) -> Set[str]:
        """Of the lidars whose scans were used in so many turns."""
        self.surfaces.clear()
        self.robot.make_steps(steps)
        return {msg.header.frame_id for msg in self.surfaces.all}

    def test_all_of_them_are_used_and_tf_has_no_stamp_twice(self) -> None:
        self.transforms.clear()
        self.assertEqual(self.frames_used(10), {"front_laser", "rear_laser", "tower_laser"})
        self.expect_right_pose()
        stamps = [conversions.ns_from_stamp(msg.transforms[0].header.stamp) for msg in self.transforms.all]
        self.assertTrue(np.all(np.diff(stamps) > 0), "stamps of map -> odom do not ascend")

    def test_each_one_alone_knows_where_the_robot_is(self) -> None:
        for lidar in self.lidars:
            with part(lidar.frame):
                for other in self.lidars:
                    other.silent = other is not lidar
                self.assertTrue(
                    wait_until(lambda frame=lidar.frame: self.frames_used(5) == {frame}, 30.0),
                    f"not {lidar.frame} alone is used",
                )
                self.expect_right_pose()
                self.expect_understood()

    def test_a_lidar_whose_stamps_lag_is_used_all_the_same(self) -> None:
        lag = rospy.Duration(0.25)
        self.robot.spoil = lambda msg: (
            changed(msg, header__stamp=msg.header.stamp - lag) if msg.header.frame_id == "/rear_laser" else msg
        )
        REAR.silent = True
        self.robot.make_steps(2)
        self.robot.moving = False  # else its world would be a quarter of a second ahead of its stamps
        REAR.silent = False
        self.robot.make_steps(5)
        self.assertEqual(self.frames_used(8), {"front_laser", "rear_laser", "tower_laser"})
        self.expect_right_pose()

    def test_a_time_that_no_lidar_takes_is_reported(self) -> None:
        self.robot.spoil = lambda msg: changed(msg, time_increment=0.5)
        self.expect_line("scans are not deskewed: time_increment 0.5 s")
        self.expect_right_pose()

    def test_frames_without_end_leave_room_for_a_real_one(self) -> None:
        counter = iter(range(1000))
        self.robot.spoil = lambda msg: changed(msg, header__frame_id=f"made_up_{next(counter)}")
        self.expect_line("scan dropped", "no transform base_link <- made_up_")
        self.robot.make_steps(10)
        self.robot.spoil = lambda msg: msg
        self.expect_right_pose()
        self.assertEqual(self.frames_used(10), {"front_laser", "rear_laser", "tower_laser"})


if __name__ == "__main__":
    rospy.init_node("localization_lidars_rostest")
    rostest.rosrun("glass_nav", "localization_lidars", LocalizationLidars)
