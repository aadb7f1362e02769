#!/usr/bin/env python3
"""A whole wake-up by the real nodes: simulator, driver, topology, localization; all but the first are killed once.

The robot stands somewhere, nobody knows where; at the end it is localized and has driven to a node of the atlas.
"""

from __future__ import annotations

import re
import signal
import sys
import tempfile
import unittest
from pathlib import Path
from typing import List

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rostest_support import Heard, LogLines, Process, wait_until
from std_msgs.msg import Bool

from glass_nav.geometry import angles
from glass_nav.msg import DriverStatus, EdgeTraversal, LocalizationStatus, Meetpoint, TopologyStatus
from glass_nav.ros import conversions

BUILDING = "opaque_office"
STEP_S = 90.0  # of the wall clock, for an edge or two


def topology() -> Process:
    """By the graph alone: scans would find the robot before its first edge."""
    return Process("topology_node", "__name:=glass_topology", f"_atlas:={BUILDING}", "_use_scans:=false")


def driver() -> Process:
    return Process(
        "driver_node",
        "__name:=glass_driver",
        f"_atlas:={BUILDING}",
        "topology_status:=glass_topology/status",
        "restart_search:=glass_topology/restart",
        "localization_status:=glass_localization/status",
    )


def localization() -> Process:
    return Process("localization_node", "__name:=glass_localization", "_wait_for_initialpose:=true")


