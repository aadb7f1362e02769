#!/usr/bin/env python3
"""The running node finds a pane that its map lacks, keeps it in a file, and knows it at its next start."""

from __future__ import annotations

import sys
import tempfile
import unittest
from pathlib import Path
from typing import Optional

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse
from room_robot import Robot, pose_message, room
from room_with_pane import LidarAndPane, room_with_a_pane
from rostest_support import Heard, LogLines, Process, wait_until
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from glass_nav.ros import conversions
from glass_nav.vocabulary import UNMAPPED_GLASS
from glass_nav.world import panes_file

NODE = "/under_test"
ROUND_S = 90.0  # for a circle through the room, on a busy machine


class LocalizationPanes(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.grid_map = room()
        cls.lines = LogLines()
        cls.initialpose = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=1)
        map_msg = conversions.msg_from_map(cls.grid_map, rospy.Time.now(), "map")
        rospy.Service("static_map", GetMap, lambda _: GetMapResponse(map_msg))
        cls.robot = Robot(cls.grid_map, LidarAndPane())
        cls.markers = Heard(f"{NODE}/wall_markers", MarkerArray)
        cls.glass = Heard(f"{NODE}/glass_map", OccupancyGrid)
        cls.surfaces = Heard("scan_surfaces", LaserScan)
        cls.diagnostics = Heard("/diagnostics", DiagnosticArray)

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = Path(folder.name) / "panes.yaml"
        self.node: Optional[Process] = None

    def tearDown(self) -> None:
        if self.node is not None:
            self.node.end()

    def start(self) -> None:
        for heard in (self.markers, self.glass, self.surfaces, self.diagnostics):
            heard.clear()
        here = self.robot.map_from_base()
        self.node = Process(
            "localization_node",
            "__name:=under_test",
            f"_panes_file:={self.file}",
            "_glass_map_period_s:=0.5",
            *(f"_initial_pose_{name}:={value}" for name, value in zip("xya", here)),
        )
        self.assertTrue(wait_until(self.initialpose.get_num_connections, 30.0), "the node does not come up")
        self.initialpose.publish(pose_message(self.robot.map_from_base()))

    def end(self) -> None:
        assert self.node is not None
        code, printed = self.node.end()
        self.node = None
        self.assertEqual(code, 0, printed)

    def line_is_drawn(self) -> bool:
        return bool(self.markers.last) and any(
            marker.ns == UNMAPPED_GLASS and len(marker.points) >= 2 for marker in self.markers.last.markers
        )

    def pane_cells(self) -> int:
        """Cells of the pane that the glass map knows, and the map does not."""
        if self.glass.last is None:
            return 0
        glass = np.array(self.glass.last.data).reshape(self.grid_map.occupancy.shape)
        return int(((glass >= 50) & room_with_a_pane().occupied & ~self.grid_map.occupied).sum())

    def test_a_pane_is_found_reported_kept_and_known_at_the_next_start(self) -> None:
        self.start()
        self.assertTrue(wait_until(self.line_is_drawn, ROUND_S), f"no pane within {ROUND_S:g} s")
        self.assertTrue(wait_until(lambda: self.pane_cells() > 10, 20.0), "the pane is not in ~glass_map")
        self.assertTrue(wait_until(lambda: self.lines.having("the map lacks", "m of glass"), 20.0), "no line says it")
        self.assertTrue(wait_until(self.diagnostics_say_it, 20.0), "no entry of /diagnostics says it")
        answer = rospy.ServiceProxy(f"{NODE}/save_panes", Trigger)()
        self.assertTrue(answer.success, answer.message)
        self.assertIn(str(self.file), answer.message)
        kept = panes_file.load(self.file, self.grid_map)
        self.assertGreaterEqual(len(kept.panes), 1)
        self.assertIn("glass_cell", kept.arrays)
        self.end()

        self.start()
        self.assertTrue(wait_until(lambda: self.lines.having("panes that the map lacks", str(self.file)), 20.0))
        self.assertTrue(wait_until(self.line_is_drawn, 30.0), "the pane is forgotten")
        self.assertTrue(wait_until(self.beams_are_cut, 30.0), "scan_surfaces does not end at the pane")
        self.end()

    def diagnostics_say_it(self) -> bool:
        return any(
            "the map lacks" in status.message and "~save_panes" in status.message
            for msg in self.diagnostics.all
            for status in msg.status
        )

    def beams_are_cut(self) -> bool:
        return any(np.count_nonzero(np.array(msg.intensities) == 1.0) > 10 for msg in self.surfaces.all)


if __name__ == "__main__":
    rospy.init_node("localization_panes")
    rostest.rosrun("glass_nav", "localization_panes", LocalizationPanes)
