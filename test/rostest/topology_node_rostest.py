#!/usr/bin/env python3
"""The running topology node: a search by action and by hand, preempt, restart, other atlases, bad input.

This file plays the driver: a simulated robot that lives in the atlas and drives as turn_choice says.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any, List, Optional

sys.path.insert(0, str(Path(__file__).resolve().parent))

import actionlib
import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from rostest_support import REPO, Heard, LogLines, Process, wait_until
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.geometry import angles
from glass_nav.msg import (
    EdgeTraversal,
    LocalizeGloballyAction,
    LocalizeGloballyGoal,
    Meetpoint,
    TopologyCandidates,
    TopologyStatus,
    TurnChoice,
)
from glass_nav.ros import conversions
from glass_nav.topology import observations
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas, Darts, Edges, MapReference, Nodes, Ragged, Visits, rings_clockwise
from glass_nav.topology.search.atlas_robot import AtlasRobot, Surroundings, TrialParams
from glass_nav.topology.search.matching import poses_at
from glass_nav.world import map_file

NODE = "/glass_topology"
STAMP_NS = 1_700_000_000_000_000_000


def meetpoint_msg(seen: observations.Meetpoint, stamp_ns: int) -> Meetpoint:
    return Meetpoint(
        header=conversions.header(stamp_ns, "base_link"),
        degree=seen.degree,
        r=seen.r_m,
        bearings=seen.bearings_rad.tolist(),
    )


def traversal_msg(seen: observations.Traversal, stamp_ns: int) -> EdgeTraversal:
    return EdgeTraversal(
        header=conversions.header(stamp_ns, "base_link"),
        rank=seen.rank,
        length=seen.length_m,
        chord=seen.chord_m,
        has_directions=True,
        chord_bearing=seen.chord_bearing_rad,
        turn=seen.turn_rad,
    )


def twofold() -> Atlas:
    """A corridor with a side corridor to the left near either end, seen from the middle: half a turn is no change."""
    position = np.array([[0.0, 0.0], [10.0, 0.0], [-5.0, 0.0], [15.0, 0.0], [0.0, 4.0], [10.0, -4.0]])
    ends = np.array([[0, 1], [2, 0], [1, 3], [0, 4], [1, 5]])
    step = position[ends[:, 1]] - position[ends[:, 0]]
    length = np.hypot(*step.T)
    out = np.arctan2(step[:, 1], step[:, 0])
    bearing, node = np.stack([out, out + np.pi], axis=1).ravel(), ends.ravel()
    kind = np.array([0, 0, 1, 1, 1, 1], np.int8)
    return Atlas(
        "twofold",
        MapReference("none", ""),
        Nodes(position, np.array([1.3, 1.3, 0.8, 0.8, 0.6, 0.6]), np.full(6, 0.02), kind),
        Edges(length, length, np.full(5, 0.02), np.full(5, 0.5), Ragged.empty(5, 2)),
        Darts(node, bearing, Ragged.empty(10, 4)),
        rings_clockwise(node, bearing, 6),
        Visits.none(6, 5),
    )


class TopologyNode(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = Path(tempfile.mkdtemp())
        cls.lines = LogLines()
        cls.turns = Heard("turn_choice", TurnChoice)
        cls.poses = Heard("initialpose", PoseWithCovarianceStamped)
        cls.status = Heard(f"{NODE}/status", TopologyStatus)
        cls.candidates = Heard(f"{NODE}/candidates", TopologyCandidates)
        cls.markers = Heard(f"{NODE}/markers", MarkerArray)
        cls.meetpoints = rospy.Publisher("meetpoint", Meetpoint, queue_size=5)
        cls.traversals = rospy.Publisher("edge_traversal", EdgeTraversal, queue_size=5)
        cls.maps = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        cls.client = actionlib.SimpleActionClient("localize_globally", LocalizeGloballyAction)
        assert cls.client.wait_for_server(rospy.Duration(30))
        assert wait_until(lambda: all(p.get_num_connections() for p in (cls.meetpoints, cls.traversals, cls.maps)), 20)
        assert wait_until(
            lambda: all(
                heard._subscriber.get_num_connections()
                for heard in (cls.turns, cls.poses, cls.status, cls.candidates, cls.markers)
            ),
            20,
        )
        assert wait_until(lambda: cls.lines.having("4 nodes, 4 edges") or cls.status.last, 20)

    def setUp(self) -> None:
        self.stamp_ns = STAMP_NS
        self.client.cancel_all_goals()
        self.use_atlas("document_example")
        for heard in (self.turns, self.poses, self.lines):
            heard.clear()

    # -- the driver

    def use_atlas(self, name: str) -> Any:
        rospy.set_param(f"{NODE}/atlas", name)
        answer = rospy.ServiceProxy(f"{NODE}/reload_atlas", Trigger)()
        if answer.success:
            self.await_state("WAITING")
        return answer

    def await_state(self, name: str, timeout_s: float = 30.0) -> TopologyStatus:
        found = wait_until(lambda: self.status.last is not None and self.status.last.state_name == name, timeout_s)
        self.assertTrue(found, f"no {name}, but {self.status.last}")
        self.assertEqual(self.status.last.state, getattr(TopologyStatus, name))
        return self.status.last

    def report(self, meetpoint: observations.Meetpoint, traversal: Optional[observations.Traversal] = None) -> bool:
        """Send what the robot saw; whether a turn was the answer."""
        told, self.stamp_ns = len(self.turns), self.stamp_ns + 1_000_000_000
        before = self.status.last
        self.meetpoints.publish(meetpoint_msg(meetpoint, self.stamp_ns))  # the meetpoint first: either order will do
        if traversal is not None:
            self.traversals.publish(traversal_msg(traversal, self.stamp_ns))
        answered = wait_until(
            lambda: self.status.last is not before
            and conversions.ns_from_stamp(self.status.last.header.stamp) == self.stamp_ns,
            10.0,
        )
        self.assertTrue(answered, f"no status for the meetpoint, the last is {self.status.last}")
        if not self.status.last.turn:
            return False
        self.assertTrue(wait_until(lambda: len(self.turns) > told, 30.0), "no turn_choice")
        self.assertEqual(conversions.ns_from_stamp(self.turns.last.header.stamp), self.stamp_ns)
        return True

    def robot_in(self, atlas: Atlas) -> AtlasRobot:
        return AtlasRobot(Surroundings.of(atlas), TrialParams(), np.random.default_rng(5))

    def search(self, robot: AtlasRobot, dart: int) -> None:
        """Drive as told until there is nothing more to find out."""
        driving = self.report(robot.wake_up(dart))
        for _ in range(20):
            if not driving:
                return
            traversal, meetpoint = robot.drive(self.turns.last.rank)
            driving = self.report(meetpoint, traversal)
        self.fail(f"still searching: {self.status.last}")

    def namespaces(self) -> "List[str]":
        """Of the markers that are shown."""
        return sorted(marker.ns for marker in self.markers.last.markers if marker.action == Marker.ADD)

    # -- searches

    def test_an_action_ends_with_the_pose_of_the_robot(self) -> None:
        feedback: List[Any] = []
        self.client.send_goal(LocalizeGloballyGoal(), feedback_cb=feedback.append)
        self.await_state("WAITING")
        self.assertTrue(wait_until(lambda: "action" in self.status.last.reason, 30.0))
        atlas = atlas_file.load(shipped_atlases.find("document_example"))
        robot = self.robot_in(atlas)
        self.search(robot, dart=0)
        self.assertTrue(self.client.wait_for_result(rospy.Duration(30)))
        self.assertEqual(self.client.get_state(), GoalStatus.SUCCEEDED, self.client.get_goal_status_text())
        result = self.client.get_result()
        truth = poses_at(atlas, np.array([robot.dart]), observations.Meetpoint(1, 1.0))[0]
        self.assertTrue(wait_until(lambda: self.poses.last, 30.0), "no initialpose")
        for msg in (self.poses.last, result.pose):
            self.assertEqual(msg.header.frame_id, "map")
            self.assertEqual(conversions.ns_from_stamp(msg.header.stamp), self.stamp_ns)
            pose = conversions.planar_from_pose(msg.pose.pose)
            self.assertLess(np.hypot(*(pose - truth)[:2]), 1e-6)
            self.assertLess(abs(angles.wrap(pose[2] - truth[2])), 1e-6)
            self.assertAlmostEqual(msg.pose.covariance[0], 0.25**2)
        self.assertEqual(result.status.state_name, "CONFIRMED")
        self.assertEqual((result.candidates.total, list(result.candidates.nodes)), (1, [atlas.darts.node[robot.dart]]))
        self.assertGreaterEqual(len(feedback), 2)
        self.assertEqual([each.status.depth for each in feedback], list(range(len(feedback))))
        self.assertTrue(wait_until(lambda: "confirmed" in self.namespaces(), 30.0), self.namespaces())
        self.assertLessEqual({"atlas", "nodes", "forest", "text"}, set(self.namespaces()))
        self.assertFalse({"searching", "tentative", "ambiguous"} & set(self.namespaces()))

    def test_it_can_be_used_by_hand(self) -> None:
        def by_hand(topic: str, kind: str, values: str) -> None:
            subprocess.run(
                ["rostopic", "pub", "-1", topic, f"glass_nav/{kind}", values],
                check=True,
                timeout=60,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )

        by_hand("/meetpoint", "Meetpoint", "{degree: 3, r: 1.5}")
        self.assertEqual(self.await_state("SEARCHING").candidates, 6)
        by_hand("/edge_traversal", "EdgeTraversal", "{rank: -1, length: 8.05, chord: 8.0}")
        by_hand("/meetpoint", "Meetpoint", "{degree: 3, r: 1.5}")
        self.assertTrue(wait_until(lambda: self.status.last.depth == 1, 30.0))
        self.assertEqual(self.status.last.candidates, 2)
        self.assertEqual(sorted(self.candidates.last.nodes), [0, 1])
        by_hand("/edge_traversal", "EdgeTraversal", "{rank: 2, length: 11.2, chord: 8.0}")  # to the right
        by_hand("/meetpoint", "Meetpoint", "{degree: 3, r: 1.5}")
        status = self.await_state("TENTATIVE")
        self.assertEqual((status.depth, status.candidates), (2, 1))
        self.assertEqual((list(self.candidates.last.nodes), list(self.candidates.last.edges)), ([0], [1]))

    def test_a_symmetric_floor_is_ambiguous_and_all_its_places_are_listed(self) -> None:
        atlas = twofold()
        path = self.folder / "twofold.json"
        atlas_file.save(atlas, path)
        self.assertTrue(self.use_atlas(str(path)).success)
        self.client.send_goal(LocalizeGloballyGoal())
        self.assertTrue(wait_until(lambda: "action" in self.status.last.reason, 30.0))
        robot = self.robot_in(atlas)
        self.search(robot, dart=0)
        self.await_state("AMBIGUOUS")
        self.assertTrue(self.client.wait_for_result(rospy.Duration(30)))
        self.assertEqual(self.client.get_state(), GoalStatus.ABORTED)
        listed = self.client.get_result().candidates
        self.assertEqual(listed.total, 2)
        self.assertIn(atlas.darts.node[robot.dart], listed.nodes)
        places = np.array([conversions.planar_from_pose(pose)[:2] for pose in listed.poses])
        np.testing.assert_allclose(places.mean(axis=0), [5.0, 0.0], atol=1e-6)  # opposite of each other
        self.assertFalse(len(self.poses))

    def test_a_robot_elsewhere_is_lost_and_the_action_says_so(self) -> None:
        self.client.send_goal(LocalizeGloballyGoal())
        self.assertTrue(wait_until(lambda: "action" in self.status.last.reason, 30.0))
        self.report(observations.Meetpoint(5, 3.0))
        for _ in range(5):
            if self.status.last.state_name == "LOST":
                break
            self.report(observations.Meetpoint(5, 3.0), observations.Traversal(self.turns.last.rank, 30.0, 30.0))
        self.await_state("LOST")
        self.assertTrue(self.client.wait_for_result(rospy.Duration(30)))
        self.assertEqual(self.client.get_state(), GoalStatus.ABORTED)
        self.assertEqual(self.client.get_result().status.state_name, "LOST")
        self.assertEqual(self.client.get_goal_status_text(), self.status.last.reason)

    def test_a_cancelled_search_is_over(self) -> None:
        self.client.send_goal(LocalizeGloballyGoal())
        self.assertTrue(wait_until(lambda: "action" in self.status.last.reason, 30.0))
        self.report(observations.Meetpoint(3, 1.5))
        self.client.cancel_goal()
        self.assertTrue(self.client.wait_for_result(rospy.Duration(30)))
        self.assertEqual(self.client.get_state(), GoalStatus.PREEMPTED)
        self.await_state("IDLE")
        told = len(self.turns)
        self.meetpoints.publish(Meetpoint(degree=3, r=1.5))
        self.assertTrue(wait_until(lambda: self.lines.having("meetpoint not used", "IDLE"), 30.0))
        self.assertEqual(len(self.turns), told)

    def test_a_new_goal_takes_over_and_may_begin_at_the_last_meetpoint(self) -> None:
        self.client.send_goal(LocalizeGloballyGoal())
        self.assertTrue(wait_until(lambda: "action" in self.status.last.reason, 30.0))
        self.report(observations.Meetpoint(3, 1.5))
        other = actionlib.SimpleActionClient("localize_globally", LocalizeGloballyAction)
        self.assertTrue(other.wait_for_server(rospy.Duration(30)))
        told = len(self.turns)
        other.send_goal(LocalizeGloballyGoal(here=True, max_edges=1))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(30)))
        self.assertEqual(self.client.get_state(), GoalStatus.PREEMPTED)
        self.assertTrue(wait_until(lambda: len(self.turns) > told, 30.0), "the search did not begin")
        self.assertEqual(self.status.last.depth, 0)
        self.report(observations.Meetpoint(3, 1.5), observations.Traversal(self.turns.last.rank, 8.0, 8.0))
        self.assertTrue(other.wait_for_result(rospy.Duration(30)))
        self.assertEqual(other.get_state(), GoalStatus.ABORTED)
        self.assertIn("not found after 1 edges", other.get_goal_status_text())

    def test_restart_forgets_the_search(self) -> None:
        self.report(observations.Meetpoint(3, 1.5))
        self.assertTrue(rospy.ServiceProxy(f"{NODE}/restart", Trigger)().success)
        self.assertEqual(self.await_state("WAITING").candidates, 0)
        self.report(observations.Meetpoint(1, 0.8))
        self.assertEqual((self.status.last.depth, self.status.last.candidates), (0, 2))

    # -- bad input

    def test_a_turn_that_no_dart_has_is_refused_and_the_search_goes_on(self) -> None:
        self.report(observations.Meetpoint(3, 1.5))
        self.meetpoints.publish(Meetpoint(degree=3, r=1.5))
        self.traversals.publish(EdgeTraversal(rank=3, length=8.0, chord=8.0))
        line = "edge_traversal refused: turn of rank 3: the meetpoint it left has degree 3, allowed 0 to 2"
        self.assertTrue(wait_until(lambda: self.lines.having(line), 30.0))
        self.assertEqual(self.status.last.depth, 0)
        self.traversals.publish(EdgeTraversal(rank=1, length=8.0, chord=8.0))
        self.assertTrue(wait_until(lambda: self.status.last.depth == 1, 30.0))

    def test_reports_that_cannot_be_true_are_refused_in_one_line(self) -> None:
        self.report(observations.Meetpoint(3, 1.5))
        for msg, line in [
            (Meetpoint(degree=0, r=1.0), "meetpoint refused: meetpoint: degree must be >= 1, got 0"),
            (Meetpoint(degree=3, r=float("nan")), "meetpoint refused: meetpoint: r must be finite and > 0 m"),
            (Meetpoint(degree=3, r=1.0, bearings=[0.0, 1.0]), "3 edges need 3 bearings or none, got 2"),
            (EdgeTraversal(rank=1, length=-1.0), "length must be finite and > 0 m, or NaN, got -1.0"),
            (EdgeTraversal(rank=1, length=1.0, segments=[1.0, 2.0]), "segments need 4 numbers each, got 2"),
        ]:
            (self.meetpoints if isinstance(msg, Meetpoint) else self.traversals).publish(msg)
            self.assertTrue(wait_until(lambda line=line: self.lines.having(line), 30.0), line)
        self.assertEqual(self.status.last.depth, 0)

    def test_reports_far_apart_do_not_belong_together(self) -> None:
        self.report(observations.Meetpoint(3, 1.5))
        self.traversals.publish(traversal_msg(observations.Traversal(1, 8.0, 8.0), STAMP_NS))
        self.meetpoints.publish(meetpoint_msg(observations.Meetpoint(3, 1.5), STAMP_NS + 60 * 10**9))
        self.assertTrue(wait_until(lambda: self.lines.having("a traversal is dropped", "60.000 s apart"), 30.0))
        self.assertEqual(self.status.last.depth, 0)

    def test_an_atlas_that_cannot_be_used_leaves_the_old_one(self) -> None:
        path = self.folder / "broken.json"
        text = shipped_atlases.find("document_example").read_text()
        path.write_text(text.replace('"darts": [5]', '"darts": [4]'))
        answer = self.use_atlas(str(path))
        self.assertFalse(answer.success)
        self.assertIn(f"{path}: node 0: dart 4 is listed 2 times", answer.message)
        rospy.set_param(f"{NODE}/atlas", "document_example")
        self.report(observations.Meetpoint(3, 1.5))
        self.assertEqual(self.status.last.candidates, 6)

    def test_an_atlas_of_another_map_is_refused_until_its_map_comes(self) -> None:
        right, wrong = (map_file.load(REPO / "maps" / name / "map.yaml") for name in ("glass_office", "glass_atrium"))
        self.assertTrue(self.use_atlas("glass_office").success)
        self.maps.publish(conversions.msg_from_map(wrong, rospy.Time.now(), "map"))
        status = self.await_state("NO_ATLAS", 20.0)
        self.assertIn("was made from another map than that of topic /map", status.reason)
        self.maps.publish(conversions.msg_from_map(right, rospy.Time.now(), "map"))
        self.await_state("WAITING", 20.0)

    def check_end(self, code: int, line: str, *arguments: str) -> None:
        ended, printed = Process("topology_node", f"__name:=topology_{self._testMethodName}", *arguments).wait(30.0)
        self.assertEqual(ended, code, printed)
        self.assertIn(line, printed)
        self.assertNotIn("Traceback", printed)

    def test_where_it_is_told_to_end_without_an_atlas_another_map_ends_it(self) -> None:
        wrong = map_file.load(REPO / "maps" / "glass_atrium" / "map.yaml")
        self.maps.publish(conversions.msg_from_map(wrong, rospy.Time.now(), "map"))
        self.check_end(
            3, "was made from another map than that of topic /map", "_atlas:=glass_office", "_end_without_atlas:=true"
        )

    def test_without_an_atlas_it_does_not_start(self) -> None:
        self.check_end(2, "~atlas must be a file, a folder or the name of a shipped atlas, got ''")

    def test_an_unknown_atlas_ends_it(self) -> None:
        self.check_end(3, "did you mean document_example?", "_atlas:=document_exampel")

    def test_an_unknown_parameter_ends_it(self) -> None:
        self.check_end(
            2,
            "unknown parameter ~confirm_edge; did you mean ~confirm_edges?",
            "_atlas:=document_example",
            "_confirm_edge:=1",
        )

    def test_terminated_it_ends_at_once(self) -> None:
        status = Heard("/topology_ending/status", TopologyStatus)
        node = Process(
            "topology_node", "__name:=topology_ending", "_atlas:=document_example", "_search_at_start:=false"
        )
        started = wait_until(lambda: status.last, 30.0)
        code, printed = node.end(signal.SIGTERM)
        self.assertTrue(started, printed)
        self.assertEqual((code, status.last.state_name), (0, "IDLE"), printed)


if __name__ == "__main__":
    rospy.init_node("topology_node_rostest")
    rostest.rosrun("glass_nav", "topology_node", TopologyNode)
