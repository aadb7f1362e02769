#!/usr/bin/env python3
"""The running node's scan_surfaces, glass map, markers and legend, in a room with a clear pane across it.

The lidar of the test sees the pane head on, as real ones do, and what is behind it everywhere else.
"""

from __future__ import annotations

import math
import sys
import unittest
from pathlib import Path
from typing import Any, List

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.append(str(Path(__file__).resolve().parents[1] / "support"))

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from impatient_client import ImpatientClient
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse
from room_robot import BEAMS, Robot, changed, pose_message
from room_with_pane import PANE_COLUMN, LidarAndPane, room_with_a_pane
from rostest_support import Heard, LogLines, busy_threads, process_of, wait_until
from sensor_msgs.msg import Image, LaserScan
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from glass_nav.geometry import angles, se2
from glass_nav.localization.place_shapes import PLACES_NAMESPACE
from glass_nav.localization.status_text import STATUS_NAMESPACE
from glass_nav.msg import LocalizationStatus, SegmentQuality
from glass_nav.ros import conversions
from glass_nav.srv import Locate
from glass_nav.vocabulary import UNMAPPED_GLASS, BeamCase, WallKind

NODE = "/glass_localization"
MOUNTING = np.array([0.2, 0.0, 0.3])  # of the robot's lidar
PERIOD_S = 0.5  # ~glass_map_period_s
TOLERANCE_NS = 100_000_000  # ~transform_tolerance


def stamp_of(msg: TFMessage) -> int:
    """Of map -> odom [ns]; 0: another transform."""
    (transform,) = msg.transforms
    return transform.header.stamp.to_nsec() if transform.header.frame_id == "map" else 0


