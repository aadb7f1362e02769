#!/usr/bin/env python3
"""launch/replay.launch plays a bag to the node, which misses no scan; glass_nav doctor --live listens meanwhile."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
import rosbag
import rospy
import rostest
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rostest_support import Heard, Process, wait_until
from sensor_msgs.msg import LaserScan

from glass_nav.msg import LocalizationStatus
from glass_nav.ros import conversions

START_S, PLAY_S = 60.0, 60.0
CLOSE_M = 0.2
PLAYED_S = 14.0  # of the bag


class ReplayLaunch(unittest.TestCase):
    def test_the_node_is_ready_before_the_bag_plays_and_follows_it(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            bag = Path(folder) / "run.bag"
            code, printed = Process(
                "glass_nav",
                "simulate",
                "glass_atrium",
                "--path",
                "half",
                "--beams",
                "181",
                "--rate",
                "5",
                "--speed",
                "1.0",
                "--out",
                str(bag),
            ).wait(60.0)
            self.assertEqual(code, 0, printed)
            with rosbag.Bag(str(bag)) as recorded:
                stamps = [
                    msg.header.stamp
                    for _, msg, _ in recorded.read_messages(topics=["/scan"])
                    if (msg.header.stamp - rospy.Time(recorded.get_start_time())).to_sec() < PLAYED_S
                ]
                first = next(msg for _, msg, _ in recorded.read_messages(topics=["/ground_truth"]))
            start = conversions.planar_from_pose(first.pose)
            poses = Heard("amcl_pose", PoseWithCovarianceStamped)
            status = Heard("/glass_localization/status", LocalizationStatus, lambda msg: not np.isnan(msg.used_share))
            scans, truth = Heard("scan", LaserScan), Heard("ground_truth", PoseStamped)
            launch = subprocess.Popen(
                [
                    "roslaunch",
                    "glass_nav",
                    "replay.launch",
                    f"bag:={bag}",
                    f"map:={bag.with_suffix('.map.yaml')}",
                    f"bag_options:=--duration={PLAYED_S}",
                    f"initial_pose_x:={start[0]}",
                    f"initial_pose_y:={start[1]}",
                    f"initial_pose_a:={start[2]}",
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
            try:
                self.assertTrue(wait_until(lambda: len(poses), START_S), "no pose within a minute")
                live = Process("glass_nav", "doctor", "--live", "--seconds", "5")
                code, printed = live.wait(60.0)
                self.assertEqual(code, 0, printed)
                self.assertIn("no fault found", printed)
                self.assertIn("/scan: ", printed)
                self.assertIn("map: ", printed)
                log, _ = launch.communicate(timeout=PLAY_S)
            finally:
                if launch.poll() is None:
                    launch.terminate()
                    launch.communicate()
            self.assertEqual(launch.returncode, 0, log)  # it ends with the bag
            self.assertEqual([msg.header.stamp for msg in scans.all][: len(stamps) - 2], stamps[:-2])
            self.assertEqual(status.all[0].header.stamp, stamps[0], "the first scan was played too early")
            last = poses.last
            true = next(msg for msg in truth.all if msg.header.stamp == last.header.stamp)
            off = conversions.planar_from_pose(last.pose.pose) - conversions.planar_from_pose(true.pose)
            self.assertLess(np.hypot(off[0], off[1]), CLOSE_M)

    def test_without_a_robot_the_doctor_says_what_is_missing(self) -> None:
        code, printed = Process("glass_nav", "doctor", "--live", "--seconds", "0.5").wait(60.0)
        self.assertEqual(code, 1, printed)
        self.assertIn("finding  no-scans: no topic of sensor_msgs/LaserScan", printed)


if __name__ == "__main__":
    rospy.init_node("replay_launch_rostest")
    rostest.rosrun("glass_nav", "replay_launch", ReplayLaunch)
