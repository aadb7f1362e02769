#!/usr/bin/env python3
"""The running node's services, its answers to bad input, its start and its end, on a simulated scan of a room."""

from __future__ import annotations

import math
import re
import signal
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped, Quaternion
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import SetMap, SetMapRequest
from room_robot import BEAMS, changed, pose_message
from room_test import RoomTest
from rostest_support import Heard, Process, part, wait_until
from std_srvs.srv import Empty

from glass_nav.msg import LocalizationStatus
from glass_nav.ros import conversions


def with_covariance(msg: PoseWithCovarianceStamped, row: int, column: int, value: float) -> PoseWithCovarianceStamped:
    spatial = np.array(msg.pose.covariance).reshape(6, 6)
    spatial[row, column] = value
    msg.pose.covariance = spatial.ravel().tolist()
    return msg


class LocalizationInterface(RoomTest):
    @classmethod
    def setUpClass(cls) -> None:
        super().setUpClass()
        cls.particles = Heard("particlecloud", PoseArray)
        cls.set_map = rospy.ServiceProxy("set_map", SetMap)

    # -- services

    def test_nomotion_update_uses_a_scan_of_a_standing_robot(self) -> None:
        self.robot.moving = False
        self.robot.make_steps(3)  # the scan under way
        self.poses.clear()
        self.robot.make_steps(5)
        before = len(self.poses)
        rospy.ServiceProxy("request_nomotion_update", Empty)()
        self.assertTrue(wait_until(lambda: len(self.poses) > before, 30.0), "no amcl_pose after the request")

    def test_global_localization_starts_anywhere(self) -> None:
        self.poses.clear()
        self.particles.clear()
        rospy.ServiceProxy("global_localization", Empty)()
        self.expect_line("anywhere in the map")
        self.assertTrue(
            wait_until(lambda: len(self.poses) and len(self.particles), 30.0),
            "no amcl_pose and particlecloud after the request",
        )

    def test_set_map_takes_map_and_pose(self) -> None:
        self.poses.clear()
        answer = self.set_map(SetMapRequest(self.map_msg, pose_message(self.robot.map_from_base())))
        self.assertTrue(answer.success)
        self.assertTrue(wait_until(lambda: len(self.poses), 30.0), "no amcl_pose after set_map")
        self.expect_right_pose()

    def test_set_map_refuses_what_is_no_map(self) -> None:
        def fresh() -> Any:
            return conversions.msg_from_map(self.grid_map, rospy.Time.now(), "map")

        here = self.robot.map_from_base()
        outside = np.array([500.0, 0.0, 0.0])
        for msg, pose, words in (
            (changed(fresh(), data=[0] * 10), pose_message(here), "needs 47500 values, got 10"),
            (changed(fresh(), info__width=0, data=[]), pose_message(here), "at least one cell"),
            (changed(fresh(), data=[101] * 47500), pose_message(here), "must be 0 to 100 or -1"),
            (changed(fresh(), info__resolution=0.0), pose_message(here), "resolution > 0"),
            (changed(fresh(), info__resolution=math.nan), pose_message(here), "resolution > 0"),
            (changed(fresh(), info__origin__position__x=math.nan), pose_message(here), "origin"),
            (changed(fresh(), info__origin__orientation__w=math.nan), pose_message(here), "origin"),
            (fresh(), changed(pose_message(here), header__frame_id="odom"), "frame 'map'"),
            (fresh(), pose_message(outside), "outside the map"),
        ):
            with part(words):
                self.lines.clear()
                self.assertFalse(self.set_map(SetMapRequest(msg, pose)).success)
                self.expect_line("set_map refused", words)
        self.expect_right_pose()

    def test_maps_without_walls_or_without_room_do_no_harm(self) -> None:
        for value in (0, -1, 100):
            with part(f"cells of {value}"):
                msg = changed(conversions.msg_from_map(self.grid_map, rospy.Time.now(), "map"), data=[value] * 47500)
                self.set_map(SetMapRequest(msg, pose_message(self.robot.map_from_base())))
                self.transforms.clear()
                self.assertTrue(wait_until(lambda: len(self.transforms) > 3, 30.0), "no map -> odom any more")
                locate = rospy.ServiceProxy("global_localization", Empty)
                if value == 0:
                    locate()
                else:
                    with self.assertRaisesRegex(rospy.ServiceException, "no free cell"):
                        locate()
                self.assertTrue(wait_until(lambda: len(self.transforms) > 6, 30.0), "no map -> odom any more")
                self.assertTrue(
                    self.set_map(SetMapRequest(self.map_msg, pose_message(self.robot.map_from_base()))).success
                )
                self.expect_right_pose()

    def test_the_map_may_come_by_topic_and_a_bad_one_is_skipped(self) -> None:
        maps = rospy.Publisher("other_map", OccupancyGrid, queue_size=2)
        poses = Heard("/by_topic/pose", PoseWithCovarianceStamped)
        self.robot.moving = False  # until the node is there: its start pose is where the robot stands now
        x, y, yaw = self.robot.map_from_base()
        node = self.start(
            "by_topic",
            "_use_map_topic:=true",
            "map:=/other_map",
            f"_initial_pose_x:={x}",
            f"_initial_pose_y:={y}",
            f"_initial_pose_a:={yaw}",
        )
        connected = wait_until(maps.get_num_connections, 30.0)
        bad = changed(conversions.msg_from_map(self.grid_map, rospy.Time.now(), "map"), data=[0])

        def refused_is_heard() -> bool:  # again and again: the node's rosout may connect after its first line
            maps.publish(bad)
            return bool(self.lines.having("the map of topic /other_map is refused", "got 1"))

        status = Heard("/by_topic/status", LocalizationStatus)
        refused = wait_until(refused_is_heard, 30.0)
        said = wait_until(lambda: len(status) and "/other_map is refused: a map of" in status.last.reason, 30.0)
        maps.publish(self.map_msg)
        heard = wait_until(lambda: len(poses), 30.0)
        maps.publish(self.map_msg)
        same = wait_until(lambda: self.lines.having("is already in use"), 30.0)
        kept = self.stays_right_on(maps, poses, self.graded_map())
        code, printed = node.end()
        self.assertTrue(
            connected and refused and said and heard and same and kept,
            (connected, refused, said, heard, same, kept, printed),
        )
        self.assertEqual(code, 0, printed)

    def test_the_first_map_may_be_the_only_one(self) -> None:
        maps = rospy.Publisher("first_map", OccupancyGrid, queue_size=2)
        node = self.start("first_only", "_use_map_topic:=true", "_first_map_only:=true", "map:=/first_map")
        connected = wait_until(maps.get_num_connections, 30.0)

        def taken_is_heard() -> bool:  # again and again: the node's rosout may connect after its first line
            maps.publish(self.map_msg)
            return bool(self.lines.having("map of 250 x 190 cells", "topic /first_map"))

        taken = wait_until(taken_is_heard, 30.0)
        maps.publish(self.graded_map())
        self.robot.make_steps(10)
        code, printed = node.end()
        self.assertTrue(connected and taken, (connected, taken, printed))
        self.assertEqual((code, printed.count("map of 250 x 190 cells")), (0, 1), printed)

    def graded_map(self) -> OccupancyGrid:
        """The room as a mapper with probabilities draws it: walls of 70 to 100, free cells of 0 to 20."""
        msg = conversions.msg_from_map(self.grid_map, rospy.Time.now(), "map")
        rng = np.random.default_rng(1)
        free = self.grid_map.occupancy.ravel() == 0
        grades = np.where(free, rng.integers(0, 20, free.size), rng.integers(70, 101, free.size))
        return changed(msg, data=grades.astype(int).tolist())

    def stays_right_on(self, maps: rospy.Publisher, poses: Heard, msg: OccupancyGrid) -> bool:
        """Another map leaves the robot where it is, not at its configured start."""
        self.robot.moving = True
        self.robot.make_steps(25)  # 0.75 m away from that start
        self.lines.clear()
        maps.publish(msg)
        taken = wait_until(lambda: self.lines.having("map of 250 x 190 cells"), 30.0)
        self.robot.make_steps(3)
        poses.clear()

        def is_right() -> bool:
            said = conversions.planar_from_pose(poses.all[0].pose.pose) if len(poses) else np.full(3, np.inf)
            return bool(np.hypot(*(said - self.robot.map_from_base())[:2]) < 0.4)

        return taken and wait_until(lambda: len(poses), 30.0) and is_right()

    # -- initialpose

    def test_garbage_on_initialpose_is_refused(self) -> None:
        here = self.robot.map_from_base()
        for words, msg in (
            ("finite", changed(pose_message(here), pose__pose__position__x=math.nan)),
            ("finite", changed(pose_message(here), pose__pose__position__y=math.inf)),
            ("quaternion", changed(pose_message(here), pose__pose__orientation=Quaternion())),
            ("quaternion", changed(pose_message(here), pose__pose__orientation=Quaternion(w=math.nan))),
            ("covariance must be finite", with_covariance(pose_message(here), 0, 0, math.nan)),
            ("must not be negative", with_covariance(pose_message(here), 5, 5, -0.1)),
            ("must be symmetric", with_covariance(pose_message(here), 0, 1, 0.005)),
            ("frame 'map', got 'odom'", changed(pose_message(here), header__frame_id="odom")),
            ("frame 'map', got ''", changed(pose_message(here), header__frame_id="")),
            ("outside the map", pose_message(np.array([1e4, 0.0, 0.0]))),
        ):
            with part(words):
                self.lines.clear()
                self.initialpose.publish(msg)
                self.expect_line("initialpose refused", words)
                self.assertEqual(len(self.lines.having("starting at")), 0)
        self.expect_right_pose()

    def test_an_initialpose_is_moved_on_by_the_odometry_since_its_stamp(self) -> None:
        self.robot.moving = False
        self.robot.make_steps(2)
        before = self.robot.map_from_base()
        msg = pose_message(before)
        self.robot.make_steps(2)  # the odometry at its stamp is that of the standing robot
        self.robot.moving = True
        self.robot.make_steps(30)
        self.robot.moving = False
        self.robot.make_steps(2)
        now = self.robot.map_from_base()
        self.assertGreater(np.hypot(*(now - before)[:2]), 0.5)
        self.lines.clear()
        self.initialpose.publish(msg)
        self.expect_line("starting at")
        start = [float(number) for number in re.findall(r"-?\d+\.\d+", self.lines.having("starting at")[0])]
        self.assertLess(np.abs(now - start).max(), 0.01, f"true {now}, started at {start}")
        self.expect_right_pose()

    def test_a_stamp_before_all_odometry_is_reported(self) -> None:
        self.initialpose.publish(changed(pose_message(self.robot.map_from_base()), header__stamp=rospy.Time(10)))
        self.expect_line("taken as of now", "no odometry at its stamp")
        self.expect_right_pose()

    # -- scans

    def test_bad_scans_are_refused_and_the_odometry_is_not_lost(self) -> None:
        n = len(BEAMS)
        for words, fields in (
            ("no ranges", {"ranges": []}),
            ("angle_increment", {"angle_increment": 0.0}),
            ("angle_increment", {"angle_increment": math.nan}),
            ("angle_min", {"angle_min": math.inf}),
            ("range_max", {"range_max": 0.0}),
            ("range_max", {"range_max": math.nan}),
            ("range_min", {"range_min": -1.0}),
            ("no frame_id", {"header__frame_id": ""}),
            ("no stamp", {"header__stamp": rospy.Time(0)}),
            (None, {"ranges": [math.nan] * n}),
            (None, {"ranges": [math.inf] * n}),
            (None, {"ranges": [-math.inf] * n}),
            (None, {"ranges": [0.0] * n}),
            (None, {"ranges": [1.0]}),
            (None, {"range_max": math.inf}),  # the default of pointcloud_to_laserscan
            (None, {"range_max": 1e30}),
        ):
            with part(f"{words}: " + ", ".join(f"{name} {str(value)[:20]}" for name, value in fields.items())):
                self.lines.clear()
                self.robot.spoil = lambda msg, fields=fields: changed(msg, **fields)
                if words is None:
                    self.robot.make_steps(10)
                else:
                    self.expect_line("scan refused", words)
                self.robot.spoil = lambda msg: msg
                self.expect_right_pose()

    def test_beams_without_an_answer_are_left_out_and_the_others_used(self) -> None:
        for nothing in (math.nan, math.inf, -math.inf, 0.0):
            with part(f"every second range {nothing}"):
                self.robot.spoil = lambda msg, nothing=nothing: changed(
                    msg, ranges=[nothing if index % 2 else value for index, value in enumerate(msg.ranges)]
                )
                self.robot.make_steps(10)
                self.expect_right_pose()
                self.expect_understood()

    def test_odometry_is_not_counted_twice_over_scans_that_are_refused(self) -> None:
        for fields in ({"range_max": -1.0}, {"range_min": -0.1}):
            with part(str(fields)):
                self.robot.spoil = lambda msg, fields=fields: changed(msg, **fields)
                self.robot.make_steps(20)
                self.transforms.clear()
                self.assertTrue(wait_until(lambda: len(self.transforms), 30.0), "tf is silent")
                self.assertLess(self.error_m(), 0.25)  # without a scan, by odometry alone
                self.robot.spoil = lambda msg: msg
                self.expect_right_pose()

    def test_without_odometry_the_missing_transform_is_named(self) -> None:
        self.robot.moving = False  # tf carries on between its last transform and the next one
        self.robot.odometry_is_told = False
        self.expect_line("scan dropped after 0.5 s: no transform odom <- base_link")
        self.assertTrue(
            wait_until(lambda: "no transform odom <- base_link" in self.status.last.reason, 30.0), str(self.status.last)
        )
        self.robot.odometry_is_told = True
        self.expect_right_pose()

    def test_an_unknown_scan_frame_is_reported(self) -> None:
        self.robot.spoil = lambda msg: changed(msg, header__frame_id="nowhere")
        self.expect_line("no transform base_link <- nowhere")
        self.robot.spoil = lambda msg: msg
        self.expect_right_pose()

    def test_silence_of_the_scan_is_reported_in_the_status(self) -> None:
        self.robot.lidar.silent = True
        self.assertTrue(
            wait_until(lambda: self.status.last.reason.startswith("no scan on /scan for"), 30.0), str(self.status.last)
        )
        self.assertEqual(self.status.last.state, LocalizationStatus.UNCERTAIN)
        self.robot.lidar.silent = False
        self.expect_right_pose()

    def test_stamps_of_other_times_do_no_harm(self) -> None:
        for shift_s in (-30.0, 30.0):
            with part(f"{shift_s} s"):
                self.robot.spoil = lambda msg, shift_s=shift_s: changed(
                    msg, header__stamp=msg.header.stamp + rospy.Duration(shift_s)
                )
                self.robot.make_steps(5)
                self.robot.spoil = lambda msg: msg
                self.expect_right_pose()  # and not only when the stamps have caught up

    def test_a_laser_that_hangs_upside_down(self) -> None:
        self.robot.lidar.silent = True
        self.robot.make_steps(2)
        self.robot.lidar.upside_down = True
        self.robot.make_steps(2)  # no interpolation between the two mountings
        self.robot.lidar.silent = False
        self.initialpose.publish(pose_message(self.robot.map_from_base()))
        self.robot.make_steps(20)
        self.expect_right_pose()
        self.assertNotIn(self.status.last.state_name, ("LOST", "UNKNOWN"), self.status.last.reason)
        self.expect_understood()

    def test_another_sender_of_map_to_odom_is_named(self) -> None:
        other = tf2_ros.TransformBroadcaster()
        here = conversions.transform_stamped(0, "map", "odom", np.array([3.0, 0.0, 0.0]))

        def is_named() -> bool:
            here.header.stamp = rospy.Time.now()
            other.sendTransform(here)
            return bool(self.lines.having("tf map -> odom comes from", "stop one of them", rospy.get_name()))

        self.assertTrue(wait_until(is_named, 30.0), "nothing is said of the second sender")
        self.expect_right_pose()

    # -- start and end of a node of its own

    def test_an_unknown_parameter_ends_the_start(self) -> None:
        code, printed = self.start("misspelt", "_min_particle:=100").wait(30.0)
        self.assertEqual(code, 2, printed)
        self.assertIn("unknown parameter ~min_particle; did you mean ~min_particles?", printed)

    def test_a_single_beam_is_too_few(self) -> None:
        code, printed = self.start("one_beam", "_laser_max_beams:=1").wait(30.0)
        self.assertEqual(code, 2, printed)
        self.assertIn("~laser_max_beams must be in [2, 10000], got 1", printed)

    def test_a_value_that_amcl_ignores_is_a_warning_of_amcl_alone(self) -> None:
        code, printed = self.start("written", "_initial_cov_xx:='0.5*0.5'").wait(30.0)
        self.assertEqual(code, 2, printed)
        self.assertIn("~initial_cov_xx must be float, got '0.5*0.5'", printed)
        node = self.start("copied", "_initial_cov_xx:='0.5*0.5'", "_tf_broadcast:=1", script="amcl")
        has_map = wait_until(lambda: any(m.name == "/copied" and "map of" in m.msg for m in self.lines.all), 30.0)
        _, printed = node.end()  # /rosout may lack what a node says before the first subscriber is there
        self.assertTrue(has_map, printed)
        self.assertIn("/copied: ~initial_cov_xx must be float, got '0.5*0.5'; not used, as by amcl", printed)
        self.assertIn("/copied: ~tf_broadcast must be bool, got 1; not used, as by amcl", printed)

    def test_a_bag_is_not_for_the_node(self) -> None:
        code, printed = Process("amcl", "__name:=with_a_bag", "--run-from-bag", "run.bag").wait(30.0)
        self.assertEqual(code, 2, printed)
        self.assertIn("glass_nav replay", printed)

    def test_a_parameter_of_the_wrong_type_ends_the_start(self) -> None:
        code, printed = self.start("mistyped", "_tf_broadcast:=1").wait(30.0)
        self.assertEqual(code, 2, printed)
        self.assertIn("~tf_broadcast must be bool, got 1", printed)

    def check_end(self, name: str, how: int, script: str, *private: str) -> str:
        poses = Heard(f"/{name}/pose", PoseWithCovarianceStamped)
        self.robot.moving = False  # until the node is there: its start pose is where the robot stands now
        x, y, yaw = self.robot.map_from_base()
        node = self.start(
            name,
            f"_initial_pose_x:={x}",
            f"_initial_pose_y:={y}",
            f"_initial_pose_a:={yaw}",
            "_initial_cov_xx:=0.01",
            "_initial_cov_yy:=0.01",
            "_initial_cov_aa:=0.01",
            "_save_pose_rate:=0.0",
            "_laser_likelihood_max_dist:=2.0",
            "_do_beamskip:=false",
            *private,
            script=script,
        )
        started = wait_until(lambda: len(poses), 30.0)
        self.robot.moving = True
        heard = started and wait_until(lambda: len(poses) > 3, 30.0)
        self.robot.moving = False  # a busy machine may take seconds to end the node
        self.robot.make_steps(5)
        code, printed = node.end(how)
        self.assertTrue(heard, printed)
        self.assertEqual(code, 0, printed)
        self.assertNotIn("Traceback", printed)
        self.assertIn("~do_beamskip, ~laser_likelihood_max_dist", printed)
        saved = [rospy.get_param(f"/{name}/initial_pose_{axis}") for axis in "xya"]
        self.assertNotEqual(saved, [x, y, yaw])
        self.assertLess(np.hypot(*(np.array(saved) - self.robot.map_from_base())[:2]), 0.6)
        self.assertGreater(rospy.get_param(f"/{name}/initial_cov_xx"), 0.0)
        return printed

    def test_interrupted_it_saves_the_pose(self) -> None:
        self.check_end("interrupted", signal.SIGINT, "localization_node")

    def test_terminated_it_saves_the_pose(self) -> None:
        printed = self.check_end("terminated", signal.SIGTERM, "amcl", "_receive_map_topic:=true")
        self.assertIn(
            "/terminated: unknown parameter ~receive_map_topic; did you mean ~use_map_topic?; not used, as by amcl",
            printed,
        )


if __name__ == "__main__":
    rospy.init_node("localization_interface_rostest")
    rostest.rosrun("glass_nav", "localization_interface", LocalizationInterface)
