#!/usr/bin/env python3
"""The running driver: edges and places by action, preempted, refused, halted; turn_choice; move_base as its backend.

This file hands the scans on (or holds them back), says what the localization says, sends map -> odom, and plays
move_base by a server of its action.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import unittest
from pathlib import Path
from typing import Any, Callable, List, Optional

sys.path.insert(0, str(Path(__file__).resolve().parent))

import actionlib
import numpy as np
import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, KeyValue
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseResult
from nav_msgs.msg import Odometry
from rostest_support import Heard, LogLines, Process, wait_until
from sensor_msgs.msg import LaserScan
from visualization_msgs.msg import MarkerArray

from glass_nav.geometry import se2
from glass_nav.msg import (
    DriverStatus,
    EdgeTraversal,
    GotoNodeAction,
    GotoNodeGoal,
    GotoNodeResult,
    LocalizationStatus,
    Meetpoint,
    TraverseEdgeAction,
    TraverseEdgeGoal,
    TraverseEdgeResult,
    TurnChoice,
)
from glass_nav.ros import conversions
from glass_nav.topology.atlas import atlas_file, shipped_atlases

NODE = "/glass_driver"
STOPPED_S = 0.2  # a preempted action stands within it
ATLAS = atlas_file.load(shipped_atlases.find("opaque_office"))


MOVE_BASE_PROCESS = """
import actionlib, rospy
from move_base_msgs.msg import MoveBaseAction

