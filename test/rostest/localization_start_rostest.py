#!/usr/bin/env python3
"""How the running node starts: without a guess, in an area, from its pose file; and how it is tuned while it runs."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path
from typing import Any, Dict, List, Optional

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
import rospy
import rostest
import yaml
from dynamic_reconfigure import DynamicReconfigureCallbackException
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import Point32, PolygonStamped, PoseArray, PoseWithCovarianceStamped
from nav_msgs.srv import GetMap, GetMapResponse
from room_robot import Robot, pose_message, room
from rostest_support import Heard, LogLines, Process, part, wait_until
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from glass_nav.msg import LocalizationStatus
from glass_nav.ros import conversions


def area(*corners: "tuple[float, float]", frame: str = "map") -> PolygonStamped:
    msg = PolygonStamped()
    msg.header.frame_id = frame
    msg.polygon.points = [Point32(x, y, 0.0) for x, y in corners]
    return msg


class LocalizationStart(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.grid_map = room()
        cls.map_msg = conversions.msg_from_map(cls.grid_map, rospy.Time.now(), "map")
        rospy.Service("static_map", GetMap, lambda _: GetMapResponse(cls.map_msg))
        cls.lines = LogLines()
        cls.poses = Heard("amcl_pose", PoseWithCovarianceStamped)
        cls.particles = Heard("particlecloud", PoseArray)
        cls.status = Heard("/under_test/status", LocalizationStatus)
        cls.transforms = Heard("/tf", TFMessage, lambda msg: msg.transforms[0].header.frame_id == "map")
        cls.initialpose = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=1)
        cls.areas = rospy.Publisher("global_localization_area", PolygonStamped, queue_size=1)
        cls.robot = Robot(cls.grid_map)
        cls.folder = Path(tempfile.mkdtemp())

    def setUp(self) -> None:
        self.robot.reset()
        self.node: Optional[Process] = None

    def tearDown(self) -> None:
        if self.node is not None:
            self.node.end()

    def start(self, *private: str) -> None:
        """A node; what was heard of the one before is forgotten."""
        if rospy.has_param("/under_test"):
            rospy.delete_param("/under_test")  # as after a reboot
        for heard in (self.lines, self.poses, self.particles, self.status, self.transforms):
            heard.clear()
        self.node = Process("localization_node", "__name:=under_test", *private)

    def end(self) -> str:
        assert self.node is not None
        code, printed = self.node.end()
        self.node = None
        self.assertEqual(code, 0, printed)
        self.assertNotIn("Traceback", printed)
        return printed

    def wait_for(self, what: str, condition: Any, timeout_s: float = 30.0) -> None:
        self.assertTrue(
            wait_until(condition, timeout_s),
            f"{what}: not within {timeout_s:g} s; last status: "
            f"{self.status.last}; last lines: {self.lines.having('')[-5:]}",
        )

    def wait_for_line(self, *words: str) -> None:
        self.wait_for(f"a line with {words}", lambda: self.lines.having(*words), 15.0)

    def said(self) -> np.ndarray:
        return conversions.planar_from_pose(self.poses.last.pose.pose)

    def is_right(self) -> bool:
        """The robot stands, or the pose is a moment old."""
        return bool(len(self.poses) and np.hypot(*(self.said() - self.robot.map_from_base())[:2]) < 0.3)

    @property
    def state(self) -> str:
        """The last one said."""
        return str(self.status.last.state_name) if len(self.status) else ""

    def states(self) -> List[str]:
        return [msg.state_name for msg in self.status.all]

    # -- start

    def test_without_a_guess_it_searches_and_tells_tf_nothing_before_it_knows(self) -> None:
        self.start("_start_without_guess:=true", "_publish_tf_before_localized:=false")
        self.wait_for("a search", lambda: "GLOBAL_SEARCH" in self.states() or "LOCALIZED" in self.states())
        at = self.states().index("LOCALIZED") if "LOCALIZED" in self.states() else None
        if at is None:
            self.assertEqual(len(self.transforms), 0)
        self.wait_for("listeners", self.initialpose.get_num_connections)
        self.initialpose.publish(pose_message(self.robot.map_from_base()))
        self.wait_for("LOCALIZED", lambda: "LOCALIZED" in self.states())
        self.wait_for("a transform", lambda: len(self.transforms))
        first_ns = conversions.ns_from_stamp(self.transforms.all[0].transforms[0].header.stamp)
        localized_ns = [
            conversions.ns_from_stamp(msg.header.stamp) for msg in self.status.all if msg.state_name == "LOCALIZED"
        ][0]
        self.assertEqual(first_ns, localized_ns + 100_000_000)  # ~transform_tolerance
        self.assertTrue(all(0.0 <= msg.reliability <= 1.0 for msg in self.status.all if np.isfinite(msg.used_share)))
        self.check_area()
        self.lines.clear()
        rospy.ServiceProxy("global_localization", Empty)()
        self.wait_for_line("may be anywhere in the map")
        self.end()

    def check_area(self) -> None:
        """The node searches where it is told to, and refuses what is no place."""
        for words, msg in (
            ("frame 'map', got 'odom'", area((0, 0), (1, 0), (1, 1), frame="odom")),
            ("at least 3 corners, got 2", area((0, 0), (1, 0))),
            ("must be finite", area((0, 0), (1, 0), (float("nan"), 1))),
            ("the area has no free cell", area((100, 100), (101, 100), (101, 101))),
        ):
            self.lines.clear()
            self.areas.publish(msg)
            self.wait_for_line("global_localization_area refused", words)
        self.assertEqual(self.state, "LOCALIZED")
        self.robot.moving = False
        self.robot.make_steps(3)
        x, y, _ = self.robot.map_from_base()
        self.particles.clear()
        self.areas.publish(area((x - 1, y - 1), (x + 1, y - 1), (x + 1, y + 1), (x - 1, y + 1)))
        self.wait_for_line("an area of 4 corners")
        self.wait_for("particles", lambda: len(self.particles))
        cloud = np.array([(pose.position.x, pose.position.y) for pose in self.particles.all[0].poses])
        self.assertLess(np.abs(cloud - [x, y]).max(), 1.0 + 0.9)  # the first scan has already moved and weighed them
        self.robot.moving = True

    # -- pose file

    def drive_with_a_pose_file(self, path: Path) -> Dict[str, Any]:
        """A node that localizes, keeps its pose and ends; what the file says then."""
        self.start(f"_pose_file:={path}", "_save_pose_rate:=5.0")
        self.wait_for_line("no pose file", "yet")
        self.wait_for("listeners", self.initialpose.get_num_connections)
        self.initialpose.publish(pose_message(self.robot.map_from_base()))
        self.wait_for("LOCALIZED at the right place", lambda: self.state == "LOCALIZED" and self.is_right())
        self.wait_for("a pose of centimetres", self.is_right_after_a_stretch)
        self.end()
        return dict(yaml.safe_load(path.read_text()))

    def is_right_after_a_stretch(self) -> bool:
        """Drives on for a second; the filter of a busy machine, which sees few of the scans, needs some of them."""
        self.robot.moving = True
        self.robot.make_steps(10)
        self.robot.moving = False
        self.robot.make_steps(10)
        return bool(np.hypot(*(self.said() - self.robot.map_from_base())[:2]) < 0.05)

    def start_again(self, path: Path, *words: str) -> np.ndarray:
        """Where the next node, which has the file alone, is at first."""
        self.start(f"_pose_file:={path}")
        self.wait_for_line(*words)
        self.wait_for("a pose", lambda: len(self.poses))
        first = conversions.planar_from_pose(self.poses.all[0].pose.pose)
        self.wait_for("a right pose", self.is_right)
        self.end()
        return first

    def test_the_pose_survives_a_reboot_and_is_not_believed_against_the_evidence(self) -> None:
        path = self.folder / "pose.yaml"
        content = self.drive_with_a_pose_file(path)
        self.assertEqual((content["state"], content["map"]), ("LOCALIZED", self.grid_map.digest))
        here = self.robot.map_from_base()
        np.testing.assert_allclose(content["map_from_base"], here, atol=0.1)
        with part("odometry goes on: the robot drives while no node runs"):
            self.robot.moving = True
            self.robot.make_steps(15)
            self.robot.moving = False
            self.robot.make_steps(2)
            here = self.robot.map_from_base()
            np.testing.assert_allclose(self.start_again(path, "of the pose file", "odometry says"), here, atol=0.3)
        with part("odometry begins anew"):
            self.robot.map_from_odom = here
            self.robot.make_steps(2)
            np.testing.assert_allclose(self.start_again(path, "of the pose file", "odometry restarted"), here, atol=0.3)
        for change, words in (
            ({"map": "0" * 16}, "it is of map 0000000000000000"),
            ({"stamp_ns": 10**9}, "~pose_file_max_age_s is 604800 s"),
            ({"state": "LOST"}, "the robot was LOST"),
            ({"map_from_base": None}, "its map_from_base must be finite numbers"),
        ):
            with part(words):
                path.write_text(yaml.safe_dump({**content, "odom_from_base": [0.0, 0.0, 0.0], **change}))
                self.start(f"_pose_file:={path}")
                self.wait_for_line("is not used", words, "the robot may be anywhere in the map")
                self.wait_for("a state", lambda: len(self.poses) and len(self.particles))
                cloud = np.array([pose.position.x for pose in self.particles.all[0].poses])
                self.assertGreater(np.ptp(cloud), 1.0)
                self.end()

    def test_a_pose_file_in_no_folder_ends_the_start(self) -> None:
        self.start("_pose_file:=/nowhere/pose.yaml")
        assert self.node is not None
        code, printed = self.node.wait(30.0)
        self.assertEqual(code, 2, printed)
        self.assertIn("~pose_file must lie in a folder that exists, got '/nowhere/pose.yaml'", printed)

    # -- dynamic_reconfigure

    def test_it_is_tuned_while_it_runs_and_forgets_nothing(self) -> None:
        x, y, yaw = self.robot.map_from_base()
        self.start("_max_particles:=250", f"_initial_pose_x:={x}", f"_initial_pose_y:={y}", f"_initial_pose_a:={yaw}")
        self.wait_for("a right pose", lambda: self.is_right() and self.state == "LOCALIZED")
        client = Client("/under_test", timeout=20.0)
        self.assertEqual(client.get_configuration(timeout=10.0)["min_particles"], 250)
        self.assertEqual(rospy.get_param("/under_test/min_particles"), 250)  # what is in effect can be read back
        self.assertIs(rospy.get_param("/under_test/tf_broadcast"), True)
        self.lines.clear()
        now = client.update_configuration(
            {"update_min_d": 0.05, "laser_z_hit": 1, "weight_mode": "ranges", "transform_tolerance": 0.3}
        )
        self.assertEqual((now["update_min_d"], now["laser_z_hit"], now["weight_mode"]), (0.05, 1.0, "ranges"))
        self.assertEqual(rospy.get_param("/under_test/weight_mode"), "ranges")
        self.wait_for_line("parameters now", "update_min_d 0.05")
        self.status.clear()
        self.poses.clear()
        self.wait_for("poses", lambda: len(self.poses) > 5)
        self.assertEqual(set(self.states()), {"LOCALIZED"}, "the filter was not left alone")
        self.assertTrue(self.is_right())
        for bad, words in (
            ({"laser_z_hit": -1.0}, "~laser_z_hit must be in [0, 100], got -1.0"),
            ({"min_particles": 251}, "~min_particles must be in [1, ~max_particles = 250], got 251"),
            ({"max_particles": 1234567890}, "~max_particles must be in [1, 1000000], got 1234567890"),
            ({"vote_mode": "none"}, "~vote_mode must be one of soft, paper, got 'none'"),
            (
                {"transform_tolerance": float("nan"), "laser_z_hit": 0.5},
                "~transform_tolerance must be in [0, 100], got nan",
            ),
        ):
            with part(words):
                self.lines.clear()
                with self.assertRaises(DynamicReconfigureCallbackException):
                    client.update_configuration(bad)
                self.wait_for_line("parameters stay as they are", words)
                self.assertEqual(client.get_configuration()["laser_z_hit"], 1.0)
        self.check_dynparam(client)
        self.assertEqual(client.update_configuration({"restore_defaults": True})["laser_z_hit"], 0.95)
        self.check_many_at_once(client)
        self.assertTrue(self.is_right())
        self.end()
        self.assertFalse(rospy.has_param("/under_test/min_particles"), "the next start would take it as given")

    def check_dynparam(self, client: Client) -> None:
        """The command that doc/localization.md names for Debian."""
        page = (Path(__file__).resolve().parents[2] / "doc" / "localization.md").read_text(encoding="utf-8")
        named = re.search(r'`python3 -c "(.*?)"`', page)
        assert named is not None
        command = named.group(1).replace("/amcl", "/under_test")
        subprocess.run([sys.executable, "-c", command], check=True, timeout=60.0)
        self.assertEqual(client.get_configuration(timeout=10.0)["update_min_d"], 0.2)

    def check_many_at_once(self, client: Client) -> None:
        """Callers beside each other do not undo one another's values."""

        def change(name: str) -> None:
            for value in (0.3, 0.4, 0.5):
                client.update_configuration({name: value})

        names = ("update_min_d", "update_min_a", "std_warn_level_x")
        threads = [threading.Thread(target=change, args=(name,)) for name in names]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(30.0)
        now = client.update_configuration({})
        self.assertEqual([now[name] for name in names], [0.5] * 3)


if __name__ == "__main__":
    rospy.init_node("localization_start_rostest")
    rostest.rosrun("glass_nav", "localization_start", LocalizationStart)
