#!/usr/bin/env python3
"""launch/demo.launch: the simulated robot is localized from its start, carries the truth along, and obeys cmd_vel."""

from __future__ import annotations

import signal
import sys
import threading
import unittest
from pathlib import Path
from typing import Any, Dict, List, Sequence

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from nav_msgs.srv import GetMap
from rosgraph_msgs.msg import Clock
from rostest_support import Heard, LogLines, Process, wait_until
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from glass_nav.geometry import angles
from glass_nav.msg import LocalizationStatus, TrueBeams
from glass_nav.ros import conversions

START_S = 60.0  # until everything runs, on a busy machine
WAY_M = 5.0
COMMAND_PERIOD_S = 0.05


def stamp_ns(msg: Any) -> int:
    return conversions.ns_from_stamp(msg.header.stamp)


class Driver:
    """Sends one velocity again and again, as a joystick does."""

    def __init__(self) -> None:
        self._publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        self._ending = threading.Event()
        self._thread = threading.Thread()

    def start(self, forward: float, turn: float) -> None:
        self.stop()
        msg = Twist()
        msg.linear.x, msg.angular.z = forward, turn
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._send, args=(msg, self._ending), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()

    def _send(self, msg: Twist, ending: threading.Event) -> None:
        while not ending.wait(COMMAND_PERIOD_S):
            self._publisher.publish(msg)


