"""driver_node: drives along edges of the Voronoi graph without a map, and to goals in the map.

Wiring only: driving/driver.py decides. Callbacks store messages; one loop passes on scans as they come, and executes
the driver's decisions at each control step. Without a task nothing is published on cmd_vel, so that others may steer.

Subscribes: scan (LaserScan); scan_surfaces (LaserScan), in its place while the localization is LOCALIZED; turn_choice
    (TurnChoice), the answer to the last meetpoint; topology_status (TopologyStatus) and localization_status
    (LocalizationStatus), which launch/driver.launch remaps to those of the two nodes; map (OccupancyGrid): where it is
    free to drive straight to the nearest edge; tf odom <- base <- laser, and map <- odom for goals in the map.
Publishes: cmd_vel (Twist); meetpoint (Meetpoint) and edge_traversal (EdgeTraversal) with the same stamp; node_visits
    (NodeVisits) at the end of a goal of goto_node; ~status (DriverStatus, latched); ~markers (MarkerArray): see driver_displays.py; /diagnostics.
Actions: traverse_edge (TraverseEdge), goto_node (GotoNode). A goal of either ends the current task.
Parameters: DriverParams, read once; explained in config/driver.yaml.
"""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import Any, Callable, Dict, List, Optional

import actionlib
import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid
from visualization_msgs.msg import MarkerArray

from glass_nav import params
from glass_nav.driving import decisions
from glass_nav.driving.decisions import Action, Decision
from glass_nav.driving.driver import Driver
from glass_nav.driving.input_watch import Odometry
from glass_nav.driving.move_base_task import MoveBaseTask
from glass_nav.log_line import LogLine
from glass_nav.msg import (
    DriverStatus,
    EdgeTraversal,
    GotoNodeAction,
    GotoNodeFeedback,
    LocalizationStatus,
    Meetpoint,
    NodeVisits,
    TopologyStatus,
    TraverseEdgeAction,
    TraverseEdgeFeedback,
    TurnChoice,
)
from glass_nav.rate_limiter import RateLimiter
from glass_nav.ros import action_status, command_line, conversions, shutdown
from glass_nav.ros.diagnostics import Diagnostics
from glass_nav.ros.driver import driver_displays, driver_messages
from glass_nav.ros.driver.driver_params import MOVE_BASE, DriverParams
from glass_nav.ros.driver.move_base import MoveBase
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.loop_clock import LoopClock
from glass_nav.ros.mailbox import Mailbox
from glass_nav.ros.scan_input import ScanInput
from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_queue import ReadyScan
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import AtlasError
from glass_nav.vocabulary import LocalizationState, Outcome

MARKERS_PERIOD_S = 0.5
ODOMETRY_GRACE_S = 1.0  # by the wall clock; odometry may begin later than the node, so that the log says nothing yet
SILENCE_S = 5.0  # without any scan for so long, the log says why