class WakeUp(unittest.TestCase):
    def setUp(self) -> None:
        self.lines = LogLines()
        self.truth = Heard("ground_truth", PoseStamped)
        self.odometry = Heard("odom", Odometry)
        self.blocked = Heard("/simulator/blocked", Bool, lambda msg: msg.data)
        self.topology = Heard("/glass_topology/status", TopologyStatus)
        self.driver = Heard("/glass_driver/status", DriverStatus)
        self.meetpoints = Heard("meetpoint", Meetpoint)
        self.traversals = Heard("edge_traversal", EdgeTraversal)
        self.localization = Heard("/glass_localization/status", LocalizationStatus)
        self.handed_over = Heard("initialpose", PoseWithCovarianceStamped)
        self.poses = Heard("amcl_pose", PoseWithCovarianceStamped)
        self.nodes: List[Process] = []

    def tearDown(self) -> None:
        for node in self.nodes:
            node.end(signal.SIGKILL)

    def start(self, node: Process) -> Process:
        self.nodes.append(node)
        return node

    def await_(self, condition: object, timeout_s: float, what: str) -> None:
        said = [heard.last.reason if heard.last else None for heard in (self.topology, self.driver)]
        self.assertTrue(
            wait_until(condition, timeout_s),
            f"no {what} within {timeout_s:g} s; topology and driver say {said}; {self.lines.having('')[-10:]}",
        )

    def is_at(self, depth: int, after: int) -> bool:
        """A search that has come so far, by what the topology said after so many words."""
        return any(
            msg.depth >= depth and msg.state_name in ("SEARCHING", "TENTATIVE", "CONFIRMED")
            for msg in self.topology.all[after:]
        )

    def true_pose(self, stamp: rospy.Time) -> np.ndarray:
        self.await_(lambda: any(msg.header.stamp == stamp for msg in self.truth.all), 10.0, "truth at the stamp")
        return next(conversions.planar_from_pose(msg.pose) for msg in self.truth.all if msg.header.stamp == stamp)

    def test_a_robot_finds_out_where_it_is_though_nodes_die_on_the_way(self) -> None:
        picture = Path(tempfile.mkdtemp()) / "wakeup.png"
        demo = self.start(
            Process(
                "wakeup_demo",
                f"_atlas:={BUILDING}",
                "_tour:=1",
                "_searches:=4",
                f"_picture:={picture}",
                "topology_status:=glass_topology/status",
                "restart_search:=glass_topology/restart",
                "topology_candidates:=glass_topology/candidates",
                "localization_status:=glass_localization/status",
            )
        )
        first_localization = self.start(localization())
        first_topology, first_driver = self.start(topology()), self.start(driver())
        self.await_(lambda: self.is_at(1, 0), STEP_S, "edge driven")
        self.assertEqual(self.localization.last.state_name, "UNKNOWN")
        self.assertFalse(len(self.poses))

        first_localization.end(signal.SIGKILL)  # nobody needs it yet; the second one knows as little
        heard = len(self.localization)
        self.start(localization())
        self.await_(lambda: len(self.localization) > heard, STEP_S, "word of the second localization")
        self.assertEqual(self.localization.last.state_name, "UNKNOWN")

        first_topology.end(signal.SIGKILL)  # the driver drives on to its meetpoint, and tells the next one of it
        heard = len(self.topology)
        self.start(topology())
        self.await_(lambda: self.is_at(0, heard), STEP_S, "search of the second topology node")

        self.await_(lambda: self.driver.last.state_name == "FOLLOWING", STEP_S, "edge that is followed")
        first_driver.end(signal.SIGKILL)
        self.await_(lambda: self.odometry.last.twist.twist.linear.x == 0.0, 20.0, "standstill without a driver")
        self.start(driver())
        self.await_(
            lambda: self.lines.having("the robot did not come along one edge: the search continues by dead reckoning"),
            STEP_S,
            "meetpoint of the second driver",
        )

        # whom it says to be LOST, the demo asks to begin anew
        self.await_(lambda: self.topology.last.state_name == "CONFIRMED", 2 * STEP_S, "place that is CONFIRMED")
        self.await_(lambda: len(self.handed_over), 10.0, "initialpose")
        handed_over = self.handed_over.last
        said, true = conversions.planar_from_pose(handed_over.pose.pose), self.true_pose(handed_over.header.stamp)
        self.assertLess(np.hypot(*(said - true)[:2]), 0.3, f"said {said}, true {true}")
        self.assertLess(abs(float(angles.wrap(said[2] - true[2]))), 0.2, f"said {said}, true {true}")
        self.assertEqual(len(self.handed_over), 1)
        by_stamp = {msg.header.stamp: msg for msg in self.meetpoints.all}
        for msg in self.traversals.all:
            self.assertIn(msg.header.stamp, by_stamp)  # both of an arrival have one stamp

        code, printed = demo.wait(2 * STEP_S)  # which drives to a node, and measures
        self.assertEqual(code, 0, printed)
        self.assertIn("wakes up at x ", printed)
        self.assertRegex(printed, r"  match node M0: degree [34], r ")
        self.assertIn("  match edge E0: ", printed)
        self.assertIn(f"CONFIRMED after {self.topology.last.depth} edges, right: hands over x ", printed)
        self.assertRegex(printed, r"goto_node \d+: it stands at the goal, .* m driven; truly 0\.[01]\d m from the node")
        tracking = re.search(r"tracking over (\d+) m: mean (\d\.\d+) m", printed)
        self.assertIsNotNone(tracking, printed)
        self.assertGreater(int(tracking[1]), 3)
        self.assertLess(float(tracking[2]), 0.05)
        self.assertGreater(picture.stat().st_size, 10_000)
        self.assertEqual(self.localization.last.state_name, "LOCALIZED")
        self.assertFalse(len(self.blocked), "the robot touched something")

    def test_the_demo_says_what_it_cannot_do(self) -> None:
        for arguments, line in (
            ((), "~atlas must be a file, a folder or the name of a shipped atlas, got ''"),
            (("_atlas:=opaque_offise",), "did you mean opaque_office?"),
            (("_atlas:=opaque_office", "_searches:=0"), "~searches must be >= 1, got 0"),
        ):
            code, printed = Process("wakeup_demo", "__name:=demo_refused", *arguments).wait(30.0)
            self.assertEqual(code, 2, printed)
            self.assertIn(line, printed)
            self.assertNotIn("Traceback", printed)


if __name__ == "__main__":
    rospy.init_node("wakeup_rostest")
    rostest.rosrun("glass_nav", "wakeup", WakeUp)
