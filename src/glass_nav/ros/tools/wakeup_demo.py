"""wakeup_demo: shows how a robot wakes up, sends it on a tour of the building, and measures both.

Listens beside launch/wakeup.launch; the robot finds its place without it. Wiring only: demo/wake_up_demo.py is what it
does. Once the search is CONFIRMED it sends goals to goto_node, one after another, prints the errors against the
simulator's truth and writes a picture.

Subscribes: meetpoint, edge_traversal, turn_choice, topology_status, topology_candidates, initialpose, amcl_pose,
    localization_status, ground_truth, map.
Calls: restart_search (Trigger), when the search is LOST.
Parameters: WakeUpDemoParams. Exit code: 0 if the place was right and the tour was driven, 1 if not, 2 for a parameter
    that cannot be used.
"""

from __future__ import annotations

import sys
import threading
import time
from typing import Any, Dict, Optional

import actionlib
import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from std_srvs.srv import Trigger

from glass_nav import params
from glass_nav.demo.reports import Candidates, Reports, SearchNews
from glass_nav.demo.wake_up_demo import Arrival, WakeUpDemo, WakeUpDemoParams
from glass_nav.msg import (
    EdgeTraversal,
    GotoNodeAction,
    GotoNodeGoal,
    LocalizationStatus,
    Meetpoint,
    TopologyCandidates,
    TopologyStatus,
)
from glass_nav.ros import command_line, conversions, shutdown
from glass_nav.ros.mailbox import Mailbox
from glass_nav.ros.topology import topology_messages
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.observations import ObservationError
from glass_nav.vocabulary import LocalizationState, Outcome, SearchState

LISTEN_S = 0.05
SERVER_LIMIT_S = 10.0


class RobotOnTopics:
    """The robot of the demo, as topics and an action show it; its reports are kept in `reports`."""

    def __init__(self, ending: threading.Event) -> None:
        self.reports = Reports()
        self._ending = ending
        self._inbox = Mailbox(events=1000)
        self._client = actionlib.SimpleActionClient("goto_node", GotoNodeAction)
        for topic, kind, take in (
            ("ground_truth", PoseStamped, self._take_truth),
            ("amcl_pose", PoseWithCovarianceStamped, self._take_pose),
            ("meetpoint", Meetpoint, self._take_meetpoint),
            ("edge_traversal", EdgeTraversal, self._take_traversal),
            ("topology_candidates", TopologyCandidates, self._take_candidates),
            ("topology_status", TopologyStatus, self._take_search),
            ("localization_status", LocalizationStatus, self._take_localization),
            ("initialpose", PoseWithCovarianceStamped, self._take_initial_pose),
            ("map", OccupancyGrid, self._take_map),
        ):
            rospy.Subscriber(
                topic, kind, self._put, callback_args=take, queue_size=200, buff_size=2**22, tcp_nodelay=True
            )

    # -- what the demo asks for

    def listen(self) -> None:
        for take, msg in self._inbox.take(timeout_s=LISTEN_S)["events"]:
            take(msg)

    def is_ending(self) -> bool:
        return bool(rospy.is_shutdown() or self._ending.is_set())

    def wall_s(self) -> float:
        return time.monotonic()

    def say(self, line: str) -> None:
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()

    def restart_search(self) -> str:
        try:
            rospy.ServiceProxy("restart_search", Trigger)()
        except rospy.ServiceException as err:
            return str(err)
        return ""

    def takes_goals(self) -> bool:
        return bool(self._client.wait_for_server(rospy.Duration(SERVER_LIMIT_S)))

    def go_to(self, node: int) -> None:
        self._client.send_goal(GotoNodeGoal(node=node))

    def arrival(self) -> Optional[Arrival]:
        result = self._client.get_result()  # the state of the goal may be known before it
        return None if result is None else Arrival(list(Outcome)[result.code], result.reason, result.travelled)

    def stop(self) -> None:
        self._client.cancel_goal()

    # -- callbacks

    def _put(self, msg: Any, take: Any) -> None:
        self._inbox.put("events", (take, msg))

    def _take_truth(self, msg: PoseStamped) -> None:
        self.reports.truth[_stamp_ns(msg)] = conversions.planar_from_pose(msg.pose)

    def _take_pose(self, msg: PoseWithCovarianceStamped) -> None:
        self.reports.poses[_stamp_ns(msg)] = conversions.planar_from_pose(msg.pose.pose)

    def _take_meetpoint(self, msg: Meetpoint) -> None:
        try:
            self.reports.meetpoints[_stamp_ns(msg)] = topology_messages.meetpoint_from_msg(msg)
        except ObservationError:  # refused by the topology node as well, which says so
            return

    def _take_traversal(self, msg: EdgeTraversal) -> None:
        try:
            self.reports.traversals[_stamp_ns(msg)] = topology_messages.traversal_from_msg(msg, None)
        except ObservationError:
            return

    def _take_candidates(self, msg: TopologyCandidates) -> None:
        poses = np.array([conversions.planar_from_pose(pose) for pose in msg.poses]).reshape(-1, 3)
        self.reports.candidates[_stamp_ns(msg)] = Candidates(msg.total, list(msg.nodes), list(msg.edges), poses)

    def _take_search(self, msg: TopologyStatus) -> None:
        state = SearchState(msg.state_name)
        self.reports.take_search(SearchNews(_stamp_ns(msg), state, msg.reason, msg.depth, msg.candidates, msg.turn))

    def _take_localization(self, msg: LocalizationStatus) -> None:
        self.reports.localization = LocalizationState(msg.state_name)

    def _take_initial_pose(self, msg: PoseWithCovarianceStamped) -> None:
        self.reports.initial_pose = _stamp_ns(msg), conversions.planar_from_pose(msg.pose.pose)

    def _take_map(self, msg: OccupancyGrid) -> None:
        self.reports.grid_map = conversions.map_from_msg(msg)


def _stamp_ns(msg: Any) -> int:
    return conversions.ns_from_stamp(msg.header.stamp)


def main() -> None:
    """Start; see the exit codes above."""
    if command_line.answers_help(__doc__):
        return
    rospy.init_node("wakeup_demo", disable_signals=True)
    ending = shutdown.event_on_signals()
    given: Dict[str, Any] = rospy.get_param("~", {})
    try:
        p = params.load(WakeUpDemoParams, given, rospy.get_name())
        atlas = atlas_file.load(shipped_atlases.find(p.atlas))
    except (ValueError, OSError) as err:  # ParamError, AtlasError
        shutdown.refuse_to_start(err)
    robot = RobotOnTopics(ending)
    succeeded = False
    try:
        succeeded = WakeUpDemo(atlas, p, robot.reports, robot).run()
    finally:
        rospy.signal_shutdown("ended")
    sys.exit(0 if succeeded else 1)