class DriverNode:
    """Wiring only: messages in, events of the driver; its decisions, messages out."""

    def __init__(self, p: DriverParams) -> None:
        """
        Raises:
            ValueError, OSError: the atlas cannot be used; one line.
        """
        self._p = p.node
        self._clock = LoopClock()
        self._odometry_s = time.monotonic()  # when there was some, or the node began
        atlas = atlas_file.load(shipped_atlases.find(self._p.atlas)) if self._p.atlas else None
        names = self._p.input_names(rospy.resolve_name("localization_status"))
        backend = self._move_base_backend(p.drive.rules.patience_s) if self._p.backend == MOVE_BASE else None
        self._driver = Driver(p.drive, names, atlas, backend, self._clock.now_s)
        self._markers_pace = RateLimiter()
        self._next_report_s = 0.0  # of diagnostics, by the monotonic clock
        self._log = LogThrottle()
        self._poll_s = (
            0.005 if rospy.get_param("/use_sim_time", False) else min(0.01, 0.5 / p.drive.rules.control_rate_hz)
        )
        self._inbox = Mailbox(scans=20, surfaces=20, commands=100)
        self._carry_out: Dict[type, Callable[[Any], None]] = {
            decisions.Command: self._send_command,
            decisions.TraversalReport: self._send_traversal,
            decisions.MeetpointReport: self._send_meetpoint,
            decisions.DriveStatus: self._send_status,
            decisions.Feedback: self._send_feedback,
            decisions.GoalEnd: self._end_goal,
            decisions.VisitReport: self._send_visits,
            LogLine: self._log.write,
        }
        self._tf = tf2_ros.Buffer()
        self._scans = ScanInput(self._p.of_scans("scan"), p.deskew, self._tf, self._log)
        self._surfaces = ScanInput(self._p.of_scans("scan_surfaces"), p.deskew, self._tf, self._log)
        self._commands = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        self._meetpoints = rospy.Publisher("meetpoint", Meetpoint, queue_size=5)
        self._traversals = rospy.Publisher("edge_traversal", EdgeTraversal, queue_size=5)
        self._visits = rospy.Publisher("node_visits", NodeVisits, queue_size=5)
        self._status = rospy.Publisher("~status", DriverStatus, queue_size=10, latch=True)
        self._markers = rospy.Publisher("~markers", MarkerArray, queue_size=2)
        self._diagnostics = Diagnostics("driver")
        self._servers = {
            Action.TRAVERSE_EDGE: self._action(
                Action.TRAVERSE_EDGE, TraverseEdgeAction, lambda goal: self._driver.traverse_edge(goal.edge)
            ),
            Action.GOTO_NODE: self._action(
                Action.GOTO_NODE,
                GotoNodeAction,
                lambda goal: self._driver.goto_node(driver_messages.place_goal(goal)),
            ),
        }
        self._send_status(self._driver.status)
        for server in self._servers.values():
            action_status.start(server)
        # Subscribers last: they may fire at once.
        self._listener = tf2_ros.TransformListener(self._tf, tcp_nodelay=True)
        self._scans.subscribe(lambda msg: self._inbox.put("scans", msg))
        if self._p.use_scan_surfaces:
            self._surfaces.subscribe(lambda msg: self._inbox.put("surfaces", msg))
        for topic, kind, handle in (
            ("turn_choice", TurnChoice, self._take_turn),
            ("topology_status", TopologyStatus, self._take_topology),
            ("localization_status", LocalizationStatus, self._take_localization),
            ("map", OccupancyGrid, self._take_map),
        ):
            rospy.Subscriber(topic, kind, self._command(handle), queue_size=10, buff_size=2**24, tcp_nodelay=True)

    def run(self, ending: threading.Event) -> None:
        """The only thread that drives; returns when ROS shuts down or ending is set, and the robot is told to stand."""
        while not (rospy.is_shutdown() or ending.is_set()):
            mail = self._inbox.take(timeout_s=self._poll_s)
            jumped = self._clock.tick()
            self._driver.at(self._clock.now_s)
            if self._clock.has_begun:
                self._scans.last_arrival_s = self._surfaces.last_arrival_s = self._clock.now_s
            if jumped:
                self._reset(jumped)
                mail["scans"], mail["surfaces"] = [], []  # from before the jump
            for command in mail["commands"]:
                command()
            self._see(mail)
            if self._driver.is_control_due:
                self._do(self._driver.control(self._odometry(), self._map_from_odom(), self._scans.trouble))
            self._show()
            self._report()
        self._commands.publish(Twist())

    def _move_base_backend(self, patience_s: float) -> Callable[[np.ndarray], MoveBaseTask]:
        move_base = MoveBase(self._p.global_frame_id)
        return lambda pose: MoveBaseTask(move_base, pose, self._p.move_base_wait_s, patience_s)

    # -- callbacks of other threads: they store

    def _command(self, handle: Any) -> Any:
        return lambda msg: self._inbox.put("commands", lambda: handle(msg))

    def _action(self, action: Action, kind: Any, accept: Callable[[Any], List[Decision]]) -> Any:
        server = actionlib.SimpleActionServer(action.value, kind, auto_start=False)

        def take_goal() -> None:
            if server.is_new_goal_available():  # else another one came since, or it was cancelled
                self._do(accept(server.accept_new_goal()))

        def preempt() -> None:
            if server.is_preempt_requested() and not server.is_new_goal_available():
                self._do(self._driver.preempt(action))

        server.register_goal_callback(lambda: self._inbox.put("commands", take_goal))
        server.register_preempt_callback(lambda: self._inbox.put("commands", preempt))
        return server

    # -- events

    def _take_topology(self, msg: TopologyStatus) -> None:
        try:
            self._do(self._driver.search_reports(driver_messages.search_state(msg)))
        except ValueError as err:
            self._log.warn(f"not used: {err}")

    def _take_localization(self, msg: LocalizationStatus) -> None:
        try:
            self._driver.localization_reports(LocalizationState(msg.state_name), msg.reason)
        except ValueError as err:
            self._log.warn(f"localization_status not used: {err}")

    def _take_map(self, msg: OccupancyGrid) -> None:
        topic = rospy.resolve_name("map")
        try:
            self._do(self._driver.map_served(conversions.map_from_msg(msg), f"that of topic {topic}"))
        except AtlasError as err:
            rospy.logerr(str(err))
        except ValueError as err:
            rospy.logerr(f"the map of topic {topic} is refused: {err}")

    def _take_turn(self, msg: TurnChoice) -> None:
        self._do(self._driver.turn_choice(msg.rank, msg.name, conversions.ns_from_stamp(msg.header.stamp)))

    def _see(self, mail: "Dict[str, List[Any]]") -> None:
        """Pass on the scans that have their transforms, from the topic that the driver prefers now."""
        for lane, source in (("scans", self._scans), ("surfaces", self._surfaces)):
            for msg in mail[lane]:
                stale = source.receive(msg, self._clock.now_s, None)
                if stale is not None:
                    self._reset(stale)
        if mail["surfaces"]:
            self._driver.surfaces_came()
        preferred = self._surfaces if self._driver.prefers_surfaces else self._scans
        for source in (self._scans, self._surfaces):
            for ready in source.take_ready(self._clock.now_s):
                if source is preferred:
                    self._take_scan(source, ready)

    def _take_scan(self, source: ScanInput, ready: ReadyScan) -> None:
        try:
            placed = source.place(ready)
        except ScanError as err:
            source.refuse(str(err))
            return
        source.counts.used += self._driver.see(placed.scan, placed.odom_from_base)

    def _odometry(self) -> Optional[Odometry]:
        try:
            newest = self._tf.lookup_transform(self._p.odom_frame_id, self._p.base_frame_id, rospy.Time(0))
            stamp_ns = conversions.ns_from_stamp(newest.header.stamp)
            self._odometry_s = time.monotonic()
            return Odometry(stamp_ns, conversions.planar_from_transform(newest.transform))
        except (tf2_ros.TransformException, ValueError) as err:
            if time.monotonic() - self._odometry_s > ODOMETRY_GRACE_S:
                self._log.warn(f"odometry: {err}")
            return None

    def _map_from_odom(self) -> Optional[np.ndarray]:
        try:
            newest = self._tf.lookup_transform(self._p.global_frame_id, self._p.odom_frame_id, rospy.Time(0))
            return conversions.planar_from_transform(newest.transform)
        except (tf2_ros.TransformException, ValueError):
            return None

    def _reset(self, why: str) -> None:
        self._do(self._driver.reset(why))
        for source in (self._scans, self._surfaces):
            source.restart(self._clock.now_s)
        self._tf.clear()

    # -- decisions

    def _do(self, decided: List[Decision]) -> None:
        for decision in decided:
            self._carry_out[type(decision)](decision)

    def _send_command(self, command: decisions.Command) -> None:
        self._commands.publish(driver_messages.twist_msg(command.velocity))

    def _send_traversal(self, report: decisions.TraversalReport) -> None:
        self._traversals.publish(driver_messages.traversal_msg(report.arrival, self._p.base_frame_id))

    def _send_meetpoint(self, report: decisions.MeetpointReport) -> None:
        self._meetpoints.publish(driver_messages.meetpoint_msg(report.arrival, self._p.base_frame_id))

    def _send_visits(self, report: decisions.VisitReport) -> None:
        self._visits.publish(driver_messages.visits_msg(report, self._p.base_frame_id))

    def _send_status(self, status: decisions.DriveStatus) -> None:
        self._status.publish(driver_messages.status_msg(status, self._p.base_frame_id))

    def _send_feedback(self, feedback: decisions.Feedback) -> None:
        server = self._servers[feedback.action]
        if server.is_active():
            kind = {Action.TRAVERSE_EDGE: TraverseEdgeFeedback, Action.GOTO_NODE: GotoNodeFeedback}[feedback.action]
            server.publish_feedback(kind(driver_messages.status_msg(feedback.status, self._p.base_frame_id)))

    def _end_goal(self, end: decisions.GoalEnd) -> None:
        server = self._servers[end.action]
        if end.action == Action.TRAVERSE_EDGE:
            result = driver_messages.edge_result(end, self._p.base_frame_id)
        else:
            result = driver_messages.place_result(end, self._p.global_frame_id)
        finish = {Outcome.SUCCEEDED: server.set_succeeded, Outcome.PREEMPTED: server.set_preempted}
        finish.get(end.ending.outcome, server.set_aborted)(result, end.ending.reason)

    # -- what people see

    def _show(self) -> None:
        odom_from_base = self._driver.odom_from_base
        if odom_from_base is None or not self._markers.get_num_connections():
            return
        if not self._markers_pace.is_due(self._clock.now_s, MARKERS_PERIOD_S):
            return
        status = self._driver.status
        self._markers.publish(
            driver_displays.driver_markers(
                self._driver.edge_driver,
                self._driver.route_m,
                odom_from_base,
                f"{status.phase}\n{status.reason}",
                self._p.odom_frame_id,
                self._p.global_frame_id,
            )
        )

    def _report(self) -> None:
        """Publish /diagnostics, once a second."""
        if time.monotonic() < self._next_report_s:
            return
        self._next_report_s = time.monotonic() + 1.0
        if self._clock.now_s - self._scans.last_arrival_s > SILENCE_S:
            self._log.warn(self._scans.silence(self._clock.now_s), 15.0)
        health, counts = self._driver.health, vars(self._scans.counts)
        values = {**health.values, **{f"scans {name}": count for name, count in counts.items()}}
        self._diagnostics.publish({"driver": replace(health, values=values)})


def main() -> None:
    """Start the node; exit code 2 if a parameter cannot be used, 3 if the atlas cannot."""
    if command_line.answers_help(__doc__):
        return
    shutdown.run_node(
        "driver", lambda given: DriverNode(params.load(DriverParams, given, rospy.get_name())), (AtlasError, OSError)
    )
