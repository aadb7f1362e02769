#!/usr/bin/env python3
"""scanner_node on a simulated serial port: bearings come out, and a device that fails ends it."""

from __future__ import annotations

import signal
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.append(str(Path(__file__).resolve().parents[1] / "support"))

import numpy as np
import rospy
import rostest
from made_emitter import TAGS_DEG, SerialDevice
from rostest_support import Heard, Process, wait_until

from glass_nav.msg import LandmarkBearings


class Scanner(unittest.TestCase):
    def test_tags_that_answer_become_bearings_until_the_device_fails(self) -> None:
        bearings = Heard("/landmark_bearings", LandmarkBearings)
        with SerialDevice() as device:
            node = Process("scanner_node", f"_port:={device.port}", "_tag_count:=4", "_move_timeout_s:=5.0")
            self.assertTrue(wait_until(lambda: len(bearings) >= 2, 60.0))
            msg = bearings.last
            self.assertEqual((sorted(msg.ids), msg.header.frame_id), (sorted(TAGS_DEG), "emitter"))
            for tag, angle in zip(msg.ids, msg.angles):
                self.assertLess(abs(np.degrees(angle) - TAGS_DEG[tag]), 0.51)
            device.answer = lambda line: "?\n"
            code, printed = node.wait(30.0)
        self.assertEqual(code, 3)
        self.assertIn(f"{device.port}: expected 'I ID' or 'A ANGLE', got '?'", printed)

    def test_a_port_that_is_not_there_ends_the_node(self) -> None:
        code, printed = Process("scanner_node", "_port:=/dev/nothing_here", "__name:=nowhere").end(signal.SIGCONT, 30.0)
        self.assertEqual(code, 3)
        self.assertIn("/dev/nothing_here: cannot be opened: No such file or directory", printed)


if __name__ == "__main__":
    rospy.init_node("scanner_node_rostest", anonymous=True)
    rostest.rosrun("glass_nav", "scanner_node", Scanner)