rospy.init_node("hanging_move_base", anonymous=True, disable_signals=True)
server = actionlib.SimpleActionServer("/second/move_base", MoveBaseAction, lambda goal: rospy.sleep(1e6), False)
server.start()
rospy.spin()
"""


class MoveBasePlayer:
    """Takes a goal and ends it as it is told."""

    def __init__(self) -> None:
        self.goals: List[Any] = []
        self.outcome: Optional[str] = None
        self.cancelled = 0
        self.server = actionlib.SimpleActionServer("/second/move_base", MoveBaseAction, self._drive, auto_start=False)
        self.server.start()

    def _drive(self, goal: Any) -> None:
        self.goals.append(goal)
        while self.outcome is None and not self.server.is_preempt_requested() and not rospy.is_shutdown():
            threading.Event().wait(0.02)
        if self.server.is_preempt_requested():
            self.cancelled += 1
            self.server.set_preempted(MoveBaseResult(), "cancelled")
        elif self.outcome == "there":
            self.server.set_succeeded(MoveBaseResult(), "Goal reached.")
        else:
            self.server.set_aborted(MoveBaseResult(), "Failed to find a valid plan.")
        self.outcome = None


class Driver(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.lines = LogLines()
        cls.hands_on, cls.says, cls.sent_ns = True, "LOCALIZED", 0
        cls.scans = rospy.Publisher("handed_on", LaserScan, queue_size=5, tcp_nodelay=True)
        cls.localization = rospy.Publisher("/glass_localization/status", LocalizationStatus, queue_size=5)
        cls.turns = rospy.Publisher("turn_choice", TurnChoice, queue_size=5)
        cls.transforms = tf2_ros.TransformBroadcaster()
        cls.truth = Heard("ground_truth", PoseStamped)
        cls.status = Heard(f"{NODE}/status", DriverStatus)
        cls.meetpoints = Heard("meetpoint", Meetpoint)
        cls.traversals = Heard("edge_traversal", EdgeTraversal)
        cls.odometry = Heard("odom", Odometry)
        cls.markers = Heard(f"{NODE}/markers", MarkerArray)
        cls.diagnostics = Heard(
            "/diagnostics", DiagnosticArray, lambda msg: msg.status[0].name == "glass_driver: driver"
        )
        rospy.Subscriber("scan", LaserScan, cls.hand_on, queue_size=5, tcp_nodelay=True)
        cls.edges = actionlib.SimpleActionClient("traverse_edge", TraverseEdgeAction)
        cls.places = actionlib.SimpleActionClient("goto_node", GotoNodeAction)
        cls.second = actionlib.SimpleActionClient("/second/goto_node", GotoNodeAction)
        assert wait_until(lambda: rospy.get_time() > 0.0, 30)  # else the first /clock ends what waits in ROS time
        for client in (cls.edges, cls.places, cls.second):
            assert client.wait_for_server(rospy.Duration(30))
        assert wait_until(lambda: len(cls.truth) > 5, 20)

    @classmethod
    def hand_on(cls, msg: LaserScan) -> None:
        """A scan, and what the localization says of it: the truth."""
        if cls.hands_on:
            cls.scans.publish(msg)
        if cls.says and cls.truth.last is not None and len(cls.odometry):
            stamp_ns = conversions.ns_from_stamp(cls.truth.last.header.stamp)
            odometry = min(
                cls.odometry.all[-20:], key=lambda each: abs(conversions.ns_from_stamp(each.header.stamp) - stamp_ns)
            )
            map_from_odom = se2.compose(
                conversions.planar_from_pose(cls.truth.last.pose),
                se2.inverse(conversions.planar_from_pose(odometry.pose.pose)),
            )
            if stamp_ns > cls.sent_ns:  # tf complains of what it knows
                cls.sent_ns = stamp_ns
                cls.transforms.sendTransform(conversions.transform_stamped(stamp_ns, "map", "odom", map_from_odom))
            cls.localization.publish(
                LocalizationStatus(header=msg.header, state_name=cls.says, state=getattr(LocalizationStatus, cls.says))
            )

    def setUp(self) -> None:
        self.let_localization_say("LOCALIZED")
        self.let(hands_on=True)

    def tearDown(self) -> None:
        for client in (self.edges, self.places, self.second):
            if client.get_state() in (GoalStatus.PENDING, GoalStatus.ACTIVE):
                client.cancel_goal()  # not all: that may overtake the next goal
        self.await_standing(10.0)

    @classmethod
    def let(cls, **values: Any) -> None:
        for name, value in values.items():
            setattr(cls, name, value)

    def let_localization_say(self, state: str) -> None:
        """Returns once the driver knows."""
        self.let(says=state)
        self.assertTrue(
            wait_until(
                lambda: len(self.diagnostics)
                and KeyValue("localization", state) in self.diagnostics.last.status[0].values,
                10.0,
            ),
            "the driver does not listen",
        )

    # -- what is measured

    def speed(self) -> float:
        twist = self.odometry.last.twist.twist
        return max(abs(twist.linear.x), abs(twist.angular.z))

    def await_standing(self, timeout_s: float) -> None:
        self.assertTrue(wait_until(lambda: self.speed() == 0.0, timeout_s), "the robot does not stand")

    def await_moving(self, forward_m_s: float) -> None:
        self.assertTrue(
            wait_until(lambda: self.odometry.last.twist.twist.linear.x > forward_m_s, 60.0),
            f"the robot does not drive: {self.status.last}",
        )

    def await_state(self, name: str, timeout_s: float = 30.0) -> DriverStatus:
        self.assertTrue(
            wait_until(lambda: self.status.last is not None and self.status.last.state_name == name, timeout_s),
            f"no {name}, but {self.status.last}",
        )
        return self.status.last

    def assertStopsAfter(self, ask: Callable[[], None]) -> None:
        """Within STOPPED_S of simulated time, and for good."""
        self.assertGreater(self.speed(), 0.0)
        asked_ns = conversions.ns_from_stamp(self.odometry.last.header.stamp)
        ask()
        self.await_standing(5.0)
        heard = len(self.odometry)
        self.assertTrue(wait_until(lambda: len(self.odometry) > heard + 25, 30.0))
        after = [msg for msg in self.odometry.all if conversions.ns_from_stamp(msg.header.stamp) > asked_ns]
        moving = [
            conversions.ns_from_stamp(msg.header.stamp)
            for msg in after
            if msg.twist.twist.linear.x or msg.twist.twist.angular.z
        ]
        stood_s = (max(moving) - asked_ns) * 1e-9 if moving else 0.0
        rospy.loginfo(f"stood after {stood_s:.3f} s")
        self.assertLess(stood_s, STOPPED_S)

    def await_end(self, client: Any, timeout_s: float = 90.0) -> Any:
        ended = wait_until(lambda: client.get_result() is not None, timeout_s)  # its state may be known before
        self.assertTrue(ended, f"no result, the driver says {self.status.last}")
        return client.get_result()

    # -- edges

    def test_1_it_refuses_to_leave_a_meetpoint_where_it_is_at_none(self) -> None:
        self.edges.send_goal(TraverseEdgeGoal(edge="LEFT"))
        result = self.await_end(self.edges)
        self.assertEqual(result.code, TraverseEdgeResult.NOT_AT_MEETPOINT)
        self.assertEqual(result.reason, "the robot is not at a meetpoint: a goal without edge drives to one")
        self.assertEqual(self.edges.get_state(), GoalStatus.ABORTED)

    def test_2_a_preempted_search_for_a_meetpoint_stands_at_once(self) -> None:
        self.edges.send_goal(TraverseEdgeGoal())
        self.assertTrue(wait_until(lambda: self.speed() > 0.5, 30.0))
        self.assertStopsAfter(self.edges.cancel_goal)
        self.assertEqual(self.await_end(self.edges).code, TraverseEdgeResult.PREEMPTED)
        self.assertEqual(self.edges.get_state(), GoalStatus.PREEMPTED)
        self.await_state("IDLE")

    def test_3_it_drives_to_a_meetpoint_and_along_its_edges(self) -> None:
        feedback: List[Any] = []
        self.edges.send_goal(TraverseEdgeGoal(), feedback_cb=feedback.append)
        result = self.await_end(self.edges)
        self.assertEqual(self.edges.get_state(), GoalStatus.SUCCEEDED, result)
        self.assertFalse(result.has_traversal)
        self.assertEqual({each.status.task for each in feedback}, {"traverse_edge"})
        self.assertIn("SEEKING", {each.status.state_name for each in feedback})
        self.assertTrue(wait_until(lambda: len(self.meetpoints), 30.0))
        self.assertEqual(self.meetpoints.last.header.stamp, result.meetpoint.header.stamp)
        self.assertEqual(
            (self.meetpoints.last.degree, self.meetpoints.last.r, tuple(self.meetpoints.last.bearings)),
            (result.meetpoint.degree, result.meetpoint.r, tuple(result.meetpoint.bearings)),
        )
        self.await_state("ARRIVED")
        self.edges.send_goal(TraverseEdgeGoal(edge="RANK_9"))
        refused = self.await_end(self.edges)
        self.assertEqual(refused.code, TraverseEdgeResult.REFUSED)
        self.assertIn("turn of rank 9: the meetpoint it left has degree", refused.reason)
        # by turn_choice, which waits for nobody and answers one meetpoint
        other = TurnChoice(rank=0, degree=result.meetpoint.degree, name="U_TURN")
        other.header.stamp = rospy.Time(1)
        self.turns.publish(other)
        self.assertTrue(
            wait_until(lambda: self.lines.having("turn_choice U_TURN not used: it answers the meetpoint"), 10.0)
        )
        choice = TurnChoice(header=result.meetpoint.header, rank=0, degree=result.meetpoint.degree, name="U_TURN")
        self.turns.publish(choice)
        self.await_moving(0.2)
        self.assertEqual(self.status.last.task, "turn_choice U_TURN")
        self.turns.publish(choice)
        self.assertTrue(
            wait_until(lambda: self.lines.having("turn_choice U_TURN not used: turn_choice U_TURN is on"), 10.0)
        )
        self.assertTrue(wait_until(lambda: len(self.traversals), 90.0), f"no traversal: {self.status.last}")
        traversal = self.traversals.last
        self.assertTrue(wait_until(lambda: self.meetpoints.last.header.stamp == traversal.header.stamp, 30.0))
        self.assertEqual(traversal.rank, 0)
        self.assertGreater(traversal.length, 0.3)
        self.assertLessEqual(traversal.chord, traversal.length + 1e-3)
        self.assertTrue(
            wait_until(
                lambda: {marker.ns for marker in self.markers.last.markers if marker.action == 0}
                >= {"local_edges", "local_nodes", "meetpoint", "state"},
                10.0,
            )
        )

    # -- places

    def test_4_a_place_of_the_map_is_driven_to_and_a_preempted_drive_stands(self) -> None:
        position = ATLAS.nodes.position_m
        here = conversions.planar_from_pose(self.truth.last.pose)[:2]
        away = np.hypot(*(position - here).T)
        near = [node for node in np.argsort(away).tolist() if away[node] > 2.0 and ATLAS.nodes.r_m[node] > 0.7]
        self.places.send_goal(GotoNodeGoal(node=near[4]))
        self.await_moving(0.4)
        self.assertStopsAfter(self.places.cancel_goal)
        self.assertEqual(self.await_end(self.places).code, GotoNodeResult.PREEMPTED)
        self.places.send_goal(GotoNodeGoal(node=near[0]))
        result = self.await_end(self.places)
        self.assertEqual(self.places.get_state(), GoalStatus.SUCCEEDED, result)
        truth = conversions.planar_from_pose(self.truth.last.pose)
        self.assertLess(np.hypot(*(truth[:2] - position[near[0]])), 0.15)
        self.assertLess(np.hypot(*(conversions.planar_from_pose(result.pose.pose) - truth)[:2]), 0.1)

    def test_5_without_a_place_in_the_map_no_goal_there_is_driven_to(self) -> None:
        for state in ("LOST", "GLOBAL_SEARCH", "UNKNOWN"):
            self.let_localization_say(state)
            self.places.send_goal(GotoNodeGoal(node=10))
            result = self.await_end(self.places)
            self.assertEqual(result.code, GotoNodeResult.NOT_LOCALIZED)
            self.assertEqual(result.reason, f"the goal needs a pose in the map: the localization is {state}")
            self.assertEqual(self.speed(), 0.0)

    def test_6_lost_on_the_way_it_stands_and_gives_up_after_a_while(self) -> None:
        here = conversions.planar_from_pose(self.truth.last.pose)
        far = int(np.argmax(np.hypot(*(ATLAS.nodes.position_m - here[:2]).T)))
        self.places.send_goal(GotoNodeGoal(node=far))
        self.await_moving(0.3)
        self.let(says="LOST")
        self.assertEqual(self.await_state("HALTED").reason, "the localization is LOST")
        self.await_standing(2.0)
        self.let(says="LOCALIZED")
        self.await_moving(0.3)  # found again
        self.let(says="LOST")
        result = self.await_end(self.places, 30.0)
        self.assertEqual(result.code, GotoNodeResult.NOT_LOCALIZED)
        self.assertIn("the localization is LOST, for 10 s", result.reason)

    def test_7_without_scans_it_stands_and_goes_on_when_they_come_again(self) -> None:
        self.edges.send_goal(TraverseEdgeGoal())
        self.assertTrue(wait_until(lambda: self.speed() > 0.3, 30.0))
        self.let(hands_on=False)
        self.assertRegex(self.await_state("HALTED").reason, r"^the last scan is 0\.[67] s old$")
        self.await_standing(2.0)
        self.let(hands_on=True)
        self.assertTrue(wait_until(lambda: self.speed() > 0.3, 30.0), "it does not go on")

    def test_8_goals_that_cannot_be_are_refused_in_a_sentence(self) -> None:
        for goal, words in (
            (GotoNodeGoal(node=999), "node 999: the atlas opaque_office has nodes 0 to "),
            (GotoNodeGoal(node=-1), "the pose must be given in frame 'map', got ''"),
        ):
            self.places.send_goal(goal)
            result = self.await_end(self.places)
            self.assertEqual(result.code, GotoNodeResult.REFUSED)
            self.assertIn(words, result.reason)
        self.edges.send_goal(TraverseEdgeGoal(edge="AHEAD"))
        self.assertIn(
            self.await_end(self.edges).code, (TraverseEdgeResult.REFUSED, TraverseEdgeResult.NOT_AT_MEETPOINT)
        )

    # -- move_base

    def test_8_a_move_base_that_hangs_or_is_killed_ends_the_goal(self) -> None:
        status = Heard("/second/move_base/status", GoalStatusArray)
        for how in (signal.SIGSTOP, signal.SIGKILL):
            process = subprocess.Popen([sys.executable, "-c", MOVE_BASE_PROCESS])
            try:
                probe = actionlib.SimpleActionClient("/second/move_base", MoveBaseAction)
                self.assertTrue(probe.wait_for_server(rospy.Duration(30.0)), "the process does not start")
                status.clear()
                self.second.send_goal(GotoNodeGoal(node=10))
                self.assertTrue(
                    wait_until(
                        lambda: any(each.status == GoalStatus.ACTIVE for msg in status.all for each in msg.status_list),
                        30.0,
                    ),
                    "move_base has no goal",
                )
                process.send_signal(how)
                result = self.await_end(self.second)
            finally:
                process.kill()
                process.wait()
            self.assertEqual(result.code, GotoNodeResult.NO_MOVE_BASE, result.reason)
            self.assertEqual(result.reason, "/second/move_base is silent for 2 s: move_base has ended or hangs")

    def test_9_move_base_drives_if_that_is_asked_for(self) -> None:
        self.second.send_goal(GotoNodeGoal(node=10))
        result = self.await_end(self.second)
        self.assertEqual(result.code, GotoNodeResult.NO_MOVE_BASE)
        self.assertEqual(
            result.reason, "no action server /second/move_base within 5 s: start move_base, or set ~backend to internal"
        )
        player = MoveBasePlayer()
        for outcome, code, words in (
            ("there", GotoNodeResult.SUCCEEDED, "Goal reached."),
            ("none", GotoNodeResult.NO_WAY, "Failed to find a valid plan."),
        ):
            count = len(player.goals)
            self.second.send_goal(GotoNodeGoal(node=10))
            self.assertTrue(wait_until(lambda count=count: len(player.goals) > count, 30.0), "move_base has no goal")
            target = player.goals[-1].target_pose
            self.assertEqual(target.header.frame_id, "map")
            np.testing.assert_allclose(conversions.planar_from_pose(target.pose)[:2], ATLAS.nodes.position_m[10])
            player.outcome = outcome
            result = self.await_end(self.second)
            self.assertEqual(result.code, code, result)
            self.assertIn(words, result.reason)
        self.second.send_goal(GotoNodeGoal(node=10))
        self.assertTrue(wait_until(lambda: len(player.goals) == 3, 30.0))
        self.second.cancel_goal()
        self.assertEqual(self.await_end(self.second).code, GotoNodeResult.PREEMPTED)
        self.assertTrue(wait_until(lambda: player.cancelled == 1, 30.0), "move_base drives on")
        self.second.send_goal(GotoNodeGoal(node=10))
        self.assertTrue(wait_until(lambda: len(player.goals) == 4, 30.0))
        self.let(says="LOST")
        self.assertEqual(self.await_end(self.second).code, GotoNodeResult.NOT_LOCALIZED)
        self.assertTrue(wait_until(lambda: player.cancelled == 2, 30.0), "move_base drives on")

    # -- the process

    def check_end(self, code: int, line: str, *arguments: str) -> None:
        ended, printed = Process("driver_node", f"__name:=driver_{self._testMethodName}", *arguments).wait(30.0)
        self.assertEqual(ended, code, printed)
        self.assertIn(line, printed)
        self.assertNotIn("Traceback", printed)

    def test_an_unknown_parameter_ends_it(self) -> None:
        self.check_end(2, "unknown parameter ~max_sped_m_s; did you mean ~max_speed_m_s?", "_max_sped_m_s:=1.0")

    def test_an_unknown_atlas_ends_it(self) -> None:
        self.check_end(3, "did you mean glass_office?", "_atlas:=glass_offise")

    def test_terminated_it_ends_at_once(self) -> None:
        status = Heard("/driver_ending/status", DriverStatus)
        node = Process(
            "driver_node",
            "__name:=driver_ending",
            "_seek_at_start:=false",
            "traverse_edge:=other_edge",
            "goto_node:=other_node",
            "cmd_vel:=other_cmd_vel",
        )
        started = wait_until(lambda: status.last, 30.0)
        code, printed = node.end(signal.SIGTERM)
        self.assertTrue(started, printed)
        self.assertEqual((code, status.last.state_name), (0, "IDLE"), printed)


if __name__ == "__main__":
    rospy.init_node("driver_node_rostest")
    rostest.rosrun("glass_nav", "driver_node", Driver)