class Demo(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.lines = LogLines()
        cls.status = Heard("/glass_localization/status", LocalizationStatus)
        cls.poses = Heard("amcl_pose", PoseWithCovarianceStamped)
        cls.truth = Heard("ground_truth", PoseStamped)
        cls.scans = Heard("scan", LaserScan)
        cls.true_beams = Heard("true_beams", TrueBeams)
        cls.odometry = Heard("odom", Odometry)
        cls.clock = Heard("/clock", Clock)
        cls.blocked = Heard("/simulator/blocked", Bool)
        cls.static_transforms = Heard("/tf_static", TFMessage)
        cls.driver = Driver()

    def tearDown(self) -> None:
        self.driver.stop()

    def true_poses(self) -> Dict[int, np.ndarray]:
        """By stamp."""
        return {stamp_ns(msg): conversions.planar_from_pose(msg.pose) for msg in self.truth.all}

    def way_m(self) -> float:
        poses = [pose for _, pose in sorted(self.true_poses().items())]
        return float(np.linalg.norm(np.diff([pose[:2] for pose in poses], axis=0), axis=1).sum()) if poses else 0.0

    def position(self) -> np.ndarray:
        return conversions.planar_from_pose(self.truth.last.pose)

    def hear_scans(self, count: int) -> None:
        """Returns after so many more."""
        wanted = len(self.truth) + count
        self.assertTrue(wait_until(lambda: len(self.truth) >= wanted, 30.0), "the lidar stands still")

    def assertStamps(self, one: Sequence[Any], other: Sequence[Any]) -> None:
        """The same stamps in the time that both were heard in."""
        stamps: List[List[int]] = [[stamp_ns(msg) for msg in messages] for messages in (one, other)]
        first, last = max(part[0] for part in stamps), min(part[-1] for part in stamps)
        within = [[stamp for stamp in part if first <= stamp <= last] for part in stamps]
        self.assertGreater(len(within[0]), 10)
        self.assertEqual(within[0], within[1])

    def test_1_the_robot_is_localized_along_its_path(self) -> None:
        # A scan may come before the initial pose does: what counts is what follows it.
        self.assertTrue(
            wait_until(lambda: self.lines.having("starting at x") and self.scans.last is not None, START_S),
            f"no initial pose taken within {START_S:g} s",
        )
        started_ns = stamp_ns(self.scans.last)
        self.assertTrue(
            wait_until(
                lambda: self.status.last is not None
                and stamp_ns(self.status.last) > started_ns
                and self.status.last.state_name == "LOCALIZED",
                START_S,
            ),
            f"not LOCALIZED within {START_S:g} s: {self.lines.having('')[-10:]}",
        )
        self.assertTrue(
            wait_until(lambda: self.way_m() > WAY_M, START_S),
            f"{self.way_m():.1f} m driven; {self.lines.having('')[-10:]}",
        )
        self.assertEqual(self.status.last.state_name, "LOCALIZED")
        truth = self.true_poses()
        compared = [
            (conversions.planar_from_pose(msg.pose.pose), truth[stamp_ns(msg)])
            for msg in self.poses.all
            if stamp_ns(msg) > started_ns and stamp_ns(msg) in truth
        ]
        self.assertGreater(len(compared), 5)
        for said, true in compared:
            self.assertLess(np.hypot(*(said - true)[:2]), 0.3, f"said {said}, true {true}")
            self.assertLess(abs(float(angles.wrap(said[2] - true[2]))), 0.1, f"said {said}, true {true}")

    def test_2_the_truth_has_the_stamps_and_beams_of_the_scans(self) -> None:
        self.assertStamps(self.scans.all, self.true_beams.all)
        self.assertStamps(self.scans.all, self.truth.all)
        scans = {stamp_ns(msg): msg for msg in self.scans.all}
        for msg in self.true_beams.all:
            scan = scans.get(stamp_ns(msg))
            if scan is not None:
                self.assertEqual(msg.header.frame_id, scan.header.frame_id)
                for values in (msg.cases, msg.exact, msg.crossing):
                    self.assertEqual(len(values), len(scan.ranges))
        self.assertEqual({case for msg in self.true_beams.all for case in msg.cases} - {2, 4}, {0, 1, 3})

    def test_3_map_time_and_frames_are_those_of_a_robot(self) -> None:
        maps, metadata = Heard("map", OccupancyGrid), Heard("map_metadata", MapMetaData)
        self.assertTrue(wait_until(lambda: len(maps) and len(metadata), 30.0), "map and map_metadata are not latched")
        self.assertEqual(rospy.ServiceProxy("static_map", GetMap)().map, maps.last)
        self.assertEqual(set(maps.last.data), {-1, 0, 100})
        self.assertIn(
            ("base_link", "laser"),
            [
                (each.header.frame_id, each.child_frame_id)
                for msg in self.static_transforms.all
                for each in msg.transforms
            ],
        )
        times = [conversions.ns_from_stamp(msg.clock) for msg in self.clock.all]
        self.assertEqual(times, sorted(times))
        self.assertLessEqual(np.median(np.diff(times)), 20_000_000)  # a subscriber under load may miss one
        self.assertEqual((self.odometry.last.header.frame_id, self.odometry.last.child_frame_id), ("odom", "base_link"))

    def test_3_a_subscriber_is_given_the_pose_and_nobody_else(self) -> None:
        lines = len(self.lines.having("starting at x"))
        heard = Heard("initialpose", PoseWithCovarianceStamped)
        self.assertTrue(wait_until(lambda: len(heard), 30.0), "no initialpose within 30 s")
        self.hear_scans(5)
        self.assertEqual(len(heard), 1)
        truth = self.true_poses()[stamp_ns(heard.last)]
        np.testing.assert_allclose(conversions.planar_from_pose(heard.last.pose.pose), truth, atol=1e-9)
        self.assertEqual(len(self.lines.having("starting at x")), lines)  # the localization was not disturbed

    def test_4_cmd_vel_moves_the_robot_up_to_a_wall(self) -> None:
        yaw = self.position()[2]
        self.driver.start(0.0, 1.0)  # before the path, which waits
        self.assertTrue(
            wait_until(lambda: abs(float(angles.wrap(self.position()[2] - yaw))) > 1.2, 30.0),
            "cmd_vel does not turn the robot",
        )
        start = self.position()
        self.driver.start(0.5, 0.0)
        self.assertTrue(
            wait_until(lambda: np.hypot(*(self.position() - start)[:2]) > 0.2, 30.0), "cmd_vel does not move the robot"
        )
        self.assertTrue(
            wait_until(lambda: self.blocked.last is not None and self.blocked.last.data, 60.0),
            f"no obstacle stops the robot, which is at {self.position()}",
        )
        self.assertTrue(
            wait_until(lambda: self.lines.having("an obstacle stops the robot at x"), 30.0),
            "no line about the obstacle",
        )
        self.hear_scans(2)  # the truth comes with the scans, the flag at once
        there = self.position()
        self.hear_scans(10)
        self.assertLess(np.hypot(*(self.position() - there)[:2]), 0.01)

    def test_5_a_silent_driver_is_not_obeyed(self) -> None:
        def speed() -> float:
            return float(np.mean([msg.twist.twist.linear.x for msg in self.odometry.all[-5:]]))

        self.driver.start(-0.3, 0.0)  # the way that it came
        self.assertTrue(wait_until(lambda: speed() < -0.25, 30.0), f"{speed()} m/s")
        self.driver.stop()
        self.assertTrue(wait_until(lambda: speed() > -0.1, 30.0), "the robot goes on when cmd_vel falls silent")

    def test_6_a_velocity_that_is_none_is_refused(self) -> None:
        publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        msg = Twist()
        msg.linear.x = float("nan")
        self.assertTrue(wait_until(publisher.get_num_connections, 30.0))
        publisher.publish(msg)
        self.assertTrue(wait_until(lambda: self.lines.having("cmd_vel refused", "got linear.x nan"), 30.0))
        self.assertTrue(np.all(np.isfinite(self.position())))

    def test_7_as_fast_as_it_can_until_it_is_told_to_end(self) -> None:
        for how in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(how):
                scans = Heard("/second/scan", LaserScan)
                second = Process(
                    "simulator_node",
                    "__ns:=second",
                    "/clock:=/second/clock",
                    "/tf:=/second/tf",
                    "/tf_static:=/second/tf_static",
                    "_speed_factor:=0.0",
                    "_building:=opaque_office",
                    "_path:=first",
                    "_beams:=61",
                    "_robot:=omni",
                )
                try:
                    self.assertTrue(
                        wait_until(lambda heard=scans: len(heard) > 100, 30.0), f"{len(scans)} scans within 30 s"
                    )
                finally:
                    code, printed = second.end(how)
                self.assertEqual(code, 0, printed)
                self.assertNotIn("Traceback", printed)

    def test_8_bad_parameters_are_a_line_and_exit_code_2(self) -> None:
        for number, (argument, words) in enumerate(
            (
                ("_building:=palace", "palace: no such file, nor a building of the package, which are "),
                ("_lidar:=strong", "unknown lidar preset 'strong', known are sensitive, weak, coated"),
                ("_path:=nowhere", "glass_office: no path 'nowhere', it has "),
                ("_robot:=car", "robot must be diff or omni, got 'car'"),
                ("_speed_factor:=-1.0", "~speed_factor must be >= 0, got -1.0"),
                ("_echoo:=last", "unknown parameter ~echoo; did you mean ~echo?"),
            )
        ):
            with self.subTest(argument):
                code, printed = Process("simulator_node", f"__name:=bad_simulator_{number}", argument).wait(30.0)
                self.assertEqual(code, 2, printed)
                said = [line for line in printed.splitlines() if line.strip()]
                self.assertEqual(len(said), 1, printed)
                self.assertIn(f"/bad_simulator_{number}: {words}", said[0])


if __name__ == "__main__":
    rospy.init_node("demo_rostest")
    rostest.rosrun("glass_nav", "demo", Demo)
