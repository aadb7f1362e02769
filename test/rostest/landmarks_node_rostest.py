#!/usr/bin/env python3
"""launch/landmarks.launch beside simulator and localization: a robot that wakes up is localized without driving."""

from __future__ import annotations

import sys
import threading
import unittest
from pathlib import Path
from typing import Any, Dict

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from rostest_support import REPO, Heard, LogLines, Process, wait_until
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from glass_nav.geometry import angles, se2
from glass_nav.msg import LandmarkBearings, LocalizationStatus
from glass_nav.ros import conversions
from glass_nav.ros.landmarks import bearing_messages
from glass_nav.sensing.bearings import LandmarkBearing
from glass_nav.world import landmark_file

TURN_S = 60.0  # by the wall clock: a turn takes about as long in simulated time, which runs faster
LISTENERS = 3  # to the bearings: node, localization, and this test
NEAR_M, NEAR_RAD = 0.3, 0.05
LANDMARKS = landmark_file.load(REPO / "maps" / "glass_office" / "landmarks.yaml")


def stamp_ns(msg: Any) -> int:
    return conversions.ns_from_stamp(msg.header.stamp)


class Landmarks(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.lines = LogLines()
        cls.status = Heard("/glass_localization/status", LocalizationStatus)
        cls.poses = Heard("amcl_pose", PoseWithCovarianceStamped)
        cls.fixes = Heard("/landmarks/pose", PoseWithCovarianceStamped)
        cls.starts = Heard("initialpose", PoseWithCovarianceStamped)
        cls.truth = Heard("ground_truth", PoseStamped)
        cls.bearings = Heard("landmark_bearings", LandmarkBearings)
        cls.markers = Heard("/landmarks/markers", MarkerArray)
        cls.send = rospy.ServiceProxy("/landmarks/send_initialpose", Trigger)
        cls.publisher = rospy.Publisher("landmark_bearings", LandmarkBearings, queue_size=5)
        cls.commands = rospy.Publisher("cmd_vel", Twist, queue_size=1)

    def true_pose(self, at_ns: int) -> np.ndarray:
        """Between the two true poses next to a stamp."""
        self.assertTrue(wait_until(lambda: stamp_ns(self.truth.last) >= at_ns, 30.0), "the simulator stands still")
        poses: Dict[int, np.ndarray] = {stamp_ns(msg): conversions.planar_from_pose(msg.pose) for msg in self.truth.all}
        before, after = max(ns for ns in poses if ns <= at_ns), min(ns for ns in poses if ns >= at_ns)
        step = poses[after] - poses[before]
        step[2] = angles.wrap(step[2])
        return poses[before] + step * (at_ns - before) / max(after - before, 1)

    def assertNear(self, msg: PoseWithCovarianceStamped, true: np.ndarray, near_m: float = NEAR_M) -> None:
        said = conversions.planar_from_pose(msg.pose.pose)
        self.assertEqual(msg.header.frame_id, "map")
        self.assertLess(np.hypot(*(said - true)[:2]), near_m, f"said {said}, true {true}")
        self.assertLess(abs(float(angles.wrap(said[2] - true[2]))), NEAR_RAD, f"said {said}, true {true}")

    def see(self, **offsets: float) -> LandmarkBearings:
        """What the robot would see now of A2 to A5, each angle off by as much as told."""
        now_ns = stamp_ns(self.truth.last)
        pose = conversions.planar_from_pose(self.truth.last.pose)
        taken = []
        for name in ("A2", "A3", "A4", "A5"):
            way = se2.transform_points(se2.inverse(pose), LANDMARKS.positions_m[LANDMARKS.numbers([name])[0]])
            angle = float(np.arctan2(way[1], way[0])) + offsets.get(name, 0.0)
            taken.append(LandmarkBearing(now_ns, name, angle, 0.005))
        return bearing_messages.msg_from_bearings(now_ns, taken, "emitter")

    def see_now(self) -> LandmarkBearings:
        """Published, to everybody who shall hear it."""
        self.assertTrue(wait_until(lambda: self.publisher.get_num_connections() >= LISTENERS, 30.0))
        msg = self.see()
        self.publisher.publish(msg)
        return msg

    def is_localized(self) -> bool:
        """Said by the localization, and true; its pose comes after its state."""
        said = conversions.planar_from_pose(self.poses.last.pose.pose)
        true = conversions.planar_from_pose(self.truth.last.pose)
        return self.status.last.state_name == "LOCALIZED" and float(np.hypot(*(said - true)[:2])) < 0.15

    def test_1_before_the_first_turn_there_is_nothing_to_send(self) -> None:
        self.send.wait_for_service(30.0)
        self.assertEqual(len(self.fixes), 0)
        answer = self.send()
        self.assertFalse(answer.success)
        self.assertEqual(answer.message, "there is no position: no bearings came yet")
        self.assertTrue(wait_until(lambda: len(self.markers), 30.0), "the landmarks are not shown")
        shown = [marker.text for marker in self.markers.last.markers if marker.ns == "landmark_ids"]
        self.assertEqual(shown, list(LANDMARKS.ids))

    def test_2_a_robot_that_wakes_up_is_localized_without_driving(self) -> None:
        self.assertTrue(
            wait_until(lambda: len(self.starts), TURN_S),
            f"no initialpose within {TURN_S:g} s; status {self.status.last}; {self.lines.having('')[-8:]}",
        )
        self.assertGreaterEqual(len(self.bearings.last.ids), 3)
        given = self.starts.last
        self.assertNear(given, self.true_pose(stamp_ns(given)))
        self.assertTrue(wait_until(self.is_localized, 30.0), f"{self.status.last}, {self.poses.last}")
        first, last = (conversions.planar_from_pose(msg.pose) for msg in (self.truth.all[0], self.truth.last))
        np.testing.assert_allclose(first, last, atol=1e-9)  # it never moved
        covariance = np.array(self.fixes.last.pose.covariance).reshape(6, 6)
        self.assertTrue(0.001 < np.sqrt(covariance[0, 0]) < 0.5)

    def test_3_a_localized_robot_is_left_alone_until_somebody_asks(self) -> None:
        count, exact = len(self.starts), self.see_now()
        self.assertTrue(wait_until(lambda: stamp_ns(self.fixes.last) == stamp_ns(exact), 30.0), "no fix")
        self.assertNear(self.fixes.last, self.true_pose(stamp_ns(self.fixes.last)), 0.05)
        self.assertTrue(
            wait_until(lambda: stamp_ns(self.poses.last) >= stamp_ns(self.fixes.last), 30.0),
            "the localization, which has the landmarks too, does not weigh its particles by them",
        )
        self.assertNear(self.poses.last, self.true_pose(stamp_ns(self.poses.last)), 0.15)
        self.assertEqual(len(self.starts), count)
        answer = self.send()
        self.assertEqual((answer.success, answer.message), (True, "sent to initialpose"))
        self.assertTrue(wait_until(lambda: len(self.starts) > count, 30.0), "nothing sent")
        self.assertGreaterEqual(stamp_ns(self.starts.last), stamp_ns(self.fixes.last))

    def test_4_a_lost_robot_is_told_where_it_is(self) -> None:
        wrong = PoseWithCovarianceStamped(header=conversions.header(0, "map"))
        true = conversions.planar_from_pose(self.truth.last.pose)
        wrong.pose.pose = conversions.pose_from_planar(true + [25.0, 0.6, 1.3])
        wrong.pose.covariance[0] = wrong.pose.covariance[7] = wrong.pose.covariance[35] = 1e-4
        publisher = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=1)
        self.assertTrue(wait_until(lambda: publisher.get_num_connections() >= 2, 30.0))
        publisher.publish(wrong)
        self.assertTrue(
            wait_until(lambda: self.status.last.state_name in ("LOST", "UNCERTAIN"), 30.0), f"{self.status.last}"
        )
        if self.status.last.state_name != "LOST":  # not sure of being lost: whoever watches the robot asks
            self.see_now()
            self.assertTrue(wait_until(lambda: self.send().success, 30.0))
        self.assertTrue(wait_until(self.is_localized, TURN_S), f"{self.status.last}, {self.poses.last}")

    def test_5_what_gives_no_position_is_reported(self) -> None:
        self.see_now()
        self.publisher.publish(self.see(A3=0.3, A4=-0.25))
        self.assertTrue(
            wait_until(lambda: self.lines.having("no position from bearings", "contradict each other"), 10.0)
        )
        strange = self.see()
        strange.ids = ["A2", "A3", "A4", "Z9"]
        self.publisher.publish(strange)
        self.assertTrue(wait_until(lambda: self.lines.having("bearing ignored: landmark 'Z9' is not in"), 30.0))
        self.assertTrue(wait_until(lambda: self.lines.having("bearings to landmarks that are not in"), 30.0))
        short = self.see()
        short.angles = short.angles[:2]
        self.publisher.publish(short)
        self.assertTrue(wait_until(lambda: self.lines.having("must be as many, got 4, 4, 2 and 4"), 30.0))
        self.assertTrue(wait_until(lambda: self.lines.having("bearings not used: ids, stamps"), 30.0))
        elsewhere = self.see()
        elsewhere.header.frame_id = "nowhere"
        self.publisher.publish(elsewhere)
        self.assertTrue(wait_until(lambda: self.lines.having("no transform base_link <- nowhere within 1 s"), 30.0))

    def test_6_bearings_of_a_driving_robot_are_carried_along_by_odometry(self) -> None:
        self.see_now()  # what was wrong before is replaced
        ending = threading.Event()

        def drive() -> None:
            msg = Twist()
            msg.linear.x = 0.04  # some 2 m in a turn of the scanner
            while not ending.wait(0.02):
                self.commands.publish(msg)

        thread = threading.Thread(target=drive, daemon=True)
        thread.start()
        try:
            turns, start = len(self.bearings), conversions.planar_from_pose(self.truth.last.pose)
            self.assertTrue(wait_until(lambda: len(self.bearings) >= turns + 2, 2.0 * TURN_S), "no turn of the scanner")
            end_ns = max(conversions.ns_from_stamp(stamp) for stamp in self.bearings.last.stamps)
            self.assertTrue(
                wait_until(lambda: stamp_ns(self.fixes.last) == end_ns, 30.0),
                f"{self.bearings.last}; {self.lines.having('from bearings')[-3:]}",
            )
        finally:
            ending.set()
            thread.join()
        self.assertGreater(np.hypot(*(self.true_pose(end_ns) - start)[:2]), 1.0)
        self.assertNear(self.fixes.last, self.true_pose(end_ns), 0.5)
        count = len(self.starts)
        self.assertTrue(self.send().success)  # of now, not of the last bearing
        self.assertTrue(wait_until(lambda: len(self.starts) > count, 30.0))
        sent_ns = stamp_ns(self.starts.last)
        self.assertGreater(sent_ns, end_ns)
        self.assertNear(self.starts.last, self.true_pose(sent_ns), 0.5)
        self.assertFalse(self.lines.having("taken as of now"), "the localization does not have the odometry it needs")

    def test_7_files_and_parameters_that_cannot_be_used_end_the_node(self) -> None:
        for arguments, text in (
            (["_landmark_file:=/none.yaml"], "/none.yaml: cannot be read: No such file or directory"),
            ([], "~landmark_file must name a file of landmarks, got ''"),
            (["_landmark_fil:=x"], "unknown parameter ~landmark_fil; did you mean ~landmark_file?"),
        ):
            code, printed = Process("landmarks_node", "__name:=other", *arguments).wait(30.0)
            rospy.set_param("/other", {})
            self.assertEqual(code, 2, printed)
            self.assertIn(text, printed)
            rospy.delete_param("/other")


if __name__ == "__main__":
    rospy.init_node("landmarks_node_rostest")
    rostest.rosrun("glass_nav", "landmarks_node", Landmarks)