class LocalizationOutputs(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.grid_map = room_with_a_pane()
        cls.lines = LogLines()
        cls.scans = Heard("scan", LaserScan)
        cls.surfaces = Heard("scan_surfaces", LaserScan)
        cls.status = Heard(f"{NODE}/status", LocalizationStatus)
        cls.initialpose = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=1)
        cls.map_msg = conversions.msg_from_map(cls.grid_map, rospy.Time.now(), "map")
        rospy.Service("static_map", GetMap, lambda _: GetMapResponse(cls.map_msg))
        cls.lidar = LidarAndPane()
        cls.robot = Robot(cls.grid_map, cls.lidar)
        for service in ("global_localization", "request_nomotion_update"):
            rospy.wait_for_service(service, timeout=20.0)
        cls.update = rospy.ServiceProxy("request_nomotion_update", Empty)

    def setUp(self) -> None:
        self.robot.reset()
        self.robot.moving = False
        self.assertTrue(wait_until(self.initialpose.get_num_connections, 30.0), "nobody listens to initialpose")
        self.assertTrue(wait_until(lambda: len(self.surfaces), 30.0), "no scan_surfaces within 30 s")
        self.localize()

    def localize(self) -> None:
        """Tell the node where the robot stands, and let it look until it is sure."""

        def sure() -> bool:
            self.update()
            return self.status.last is not None and self.status.last.state == LocalizationStatus.LOCALIZED

        self.initialpose.publish(pose_message(self.robot.map_from_base()))
        self.robot.make_steps(3)
        self.status.clear()
        self.assertTrue(wait_until(sure, 30.0), f"not localized within 30 s: {self.status.last}")

    def newest(self) -> "tuple[LaserScan, LaserScan]":
        """The next message of scan_surfaces, and the scan with its stamp."""
        self.robot.make_steps(2)  # what is under way
        self.surfaces.clear()
        self.assertTrue(wait_until(lambda: len(self.surfaces), 30.0), "no scan_surfaces within 30 s")
        out = self.surfaces.last
        self.assertTrue(wait_until(lambda: self.sent(out.header.stamp), 30.0), "no scan has the stamp of scan_surfaces")
        return out, self.sent(out.header.stamp)[0]

    def sent(self, stamp: rospy.Time) -> List[LaserScan]:
        return [msg for msg in self.scans.all if msg.header.stamp == stamp]

    def map_from_laser(self) -> np.ndarray:
        return se2.compose(self.robot.map_from_base(), MOUNTING)[None]

    def check_cut_at_the_pane(self, out: LaserScan, scan: LaserScan, bearings: np.ndarray) -> None:
        measured, pane = (
            caster.cast(self.map_from_laser(), bearings, 20.0)[0] for caster in (self.lidar, self.lidar.with_pane)
        )
        passed = measured > pane + 0.5
        ranges, cut = np.array(out.ranges), np.array(out.intensities) == 1.0
        self.assertGreater(passed.sum(), 30)
        self.assertGreater(np.mean(cut[passed]), 0.9, f"{self.status.last.state_name}: {self.status.last.reason}")
        self.assertEqual(np.count_nonzero(cut[measured == pane]), 0)
        across = np.abs(ranges - pane) * np.cos(self.lidar.incidence(self.map_from_laser(), bearings)[0])
        self.assertLess(across[cut].max(), 0.15)
        self.assertTrue(np.array_equal(ranges[~cut], np.array(scan.ranges)[~cut]))
        self.assertEqual(set(out.intensities), {0.0, 1.0})

    # -- scan_surfaces

    def test_beams_through_the_pane_are_cut_there(self) -> None:
        out, scan = self.newest()
        self.check_cut_at_the_pane(out, scan, BEAMS)
        self.assertEqual(out.header.frame_id, "laser")
        self.assertEqual(len(out.ranges), len(scan.ranges))
        for name in ("angle_min", "angle_max", "angle_increment", "range_min", "range_max"):
            self.assertEqual(getattr(out, name), getattr(scan, name))

    def test_a_lidar_that_hangs_upside_down_keeps_the_order_of_its_beams(self) -> None:
        self.robot.lidar.silent = True
        self.robot.make_steps(2)
        self.robot.lidar.upside_down = True
        self.robot.make_steps(2)  # no interpolation between the two mountings
        self.robot.lidar.silent = False
        self.localize()
        out, scan = self.newest()
        self.check_cut_at_the_pane(out, scan, -BEAMS)
        self.robot.lidar.silent = True
        self.robot.make_steps(2)
        self.robot.lidar.upside_down = False
        self.robot.make_steps(2)

    def test_while_the_pose_is_not_trusted_the_scan_is_raw_and_flagged(self) -> None:
        self.surfaces.clear()
        rospy.ServiceProxy("global_localization", Empty)()
        self.assertTrue(
            wait_until(lambda: any(msg.intensities[0] == -1.0 for msg in self.surfaces.all), 30.0),
            f"no raw scan while searching; state {self.status.last.state_name}",
        )
        out = [msg for msg in self.surfaces.all if msg.intensities[0] == -1.0][0]
        self.assertEqual(set(out.intensities), {-1.0})
        self.assertEqual(out.ranges, self.sent(out.header.stamp)[0].ranges)

    def test_one_for_each_scan_that_is_used_and_none_for_others(self) -> None:
        for fields in ({"angle_increment": 0.0}, {"header__frame_id": "nowhere"}, {"ranges": []}):
            with self.subTest(fields=fields):
                spoilt: List[rospy.Time] = []

                def spoil(msg: LaserScan, fields: Any = fields, spoilt: Any = spoilt) -> LaserScan:
                    spoilt.append(msg.header.stamp)
                    return changed(msg, **fields)

                self.robot.spoil = spoil
                self.robot.make_steps(4)
                self.robot.spoil = lambda msg: msg
                self.robot.make_steps(2)
                self.surfaces.clear()
                self.assertTrue(wait_until(lambda: len(self.surfaces) > 3, 30.0), "no scan_surfaces any more")
                stamps = [msg.header.stamp for msg in self.surfaces.all]
                self.assertEqual(len(stamps), len(set(stamps)))
                self.assertFalse(set(stamps) & set(spoilt))

    def test_beams_without_an_answer_stay_without_one_or_end_at_glass(self) -> None:
        answers = [math.nan, -math.inf, 0.0]
        self.robot.spoil = lambda msg: changed(msg, ranges=answers + list(msg.ranges[3:]))
        out, _ = self.newest()
        self.assertTrue(np.array_equal(out.ranges[:3], answers, equal_nan=True), out.ranges[:3])
        self.assertEqual(list(out.intensities[:3]), [0.0] * 3)

    # -- ~glass_map and what rviz shows

    def glass_map(self) -> OccupancyGrid:
        """As somebody gets it who comes late."""
        heard = Heard(f"{NODE}/glass_map", OccupancyGrid)
        self.assertTrue(wait_until(lambda: len(heard), 30.0), "no ~glass_map within 30 s")
        return heard.last

    def test_the_glass_map_has_the_maps_geometry_and_tells_the_pane_from_walls(self) -> None:
        for _ in range(10):
            self.update()
            self.robot.make_steps(1)
        listener = Heard(f"{NODE}/glass_map", OccupancyGrid)
        self.assertTrue(wait_until(lambda: len(listener) > 1 or (self.update() and False), 30.0), "sent only once")
        msg = self.glass_map()
        self.assertEqual(msg.header.frame_id, "map")
        self.assertAlmostEqual(msg.info.resolution, self.map_msg.info.resolution, places=6)
        self.assertEqual((msg.info.width, msg.info.height), (self.map_msg.info.width, self.map_msg.info.height))
        self.assertLess(np.abs(conversions.planar_from_pose(msg.info.origin) - self.grid_map.map_from_grid).max(), 1e-9)
        glass = np.array(msg.data).reshape(self.grid_map.occupancy.shape)
        self.assertTrue(np.all(glass[~self.grid_map.occupied] == -1))
        pane, walls = glass[30:-30, PANE_COLUMN], np.concatenate([glass[20:25].ravel(), glass[:, 20:25].ravel()])
        self.assertGreater(np.count_nonzero(pane >= 0), 10)
        self.assertLess(np.median(walls[walls >= 0]), 0.5 * np.median(pane[pane >= 0]))

    def test_the_glass_map_goes_out_no_more_often_than_asked(self) -> None:
        listener = Heard(f"{NODE}/glass_map", OccupancyGrid)
        self.assertTrue(wait_until(lambda: len(listener), 30.0), "no ~glass_map within 30 s")
        for _ in range(15):
            self.update()
            self.robot.make_steps(1)
        stamps = [msg.header.stamp.to_sec() for msg in listener.all[1:]]  # the first is the latched one
        self.assertGreater(len(stamps), 1)
        self.assertGreater(np.diff(stamps).min(), PERIOD_S - 0.2)  # a scan is up to 0.1 s old

    def test_the_glass_map_comes_without_a_scan_too(self) -> None:
        self.robot.lidar.silent = True
        self.robot.make_steps(3)
        self.glass_map()

    def test_each_case_has_its_namespace_and_the_status_too(self) -> None:
        markers = Heard(f"{NODE}/beam_markers", MarkerArray)
        self.assertTrue(wait_until(lambda: len(markers), 30.0), "no ~beam_markers within 30 s")
        self.assertTrue(
            wait_until(lambda: self.sent(markers.last.markers[0].header.stamp), 30.0),
            "no scan has the stamp of the markers",
        )
        names = {marker.ns for marker in markers.last.markers}
        self.assertEqual(names, {*(case.label for case in BeamCase), PLACES_NAMESPACE, STATUS_NAMESPACE})
        (status,) = [marker for marker in markers.last.markers if marker.ns == STATUS_NAMESPACE]
        self.assertTrue(status.text.startswith("LOCALIZED"), status.text)
        self.assertEqual(status.header.frame_id, "map")
        through = [marker for marker in markers.last.markers if marker.ns == "3 behind one pane"]
        self.assertGreater(max(len(marker.points) for marker in through), 30)

    def test_the_walls_are_shown_by_what_they_are(self) -> None:
        markers = Heard(f"{NODE}/wall_markers", MarkerArray)
        self.assertTrue(wait_until(lambda: len(markers), 30.0), "no ~wall_markers within 30 s")
        self.assertEqual([marker.ns for marker in markers.last.markers], [*map(str, WallKind), UNMAPPED_GLASS])

    def test_silence_is_told_beside_the_robot(self) -> None:
        markers = Heard(f"{NODE}/beam_markers", MarkerArray)
        self.robot.lidar.silent = True
        self.assertTrue(
            wait_until(
                lambda: markers.last and "no scan on /scan" in " ".join(markers.last.markers[-1].text.split("\n")), 10.0
            ),
            "nothing said in ~beam_markers within 10 s",
        )

    def test_the_legend_waits_for_the_first_subscriber(self) -> None:
        for _ in range(2):
            legend = Heard(f"{NODE}/legend", Image)
            self.assertTrue(wait_until(lambda legend=legend: len(legend), 30.0), "no ~legend within 30 s")
            self.assertEqual((legend.last.encoding, legend.last.step), ("rgb8", 3 * legend.last.width))
            self.assertEqual(len(legend.last.data), legend.last.height * legend.last.step)

    # -- the process

    def test_one_thread_of_the_node_uses_the_cpu(self) -> None:
        """OpenBLAS keeps its threads to itself."""
        for _ in range(10):
            self.update()
            self.robot.make_steps(1)
        self.assertEqual(busy_threads(process_of(NODE)), 1)

    # -- tf

    def test_tf_goes_out_when_a_scan_comes_and_the_correction_follows(self) -> None:
        """The last correction, stamped ~transform_tolerance or more ahead of the scan, before the status of the scan."""
        came: List[Any] = []  # (kind, stamp [ns]) in the order in which the node sent them, 20 ms and more apart
        tf = rospy.Subscriber("/tf", TFMessage, lambda msg: came.append(("tf", stamp_of(msg))))
        status = rospy.Subscriber(
            f"{NODE}/status", LocalizationStatus, lambda msg: came.append(("status", msg.header.stamp.to_nsec()))
        )
        self.robot.make_steps(12)
        tf.unregister()
        status.unregister()
        began = next(number for number, (kind, stamp) in enumerate(came) if kind == "tf" and stamp)
        came = came[began:]  # both subscribers hear
        scans = [stamp for kind, stamp in came if kind == "status"][1:]
        self.assertGreater(len(scans), 5)
        before = [
            any(kind == "tf" and sent >= stamp + TOLERANCE_NS for kind, sent in came[: came.index(("status", stamp))])
            for stamp in scans
        ]
        self.assertGreater(np.mean(before), 0.7, came)
        sent = [stamp for kind, stamp in came if kind == "tf" and stamp]
        seconds = {stamp * 1e-9 for stamp in sent}
        self.assertEqual(len(sent), len(seconds), "a stamp was sent twice, as listeners in Python read it")

    def test_who_asks_for_the_present_and_does_not_wait_is_answered(self) -> None:
        """As move_base asks, at 5 Hz; with tf only after each correction about every second ask would be in vain."""
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)
        client = ImpatientClient(buffer)
        self.assertTrue(wait_until(lambda: client.asked >= 12, 30.0), "tf has no map -> odom")
        client.end()
        listener.unregister()
        self.assertLess(client.unanswered, client.asked / 3, f"of {client.asked}")

    # -- ~locate and ~segment_quality

    def rough_pose(self, off: "list[float]", frame: str = "map") -> PoseStamped:
        pose = conversions.pose_from_planar(self.robot.map_from_base() + off)
        return PoseStamped(conversions.header(0, frame), pose)

    def test_a_rough_pose_is_corrected_by_the_last_scan_or_by_one_that_is_given(self) -> None:
        locate = rospy.ServiceProxy(f"{NODE}/locate", Locate)
        for scan in (LaserScan(), self.scans.last):
            answer = locate(scan, self.rough_pose([0.2, -0.1, 0.05]))
            self.assertTrue(answer.success, answer.message)
            self.assertTrue(answer.message.startswith("free: none"), answer.message)
            left = conversions.planar_from_pose(answer.pose.pose) - self.robot.map_from_base()
            self.assertLess(np.hypot(left[0], left[1]), 0.05)
            self.assertLess(abs(angles.wrap(left[2])), 0.01)
            self.assertGreater(answer.after.combined, answer.before.combined)
            self.assertTrue(math.isnan(answer.free_heading))
        far = locate(LaserScan(), self.rough_pose([50.0, 0.0, 0.0]))
        self.assertFalse(far.success)
        self.assertTrue(far.message.startswith("the scan fits nowhere near the pose"), far.message)
        with self.assertRaises(rospy.ServiceException) as refused:
            locate(LaserScan(), self.rough_pose([0.0, 0.0, 0.0], "odom"))
        self.assertIn("the pose must be given in frame 'map', got 'odom'", str(refused.exception))

    def test_the_quality_of_each_scan_is_sent_to_subscribers(self) -> None:
        quality = Heard(f"{NODE}/segment_quality", SegmentQuality)
        self.assertTrue(wait_until(lambda: len(quality), 30.0), "no ~segment_quality within 30 s")
        last = quality.last
        self.assertEqual(last.header.frame_id, "map")
        self.assertGreater(last.points, 50)
        self.assertGreater(last.ecf, 0.5)
        self.assertTrue(0.0 < last.combined <= last.ecf)
        self.assertLess(last.emse_inliers, 0.01)


if __name__ == "__main__":
    rospy.init_node("localization_outputs_rostest")
    rostest.rosrun("glass_nav", "localization_outputs", LocalizationOutputs)
