"""driver_node: drives along edges of the Voronoi graph without a map, and to places of the map.

Wiring only; what it does is in driving/. Callbacks store, one loop works: it takes in scans as they come, and at each
control step asks the task that is on for a command. Without a task it is silent, so that others may steer.

Subscribes: scan (LaserScan); scan_surfaces (LaserScan), in its place while the localization is LOCALIZED; turn_choice
    (TurnChoice), the answer to the last meetpoint; topology_status (TopologyStatus) and localization_status
    (LocalizationStatus), which launch/driver.launch remaps to those of the two nodes; map (OccupancyGrid): where it is
    free to drive straight to the nearest edge; tf odom <- base <- laser, and map <- odom for goals in the map.
Publishes: cmd_vel (Twist); meetpoint (Meetpoint) and edge_traversal (EdgeTraversal) with the same stamp; ~status
    (DriverStatus, latched); ~markers (MarkerArray): see driver_displays.py; /diagnostics.
Actions: traverse_edge (TraverseEdge), goto_node (GotoNode). There is one robot: a goal of either ends what is on, and a
    turn_choice waits for neither.
Calls: restart_search (Trigger; launch/driver.launch remaps it to ~restart of the topology node) when it stands at a
    meetpoint that the search cannot follow it to: it was restarted, or carried.
Parameters: DriverParams, read once; explained in config/driver.yaml.
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass
from typing import Any, Dict, Optional, Sequence

import actionlib
import numpy as np
import rospy
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from glass_nav import params
from glass_nav.driving import edge_driver
from glass_nav.driving.edge_driver import Arrival, EdgeDriver
from glass_nav.driving.route import RoutePlanner
from glass_nav.driving.seek_policy import SeekPolicy
from glass_nav.driving.tasks import SUCCEEDED, EdgeTask, GoTask, Moment, Outcome, Task
from glass_nav.geometry import se2
from glass_nav.msg import (
    DriverStatus,
    EdgeTraversal,
    GotoNodeAction,
    GotoNodeFeedback,
    GotoNodeGoal,
    GotoNodeResult,
    LocalizationStatus,
    Meetpoint,
    TopologyStatus,
    TraverseEdgeAction,
    TraverseEdgeFeedback,
    TraverseEdgeGoal,
    TraverseEdgeResult,
    TurnChoice,
)
from glass_nav.ros import action_status, conversions, shutdown
from glass_nav.ros.driver import driver_displays, driver_messages
from glass_nav.ros.driver.driver_params import MOVE_BASE, DriverParams
from glass_nav.ros.driver.move_base_task import MoveBase, MoveBaseTask
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.mailbox import Mailbox
from glass_nav.ros.rate_limiter import RateLimiter
from glass_nav.ros.scan_input import STALE_SCANS, ScanInput
from glass_nav.sensing.scan import ScanError
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas, AtlasError
from glass_nav.topology.observations import ObservationError
from glass_nav.world.grid_map import GridMap

TIME_JUMP_S = 0.5  # a clock that goes back by less is noise between machines
QUIET_S = 0.5  # zeros are sent so long after a task, then nothing
LONGEST_STEP_S = 0.2  # a control step that came later is taken for one of so long
REPORT_AGAIN_S = 2.0  # a search that waits is told of the meetpoint so often
STATUS_PERIOD_S = 0.5
MARKERS_PERIOD_S = 0.5
RESTART_WAIT_S = 2.0  # for the service, by the wall clock
MOVED_M = 0.3  # so far from its meetpoint the robot does not stand there any more
IN_SEARCH = (TopologyStatus.SEARCHING, TopologyStatus.TENTATIVE)
POSE_STATES = ("LOCALIZED", "UNCERTAIN")  # in which a pose in the map may be driven by
HALTED, IDLE, FAILED = "HALTED", "IDLE", "FAILED"
PREEMPTED, REFUSED, NOT_AT_MEETPOINT, NO_INPUT, NOT_LOCALIZED, RESET = (
    "PREEMPTED",
    "REFUSED",
    "NOT_AT_MEETPOINT",
    "NO_INPUT",
    "NOT_LOCALIZED",
    "RESET",
)


@dataclass
class _Job:
    """The task that is on, and for whom."""

    task: Task
    name: str  # in words
    server: Any  # action server, None: nobody waits for a result
    travelled_m: float = 0.0
    halted_since_s: float = math.nan


class DriverNode:
    """Wiring only: scans in, one call of the core at each control step, a command out."""

    def __init__(self, p: DriverParams) -> None:
        """Raises:
        ValueError, OSError: the atlas cannot be used; one line.
        """
        self._p, self._node = p, p.node
        self._atlas: Optional[Atlas] = None
        if self._node.atlas:
            self._atlas = atlas_file.load(shipped_atlases.find(self._node.atlas))
        self._map: Optional[GridMap] = None
        self._map_fault = ""
        self._planner: Optional[RoutePlanner] = None
        self._driver = EdgeDriver(p.edge)
        self._move_base = MoveBase() if self._node.backend == MOVE_BASE else None
        self._job: Optional[_Job] = None
        self._arrival: Optional[Arrival] = None  # where it stands
        self._arrival_stamp_ns = 0
        self._arrived_at = np.zeros(3)  # odom_from_base there
        self._reported_s = -math.inf
        self._seeking = SeekPolicy(self._node.seek_attempts)
        self._topology: Optional[TopologyStatus] = None
        self._localization = self._localization_reason = ""
        self._localization_s = -math.inf  # when it was heard
        self._said = IDLE, "nothing is asked for", ""
        self._velocity = np.zeros(3)
        self._quiet_from_s = -math.inf
        self._odom_from_base: Optional[np.ndarray] = None
        self._odometry_pose: Optional[np.ndarray] = None  # at the control step before
        self._odometry_ns = self._seen_ns = 0
        self._status_pace, self._markers_pace = RateLimiter(), RateLimiter()
        self._next_report_s = 0.0  # of diagnostics, by the monotonic clock
        self._log = LogThrottle()
        self._simulated = bool(rospy.get_param("/use_sim_time", False))
        self._inbox = Mailbox(scans=20, surfaces=20, commands=100)
        self._now_s = self._controlled_s = rospy.get_time()

        self._tf = tf2_ros.Buffer()
        self._scans = ScanInput(self._node.of_scans("scan"), p.deskew, self._tf, self._log)
        self._surfaces = ScanInput(self._node.of_scans("scan_surfaces"), p.deskew, self._tf, self._log)
        self._commands = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        self._meetpoints = rospy.Publisher("meetpoint", Meetpoint, queue_size=5)
        self._traversals = rospy.Publisher("edge_traversal", EdgeTraversal, queue_size=5)
        self._status = rospy.Publisher("~status", DriverStatus, queue_size=10, latch=True)
        self._markers = rospy.Publisher("~markers", MarkerArray, queue_size=2)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=2)
        self._edge_server = self._action("traverse_edge", TraverseEdgeAction, self._accept_edge)
        self._goto_server = self._action("goto_node", GotoNodeAction, self._accept_goto)
        self._send_status()
        for server in (self._edge_server, self._goto_server):
            action_status.start(server)
        # Subscribers last: they may fire at once.
        self._listener = tf2_ros.TransformListener(self._tf, tcp_nodelay=True)
        self._scans.subscribe(lambda msg: self._inbox.put("scans", msg))
        if self._node.use_scan_surfaces:
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
        period_s = 1.0 / self._node.control_rate_hz
        while not (rospy.is_shutdown() or ending.is_set()):
            mail = self._inbox.take(timeout_s=0.005 if self._simulated else min(0.01, 0.5 * period_s))
            if self._clock_jumped_back():
                mail["scans"], mail["surfaces"] = [], []  # from before the jump
            for command in mail["commands"]:
                command()
            self._see(mail)
            if self._now_s - self._controlled_s >= period_s - 1e-6:
                self._control()
            self._report()
        self._send(np.zeros(3))

    # -- callbacks of other threads: they store

    def _command(self, handle: Any) -> Any:
        return lambda msg: self._inbox.put("commands", lambda: handle(msg))

    def _action(self, name: str, kind: Any, accept: Any) -> Any:
        server = actionlib.SimpleActionServer(name, kind, auto_start=False)
        server.register_goal_callback(lambda: self._inbox.put("commands", accept))
        server.register_preempt_callback(lambda: self._inbox.put("commands", lambda: self._preempt(server)))
        return server

    # -- what others say

    def _take_topology(self, msg: TopologyStatus) -> None:
        if msg.state == TopologyStatus.WAITING and (
            self._topology is None or self._topology.state != TopologyStatus.WAITING
        ):
            self._seeking.succeeds()  # somebody asks anew
        self._topology = msg

    def _take_localization(self, msg: LocalizationStatus) -> None:
        self._localization, self._localization_s = msg.state_name, self._now_s
        self._localization_reason = msg.reason

    def _take_map(self, msg: OccupancyGrid) -> None:
        """A map came: is the atlas one of it?"""
        topic = rospy.resolve_name("map")
        try:
            self._map, self._planner = conversions.map_from_msg(msg), None
            self._map_fault = ""
            if self._atlas is not None:
                warning = self._atlas.check_map(self._map, f"that of topic {topic}")
                if warning:
                    rospy.logwarn(f"the atlas {warning}")
        except AtlasError as err:
            self._map_fault = f"the atlas {err}"
            rospy.logerr(f"goto_node cannot be used: {self._map_fault}")
        except ValueError as err:
            rospy.logerr(f"the map of topic {topic} is refused: {err}")

    def _take_turn(self, msg: TurnChoice) -> None:
        """By which edge to leave, unless it is the answer to something else."""
        if not self._node.follow_turn_choice:
            return
        stamp_ns = conversions.ns_from_stamp(msg.header.stamp)
        words = f"turn_choice {msg.name or msg.rank}"
        if self._job is not None:
            self._log.warn(f"{words} not used: {self._job.name} is on")
        elif not self._stands_at_meetpoint:
            self._log.warn(f"{words} not used: the robot stands at no meetpoint")
        elif stamp_ns not in (0, self._arrival_stamp_ns):
            self._log.warn(
                f"{words} not used: it answers the meetpoint of {stamp_ns * 1e-9:.3f} s, the robot stands "
                f"at that of {self._arrival_stamp_ns * 1e-9:.3f} s"
            )
        else:
            try:
                task = EdgeTask(self._driver, self._p.recovery, self._p.edge.limits, msg.rank, may_choose=True)
            except (ObservationError, ValueError) as err:
                self._log.warn(f"{words} refused: {err}")
                return
            self._begin(task, words)

    # -- actions

    def _accept_edge(self) -> None:
        if not self._edge_server.is_new_goal_available():  # another one came since, or it was cancelled
            return
        goal: TraverseEdgeGoal = self._accept(self._edge_server)
        name = f"traverse_edge {goal.edge}".strip()
        try:
            rank: Optional[int] = None
            if goal.edge.strip():
                if not self._stands_at_meetpoint:
                    self._refuse(
                        self._edge_server,
                        NOT_AT_MEETPOINT,
                        "the robot stands at no meetpoint: a goal without edge drives to one",
                        name,
                    )
                    return
                assert self._arrival is not None
                rank = driver_messages.rank_from_words(goal.edge, self._arrival.meetpoint.degree)
            task = EdgeTask(self._driver, self._p.recovery, self._p.edge.limits, rank)
        except (ObservationError, ValueError) as err:
            self._refuse(self._edge_server, REFUSED, str(err), name)
            return
        self._begin(task, name, self._edge_server)

    def _accept_goto(self) -> None:
        if not self._goto_server.is_new_goal_available():
            return
        goal: GotoNodeGoal = self._accept(self._goto_server)
        name = f"goto_node {goal.node}" if goal.node >= 0 else "goto_node pose"
        unknown = self._pose_unknown()
        if unknown and not self._localization_is_silent:  # one that fell silent is waited for
            self._refuse(self._goto_server, NOT_LOCALIZED, f"the goal needs a pose in the map: {unknown}", name)
            return
        try:
            task = self._goto_task(goal)
        except (ValueError, OSError) as err:  # RouteError, AtlasError
            self._refuse(self._goto_server, REFUSED, str(err), name)
            return
        self._driver.stop()
        self._arrival = None
        self._begin(task, name, self._goto_server)

    def _goto_task(self, goal: GotoNodeGoal) -> Task:
        """Raises ValueError if it cannot be a goal."""
        frame, node = self._node.global_frame_id, self._node
        map_from_goal: Optional[np.ndarray] = None
        if goal.node < 0:
            if conversions.frame_id(goal.pose.header.frame_id) != frame:
                raise ValueError(f"the pose must be given in frame {frame!r}, got {goal.pose.header.frame_id!r}")
            map_from_goal = conversions.planar_from_pose(goal.pose.pose)
        elif self._atlas is None:
            raise ValueError("a goal by node needs an atlas: ~atlas is ''")
        elif goal.node >= len(self._atlas.nodes):
            raise ValueError(
                f"node {goal.node}: the atlas {self._atlas.name} has nodes 0 to {len(self._atlas.nodes) - 1}"
            )
        if self._map_fault:
            raise ValueError(self._map_fault)
        yaw = None
        if goal.with_heading:
            yaw = float(conversions.planar_from_pose(goal.pose.pose)[2])
        if self._move_base is not None:
            if map_from_goal is None:
                assert self._atlas is not None
                here = self._map_from_base()
                map_from_goal = np.append(self._atlas.nodes.position_m[goal.node], 0.0 if here is None else here[2])
            map_from_goal[2] = map_from_goal[2] if yaw is None else yaw
            return MoveBaseTask(self._move_base, map_from_goal, frame, node.move_base_wait_s)
        if self._atlas is None:
            raise ValueError("ways to goals follow an atlas: ~atlas is ''")
        if self._planner is None:
            self._planner = RoutePlanner(self._atlas, self._p.edge.limits, self._map)
        return GoTask(
            self._planner,
            self._driver,
            self._p.follower,
            self._p.recovery,
            self._p.edge.limits,
            goal.node if map_from_goal is None else map_from_goal[:2],
            yaw,
        )

    def _accept(self, server: Any) -> Any:
        """The new goal; what was on is over."""
        if self._job is not None:
            if self._job.server is not None and self._job.server is not server:
                self._finish(Outcome(PREEMPTED, "another goal took over"))
            else:  # accept_new_goal() ends the goal before it
                self._job.task.cancel()
                self._job = None
        self._stand()
        return server.accept_new_goal()

    def _preempt(self, server: Any) -> None:
        if (
            self._job is not None
            and self._job.server is server
            and server.is_preempt_requested()
            and not server.is_new_goal_available()
        ):
            self._finish(Outcome(PREEMPTED, "cancelled: the robot stands"))

    def _refuse(self, server: Any, code: str, reason: str, name: str) -> None:
        rospy.logwarn(f"{name} refused: {reason}")
        server.set_aborted(self._result(server, Outcome(code, reason), 0.0), reason)

    def _result(self, server: Any, outcome: Outcome, travelled_m: float, arrival: Optional[Arrival] = None) -> Any:
        if server is self._goto_server:
            pose = driver_messages.pose_stamped(self._map_from_base(), self._odometry_ns, self._node.global_frame_id)
            return GotoNodeResult(
                code=getattr(GotoNodeResult, outcome.code), reason=outcome.reason, pose=pose, travelled=travelled_m
            )
        result = TraverseEdgeResult(
            code=getattr(TraverseEdgeResult, outcome.code), reason=outcome.reason, travelled=travelled_m
        )
        if arrival is not None:
            frame = self._node.base_frame_id
            result.meetpoint = driver_messages.meetpoint_msg(arrival, frame)
            traversal = driver_messages.traversal_msg(arrival, frame)
            if traversal is not None:
                result.has_traversal, result.traversal = True, traversal
        return result

    # -- tasks

    def _begin(self, task: Task, name: str, server: Any = None) -> None:
        self._job = _Job(task, name, server)
        rospy.loginfo(f"{name} begins")
        self._tell(task.state, task.reason, name)

    def _finish(self, outcome: Outcome) -> None:
        """The task that is on is over: the robot stands, whoever waits is told."""
        job = self._job
        assert job is not None
        self._job = None
        if outcome.code != SUCCEEDED:
            job.task.cancel()
        self._stand()
        arrival = job.task.arrival if isinstance(job.task, EdgeTask) else None
        if arrival is not None:
            self._arrive(arrival)
        rospy.loginfo(f"{job.name}: {outcome.code}, {outcome.reason}")
        if outcome.code == SUCCEEDED:
            self._tell(edge_driver.ARRIVED if arrival is not None else IDLE, outcome.reason)
        else:
            if outcome.code != PREEMPTED:
                if job.server is None:
                    self._seeking.fails()
                else:
                    self._seeking.leave_to_others()
            self._tell(IDLE if outcome.code == PREEMPTED else FAILED, f"{job.name}: {outcome.reason}")
        if job.server is not None:
            result = self._result(job.server, outcome, job.travelled_m, arrival)
            if outcome.code == SUCCEEDED:
                job.server.set_succeeded(result, outcome.reason)
            elif outcome.code == PREEMPTED:
                job.server.set_preempted(result, outcome.reason)
            else:
                job.server.set_aborted(result, outcome.reason)

    def _arrive(self, arrival: Arrival) -> None:
        """Report a meetpoint, and the edge to it."""
        self._arrival, self._arrival_stamp_ns = arrival, arrival.stamp_ns
        self._seeking.succeeds()
        if self._odom_from_base is not None:
            self._arrived_at = self._odom_from_base
        traversal = driver_messages.traversal_msg(arrival, self._node.base_frame_id)
        if traversal is not None:
            self._traversals.publish(traversal)
        elif self._search_is(IN_SEARCH):
            rospy.logwarn("the search cannot follow the robot to this meetpoint: it is asked to begin anew")
            threading.Thread(target=self._restart_search, daemon=True).start()
            return  # it will wait for a meetpoint then
        self._report_meetpoint()

    def _report_meetpoint(self) -> None:
        assert self._arrival is not None
        self._meetpoints.publish(driver_messages.meetpoint_msg(self._arrival, self._node.base_frame_id))
        self._reported_s = self._now_s

    def _restart_search(self) -> None:
        name = rospy.resolve_name("restart_search")
        try:
            rospy.wait_for_service(name, RESTART_WAIT_S)
            answer = rospy.ServiceProxy(name, Trigger)()
            if not answer.success:
                rospy.logwarn(f"the search does not begin anew: {answer.message}")
        except (rospy.ROSException, rospy.ServiceException) as err:
            rospy.logwarn(f"the search does not begin anew, call ~restart of the topology node: {err}")

    @property
    def _stands_at_meetpoint(self) -> bool:
        return self._arrival is not None and self._driver.progress.phase == edge_driver.ARRIVED

    def _search_is(self, states: Sequence[int]) -> bool:
        """Whether there is a search that the robot drives for, in one of these states."""
        return self._node.follow_turn_choice and self._topology is not None and self._topology.state in states

    def _decide(self) -> None:
        """Nothing is on: does a search wait for the robot, or did its edge lead nowhere?"""
        waits = self._search_is((TopologyStatus.WAITING,))
        if (
            self._arrival is not None
            and self._odom_from_base is not None
            and float(np.hypot(*(self._odom_from_base - self._arrived_at)[:2])) > MOVED_M
        ):
            self._driver.stop()
            self._arrival = None
            self._tell(IDLE, "the robot was moved away from its meetpoint")
        if self._stands_at_meetpoint:
            if waits and self._now_s - self._reported_s > REPORT_AGAIN_S:
                self._report_meetpoint()
        elif self._node.seek_at_start and self._seeking.is_due(waits, self._search_is(IN_SEARCH)):
            self._seeking.seeks()
            self._begin(EdgeTask(self._driver, self._p.recovery, self._p.edge.limits), "~seek_at_start")

    # -- the control step

    def _control(self) -> None:
        dt_s = min(max(self._now_s - self._controlled_s, 1e-3), LONGEST_STEP_S)
        self._controlled_s = self._now_s
        self._look_up_odometry()
        if self._job is None:
            trouble = self._no_input()
            if trouble is None:
                self._decide()
            elif not self._seeking.sought and self._node.seek_at_start:
                self._tell(HALTED, trouble)
        job = self._job
        if job is None:
            if self._now_s < self._quiet_from_s:
                self._send(np.zeros(3))
        else:
            self._step(job, dt_s)
        if self._status_pace.is_due(self._now_s, STATUS_PERIOD_S) and self._job is not None:
            self._send_status()
        if self._markers.get_num_connections() and self._markers_pace.is_due(self._now_s, MARKERS_PERIOD_S):
            self._show()

    def _step(self, job: _Job, dt_s: float) -> None:
        """One control step of a task: a command, or a halt."""
        trouble, code = self._no_input(), NO_INPUT
        if trouble is None and job.task.needs_pose:
            trouble, code = self._pose_unknown(), NOT_LOCALIZED
        if trouble is not None:
            self._halt(job, trouble, code)
            return
        job.halted_since_s = math.nan
        assert self._odom_from_base is not None
        command = job.task.step(
            Moment(self._odom_from_base, self._map_from_base() if job.task.needs_pose else None, self._velocity, dt_s)
        )
        if job.task.outcome is not None:
            self._finish(job.task.outcome)
            return
        if job.task.steers:
            self._send(command)
        self._tell(job.task.state, job.task.reason, job.name)

    def _halt(self, job: _Job, trouble: str, code: str) -> None:
        self._send(np.zeros(3))
        if math.isnan(job.halted_since_s):
            job.halted_since_s = self._now_s
            self._log.warn(f"{job.name} halts: {trouble}")
        self._tell(HALTED, trouble, job.name)
        waited_s = self._now_s - job.halted_since_s
        if not job.task.steers:
            job.task.cancel()
            self._finish(Outcome(code, trouble))
        elif job.server is not None and waited_s > self._node.patience_s:
            self._finish(Outcome(code, f"{trouble}, for {waited_s:.0f} s"))

    def _no_input(self) -> Optional[str]:
        """Why the robot cannot be driven at all; None if it can."""
        if self._seen_ns == 0:
            return self._scans.trouble
        age_s = self._now_s - self._seen_ns * 1e-9
        if age_s > self._node.scan_timeout_s:
            return f"the last scan is {age_s:.1f} s old"
        age_s = self._now_s - self._odometry_ns * 1e-9
        if self._odom_from_base is None or age_s > self._node.odometry_timeout_s:
            return f"no transform {self._node.odom_frame_id} <- {self._node.base_frame_id}" + (
                f" for {age_s:.1f} s" if self._odometry_ns else ""
            )
        return None

    @property
    def _localization_is_silent(self) -> bool:
        return bool(self._localization) and self._now_s - self._localization_s > self._node.status_timeout_s

    def _pose_unknown(self) -> Optional[str]:
        """Why there is no pose in the map; None if there is one."""
        if not self._localization:
            return f"no word on {rospy.resolve_name('localization_status')}"
        if self._localization_is_silent:
            return f"the localization is silent for {self._now_s - self._localization_s:.1f} s"
        if self._localization not in POSE_STATES:
            return f"the localization is {self._localization}" + (
                f": {self._localization_reason}" if self._localization_reason else ""
            )
        if self._map_from_base() is None:
            return f"no transform {self._node.global_frame_id} <- {self._node.odom_frame_id}"
        return None

    def _look_up_odometry(self) -> None:
        try:
            newest = self._tf.lookup_transform(self._node.odom_frame_id, self._node.base_frame_id, rospy.Time(0))
            self._odom_from_base = conversions.planar_from_transform(newest.transform)
        except (tf2_ros.TransformException, ValueError) as err:
            self._log.warn(f"odometry: {err}")
            return
        stamp_ns, before = conversions.ns_from_stamp(newest.header.stamp), self._odometry_pose
        if self._job is not None and before is not None:
            self._job.travelled_m += float(np.hypot(*(self._odom_from_base - before)[:2]))
        self._odometry_ns, self._odometry_pose = stamp_ns, self._odom_from_base

    def _map_from_base(self) -> Optional[np.ndarray]:
        """(3,) now; None without a transform."""
        if self._odom_from_base is None:
            return None
        try:
            map_from_odom = self._tf.lookup_transform(
                self._node.global_frame_id, self._node.odom_frame_id, rospy.Time(0)
            )
            return se2.compose(conversions.planar_from_transform(map_from_odom.transform), self._odom_from_base)
        except (tf2_ros.TransformException, ValueError):
            return None

    # -- scans

    def _see(self, mail: "Dict[str, list[Any]]") -> None:
        """What came in, from whichever of the two topics is to be believed now."""
        for lane, source in (("scans", self._scans), ("surfaces", self._surfaces)):
            for msg in mail[lane]:
                if source.receive(msg, self._now_s, None):
                    self._reset(f"the last {STALE_SCANS} scans are older than the one before them")
        surfaces = (
            self._localization == "LOCALIZED"
            and self._surfaces.counts.received > 0
            and self._now_s - self._localization_s < self._node.status_timeout_s
            and self._now_s - self._surfaces.last_arrival_s < self._node.scan_timeout_s
        )
        for source in (self._scans, self._surfaces):
            for msg in source.take_ready(self._now_s):
                if (source is self._surfaces) == surfaces:
                    self._take_scan(source, msg)

    def _take_scan(self, source: ScanInput, msg: LaserScan) -> None:
        try:
            placed = source.place(msg)
        except ScanError as err:
            source.refuse(str(err))
            return
        if placed.scan.stamp_ns <= self._seen_ns:  # the other topic had it already
            return
        source.counts.used += 1
        self._seen_ns = placed.scan.stamp_ns
        self._driver.see(placed.scan, placed.odom_from_base)

    # -- time

    def _clock_jumped_back(self) -> bool:
        before_s, self._now_s = self._now_s, rospy.get_time()
        if before_s == 0.0:  # the first /clock
            self._scans.last_arrival_s = self._surfaces.last_arrival_s = self._controlled_s = self._now_s
        if self._now_s >= before_s - TIME_JUMP_S:
            return False
        self._reset(f"time jumped back by {before_s - self._now_s:.3f} s")
        return True

    def _reset(self, why: str) -> None:
        """Odometry and stamps begin anew, and so does the driver."""
        rospy.logwarn(f"{why}: the driver starts over")
        if self._job is not None:
            self._finish(Outcome(RESET, why))
        for source in (self._scans, self._surfaces):
            source.restart(self._now_s)
        self._tf.clear()
        self._driver.reset()
        self._arrival, self._odom_from_base, self._odometry_pose = None, None, None
        self._seen_ns = self._odometry_ns = 0
        self._seeking.reset()
        self._localization, self._localization_s, self._reported_s = "", -math.inf, -math.inf
        self._controlled_s = self._now_s
        self._quiet_from_s = self._now_s + QUIET_S

    # -- output

    def _stand(self) -> None:
        """At once."""
        self._send(np.zeros(3))
        self._quiet_from_s = self._now_s + QUIET_S

    def _send(self, velocity: np.ndarray) -> None:
        self._velocity = velocity
        self._commands.publish(driver_messages.twist_msg(velocity))

    def _tell(self, state: str, reason: str, task: str = "") -> None:
        """~status, if it changed."""
        changed = self._said[0] != state or self._said[2] != task or (self._job is None and self._said[1] != reason)
        self._said = state, reason, task
        if changed:
            self._send_status()

    def _send_status(self) -> None:
        self._status.publish(self._status_msg())
        job = self._job
        if job is not None and job.server is not None and job.server.is_active():
            kind = GotoNodeFeedback if job.server is self._goto_server else TraverseEdgeFeedback
            job.server.publish_feedback(kind(self._status_msg()))

    def _status_msg(self) -> DriverStatus:
        state, reason, task = self._said
        travelled_m = 0.0 if self._job is None else self._job.travelled_m
        remaining_m = math.nan if self._job is None else self._job.task.remaining_m
        return driver_messages.status_msg(
            state, reason, task, travelled_m, remaining_m, self._seen_ns, self._node.base_frame_id
        )

    def _show(self) -> None:
        if self._odom_from_base is None:
            return
        task = None if self._job is None else self._job.task
        route_m = task.route.polyline_m if isinstance(task, GoTask) and task.route is not None else None
        self._markers.publish(
            driver_displays.driver_markers(
                self._driver,
                route_m,
                self._odom_from_base,
                f"{self._said[0]}\n{self._said[1]}",
                self._node.odom_frame_id,
                self._node.global_frame_id,
            )
        )

    def _report(self) -> None:
        """/diagnostics, once a second."""
        if time.monotonic() < self._next_report_s:
            return
        self._next_report_s = time.monotonic() + 1.0
        if self._now_s - self._scans.last_arrival_s > 5.0:
            self._log.warn(self._scans.silence(self._now_s), 15.0)
        state, reason, task = self._said
        level = {
            FAILED: DiagnosticStatus.ERROR,
            HALTED: DiagnosticStatus.ERROR,
            "RECOVERING": DiagnosticStatus.WARN,
        }.get(state, DiagnosticStatus.OK)
        values = {
            "task": task,
            "localization": self._localization,
            **{f"scans {name}": count for name, count in vars(self._scans.counts).items()},
        }
        msg = DiagnosticArray(
            status=[
                DiagnosticStatus(
                    level=level,
                    name=f"{rospy.get_name().strip('/')}: driver",
                    message=f"{state}: {reason}",
                    hardware_id="none",
                    values=[KeyValue(key, str(value)) for key, value in values.items()],
                )
            ]
        )
        msg.header.stamp = rospy.Time.now()  # of the report, not of the data
        self._diagnostics.publish(msg)


def main() -> None:
    """Start the node; exit code 2 if a parameter cannot be used, 3 if the atlas cannot."""
    shutdown.run_node(
        "driver", lambda given: DriverNode(params.load(DriverParams, given, rospy.get_name())), (AtlasError, OSError)
    )
