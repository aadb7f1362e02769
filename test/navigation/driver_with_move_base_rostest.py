#!/usr/bin/env python3
"""The driver beside stock move_base: it seeks a meetpoint by itself, has move_base drive to poses, and notices faults.

The tests build on each other, in the order of their numbers; the last ones kill nodes.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import unittest
from pathlib import Path
from typing import Any, Optional

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "rostest"))

import actionlib
import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rostest_support import Heard, process_of, wait_until

from glass_nav.geometry import angles
from glass_nav.geometry.polyline import Polyline
from glass_nav.msg import DriverStatus, GotoNodeAction, GotoNodeGoal, GotoNodeResult, Meetpoint
from glass_nav.ros import conversions
from glass_nav.simulation import building_file, shipped_buildings

BUILDING = building_file.load(shipped_buildings.find("glass_office"))
PATH = Polyline(next(iter(BUILDING.paths.values())))
ARRIVED = r"^/?move_base is at the goal: Goal reached\.$"
SILENT_LOCALIZATION = r"^the localization is silent for \d+\.\d s, for 3 s$"
SILENT_MOVE_BASE = r"^/?move_base is silent for 3 s: move_base has ended or hangs$"


class DriverWithMoveBase(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.started: Optional[subprocess.Popen] = None
        cls.truth = Heard("ground_truth", PoseStamped)
        cls.odometry = Heard("odom", Odometry)
        cls.status = Heard("glass_driver/status", DriverStatus)
        cls.meetpoints = Heard("meetpoint", Meetpoint)
        cls.places = actionlib.SimpleActionClient("goto_node", GotoNodeAction)
        assert wait_until(lambda: rospy.get_time() > 0.0, 60)
        assert cls.places.wait_for_server(rospy.Duration(60))

    @classmethod
    def tearDownClass(cls) -> None:
        if cls.started is not None:
            cls.started.terminate()
            cls.started.wait()

    # -- what is measured and done

    def pose(self) -> np.ndarray:
        return conversions.planar_from_pose(self.truth.last.pose)

    def stands(self) -> bool:
        twist = self.odometry.last.twist.twist
        return twist.linear.x == 0.0 and twist.angular.z == 0.0

    def send(self, goal: np.ndarray, with_heading: bool) -> None:
        msg = GotoNodeGoal(node=-1, with_heading=with_heading)
        msg.pose.header.frame_id, msg.pose.pose = "map", conversions.pose_from_planar(goal)
        self.places.send_goal(msg)

    def send_far(self) -> None:
        """To the end of the path that is farther away; returns once the robot drives."""
        ends = (PATH.at(0.1 * PATH.length), PATH.at(0.9 * PATH.length))
        far = max(ends, key=lambda end: float(np.hypot(*(end - self.pose()[:2]))))
        self.send(np.array([*far, 0.0]), with_heading=False)
        self.assertTrue(
            wait_until(lambda: self.odometry.last.twist.twist.linear.x > 0.2, 60.0),
            f"the robot does not drive: {self.status.last}",
        )

    def end(self, timeout_s: float = 120.0) -> Any:
        ended = wait_until(lambda: self.places.get_result() is not None, timeout_s)
        self.assertTrue(ended, f"no result, the driver says {self.status.last}")
        return self.places.get_result()

    def check_end(self, code: int, reason: str) -> None:
        result = self.end()
        self.assertEqual(result.code, code, result.reason)
        self.assertRegex(result.reason, reason)
        self.assertTrue(wait_until(self.stands, 10.0), "the robot does not stand")

    def let_arrive(self) -> None:
        """A goal nearby, to show that everything works again."""
        near = min(np.linspace(0.0, PATH.length, 200), key=lambda way: np.hypot(*(PATH.at(way) - self.pose()[:2])))
        goal = PATH.at(min(near + 1.5, PATH.length))
        self.send(np.array([*goal, 0.0]), with_heading=False)
        self.check_end(GotoNodeResult.SUCCEEDED, ARRIVED)
        self.assertLess(np.hypot(*(self.pose()[:2] - goal)), 0.3)

    # -- tests

    def test_1_it_seeks_a_meetpoint_at_the_start_while_move_base_waits_for_goals(self) -> None:
        self.assertTrue(wait_until(lambda: len(self.meetpoints) > 0, 120.0), f"no meetpoint: {self.status.last}")
        self.assertTrue(any(msg.task == "~seek_at_start" for msg in self.status.all))
        self.assertTrue(wait_until(lambda: self.status.last.state_name == "ARRIVED", 30.0), self.status.last)
        self.assertTrue(wait_until(self.stands, 10.0), "the robot does not stand")

    def test_2_at_a_goal_with_a_heading_it_looks_that_way(self) -> None:
        for yaw_rad in (2.0, -1.0):
            goal = np.array([*PATH.at(0.15 * PATH.length), yaw_rad])
            self.send(goal, with_heading=True)
            self.check_end(GotoNodeResult.SUCCEEDED, ARRIVED)
            off = self.pose() - goal
            self.assertLess(np.hypot(*off[:2]), 0.3)
            self.assertLess(abs(angles.wrap(off[2])), 0.25)  # yaw_goal_tolerance of move_base is 0.2

    def test_3_a_localization_that_hangs_ends_the_goal_and_the_next_one_is_reached(self) -> None:
        self.send_far()
        localization = process_of("/glass_localization")
        os.kill(localization, signal.SIGSTOP)
        try:
            self.check_end(GotoNodeResult.NOT_LOCALIZED, SILENT_LOCALIZATION)
        finally:
            os.kill(localization, signal.SIGCONT)
        self.let_arrive()

    def test_4_a_move_base_that_hangs_ends_the_goal_and_the_next_one_is_reached(self) -> None:
        self.send_far()
        move_base = process_of("/move_base")
        os.kill(move_base, signal.SIGSTOP)
        try:
            self.check_end(GotoNodeResult.NO_MOVE_BASE, SILENT_MOVE_BASE)
        finally:
            os.kill(move_base, signal.SIGCONT)
        self.let_arrive()

    def test_5_a_move_base_that_is_killed_ends_the_goal_and_a_new_one_drives(self) -> None:
        self.send_far()
        os.kill(process_of("/move_base"), signal.SIGKILL)
        self.check_end(GotoNodeResult.NO_MOVE_BASE, SILENT_MOVE_BASE)
        type(self).started = subprocess.Popen(["rosrun", "move_base", "move_base", "__name:=move_base"])
        self.let_arrive()

    def test_6_a_localization_that_is_killed_ends_the_goal(self) -> None:
        self.send_far()
        os.kill(process_of("/glass_localization"), signal.SIGKILL)
        self.check_end(GotoNodeResult.NOT_LOCALIZED, SILENT_LOCALIZATION)
        self.assertEqual(self.places.get_state(), GoalStatus.ABORTED)


if __name__ == "__main__":
    rospy.init_node("driver_with_move_base_rostest")
    rostest.rosrun("glass_nav", "driver_with_move_base", DriverWithMoveBase)
