"""topology_node: finds out where in an atlas a robot woke up.

Wiring only: SearchSession decides. Callbacks store messages; only one loop uses the session.

Subscribes: meetpoint (Meetpoint), edge_traversal (EdgeTraversal): of the driver, or by hand; in either order, the
    traversal and the meetpoint at its end belong together. map (OccupancyGrid, if ~check_map): the atlas must be made
    from it. scan (LaserScan), tf ~odom_frame_id <- ~base_frame_id <- laser, and map, if ~use_scans: scans from
    anywhere, at meetpoints and between them, are evidence. node_visits (NodeVisits): for the statistics of the atlas.
Publishes: turn_choice (TurnChoice): the answer to each meetpoint during a search;
    initialpose (PoseWithCovarianceStamped) once when CONFIRMED, with the stamp of the meetpoint or scan;
    ~candidates (TopologyCandidates, latched), ~status (TopologyStatus, latched), ~markers (MarkerArray, latched):
    see topology_displays.py for the namespaces; tf map -> map_atlas (static, the same frame): rviz knows the frame map
    before the pose is known; legend (Image, latched): the legend of the markers.
Action: localize_globally (LocalizeGlobally): begins a search; feedback is ~status; succeeds when CONFIRMED, is aborted
    when AMBIGUOUS or LOST, and when preempted the search is over.
Services: ~restart (Trigger): forget the search, the next meetpoint begins one; ~reload_atlas (Trigger): read the file
    that the parameter ~atlas names by now; if it cannot be used, the old atlas stays.
Parameters: TopologyParams, read once; explained in config/topology.yaml.
"""

from __future__ import annotations

import itertools
import threading
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

import actionlib
import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav import params
from glass_nav.log_line import LogLine
from glass_nav.msg import (
    EdgeTraversal,
    LocalizeGloballyAction,
    LocalizeGloballyFeedback,
    LocalizeGloballyResult,
    Meetpoint,
    NodeVisits,
    TopologyCandidates,
    TopologyStatus,
    TurnChoice,
)
from glass_nav.ros import action_status, command_line, conversions, legend, mailbox, shutdown
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.loop_clock import LoopClock
from glass_nav.ros.mailbox import Mailbox
from glass_nav.ros.topology import topology_displays, topology_messages, topology_params
from glass_nav.ros.topology.scan_memory import ScanMemory
from glass_nav.ros.topology.topology_params import TopologyParams
from glass_nav.topology import observations, search_decisions
from glass_nav.topology.atlas import atlas_builder, atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas, AtlasError
from glass_nav.topology.observations import ObservationError
from glass_nav.topology.search_decisions import Decision, GoalOutcome, SearchStatus
from glass_nav.topology.search_scene import SearchScene
from glass_nav.topology.search_session import Goal, SearchSession

SERVICE_TIMEOUT_S = 30.0
FROM_MAP = "map"  # in place of a file: the atlas is made of the map that is served
LAST_WORDS_S = 2.0  # by the wall clock, for others to hear the status


class TopologyNode:
    """Wiring only: a report in, one call of the session, its decisions out."""

    def __init__(self, p: TopologyParams) -> None:
        self._p = p.node
        made = self._atlas_name == FROM_MAP
        self._session = SearchSession(None if made else self._read_atlas, p.session, p.search)
        self._scans = ScanMemory(p.node.odom_frame_id) if self._session.takes_scans else None
        self._base_frame = p.node.base_frame_id  # or that of the last meetpoint
        self._shown_atlas: Optional[Atlas] = None
        self._atlas_markers: List[Marker] = []  # of that atlas
        self._scene = SearchScene()
        self._log = LogThrottle()
        self._inbox = Mailbox(reports=100, commands=100)  # reports: meetpoints and traversals, in order
        self._clock = LoopClock()

        self._turns = rospy.Publisher("turn_choice", TurnChoice, queue_size=5)
        self._poses = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=2)
        self._candidates = rospy.Publisher("~candidates", TopologyCandidates, queue_size=2, latch=True)
        self._status = rospy.Publisher("~status", TopologyStatus, queue_size=10, latch=True)
        self._markers = rospy.Publisher("~markers", MarkerArray, queue_size=2, latch=True)
        self._frame = tf2_ros.StaticTransformBroadcaster()  # the frame map exists before the pose is known
        self._frame.sendTransform(
            conversions.transform_stamped(0, p.node.global_frame_id, f"{p.node.global_frame_id}_atlas", np.zeros(3))
        )
        self._legends = legend.publish(p.node.global_frame_id)
        self._server = actionlib.SimpleActionServer("localize_globally", LocalizeGloballyAction, auto_start=False)
        self._server.register_goal_callback(lambda: self._inbox.put("commands", self._accept_goal))
        self._server.register_preempt_callback(lambda: self._inbox.put("commands", self._preempt))
        self._carry_out_as = {
            search_decisions.SearchStatus: self._publish,
            search_decisions.Progress: self._send_feedback,
            search_decisions.Turn: self._publish_turn,
            search_decisions.InitialPose: self._publish_pose,
            search_decisions.GoalEnd: self._end_goal,
            search_decisions.AtlasRequest: self._make_atlas,
            LogLine: self._log.write,
        }
        self._carry_out(self._session.start())
        rospy.Service("~restart", Trigger, self._service(self._restart))
        rospy.Service("~reload_atlas", Trigger, self._service(self._reload_atlas))
        action_status.start(self._server)
        # Subscribers last: they may fire at once.
        for topic, kind, take in (
            ("meetpoint", Meetpoint, self._take_meetpoint),
            ("edge_traversal", EdgeTraversal, self._take_traversal),
            ("node_visits", NodeVisits, self._take_visits),
        ):
            rospy.Subscriber(topic, kind, self._put_report, callback_args=take, queue_size=10, tcp_nodelay=True)
        if p.session.check_map or self._session.takes_scans or made:
            rospy.Subscriber(
                "map",
                OccupancyGrid,
                lambda msg: self._inbox.put("commands", lambda: self._take_map(msg)),
                queue_size=1,
                buff_size=2**24,
            )

    def run(self, ending: threading.Event) -> None:
        """The only thread that touches the session; returns when ROS shuts down or ending is set.

        Raises:
            AtlasError: the atlas is refused, and ~end_without_atlas.
        """
        while not (rospy.is_shutdown() or ending.is_set()):
            mail = self._inbox.take(timeout_s=0.1)
            jump = self._clock.tick()
            if jump is not None:
                if self._scans is not None:
                    self._scans.forget()
                self._carry_out(self._session.time_jumped_back(jump))
            for work in [*mail["commands"], *mail["reports"]]:
                work()
            self._look()
            if self._session.is_to_end:
                ending.wait(LAST_WORDS_S)
                raise AtlasError(self._session.status.reason)

    # -- events

    def _look(self) -> None:
        """Process the newest scan."""
        if self._scans is None or not self._session.is_looking:
            return
        placed = self._scans.newest(self._base_frame)
        if placed is not None:
            self._scene.saw(placed.scan.points_in_base()[placed.scan.answered], placed.odom_from_base)
            self._carry_out(self._session.scan(placed.scan, placed.odom_from_base))

    def _put_report(self, msg: Any, take: Callable[[Any], None]) -> None:
        self._inbox.put("reports", lambda: take(msg))

    def _take_meetpoint(self, msg: Meetpoint) -> None:
        try:
            meetpoint = topology_messages.meetpoint_from_msg(msg)
        except ObservationError as err:
            self._log.warn(f"meetpoint refused: {err}")
            return
        self._base_frame = msg.header.frame_id
        self._carry_out(self._session.meetpoint(self._with_scan(meetpoint, msg)))

    def _with_scan(self, meetpoint: observations.Meetpoint, msg: Meetpoint) -> observations.Meetpoint:
        """The meetpoint with the scan of its stamp, if that can be used."""
        if self._scans is None or not self._session.uses_scans or not meetpoint.stamp_ns:
            return meetpoint
        scan, why_not = self._scans.at(msg.header.stamp, msg.header.frame_id)
        if scan is None:
            self._log.warn(f"the scan at this meetpoint is not used as evidence: {why_not}")
        return replace(meetpoint, scan=scan)

    def _take_traversal(self, msg: EdgeTraversal) -> None:
        try:
            traversal = topology_messages.traversal_from_msg(msg, self._session.choice)
        except ObservationError as err:
            self._log.warn(f"edge_traversal refused: {err}")
            return
        self._carry_out(self._session.edge_traversal(traversal, conversions.ns_from_stamp(msg.header.stamp)))

    def _take_visits(self, msg: NodeVisits) -> None:
        if len(msg.node) != len(msg.r):
            self._log.warn(f"node_visits refused: {len(msg.node)} nodes need as many r, got {len(msg.r)}")
            return
        self._carry_out(self._session.node_visits(np.array(msg.node, np.int64), np.array(msg.r, float)))

    def _take_map(self, msg: OccupancyGrid) -> None:
        topic = rospy.resolve_name("map")
        try:
            grid_map = conversions.map_from_msg(msg)
        except ValueError as err:
            rospy.logerr(f"the map of topic {topic} is refused: {err}")
            return
        self._carry_out(self._session.map_served(grid_map, f"that of topic {topic}"))

    def _accept_goal(self) -> None:
        if self._server.is_new_goal_available():  # it was not cancelled since, nor accepted for an earlier call
            goal = self._server.accept_new_goal()
            self._carry_out(self._session.goal(Goal(goal.here, goal.max_edges)))

    def _preempt(self) -> None:
        if self._server.is_preempt_requested() and not self._server.is_new_goal_available():
            self._carry_out(self._session.preempt())

    def _service(self, work: Callable[[], str]) -> Callable[[TriggerRequest], TriggerResponse]:
        """A service whose work is done by the run loop; `work` returns its response."""

        def serve(_request: TriggerRequest) -> TriggerResponse:
            try:
                message = mailbox.outcome(self._inbox.submit("commands", work), SERVICE_TIMEOUT_S)
            except (ValueError, TimeoutError) as err:
                return TriggerResponse(success=False, message=str(err))
            return TriggerResponse(success=True, message=message)

        return serve

    def _restart(self) -> str:
        self._carry_out(self._session.restart())
        return self._session.status.reason

    def _reload_atlas(self) -> str:
        try:
            decisions = self._session.reload_atlas()
        except (ValueError, OSError) as err:
            rospy.logerr(f"reload_atlas refused: {err}")
            raise ValueError(str(err)) from err
        self._carry_out(decisions)
        return self._session.status.reason

    @property
    def _atlas_name(self) -> str:
        return str(rospy.get_param("~atlas", self._p.atlas))

    def _make_atlas(self, request: search_decisions.AtlasRequest) -> None:
        """Build the atlas outside of the run loop; for a large map it takes a minute."""

        @contextmanager
        def watched(what: str, steps: int) -> Iterator[Callable[[], None]]:
            rospy.loginfo(f"building the atlas: {what}, {steps} steps")
            done = itertools.count(1)
            yield lambda: rospy.loginfo_throttle(5.0, f"building the atlas: {what}, {next(done)} of {steps} steps")

        def make() -> None:
            made: "Atlas | AtlasError"
            try:
                made, _ = atlas_builder.build(request.grid_map, FROM_MAP, FROM_MAP, watch=watched)
            except AtlasError as err:
                made = err
            self._inbox.put("commands", lambda: self._carry_out(self._session.atlas_made(request.grid_map, made)))

        threading.Thread(target=make, daemon=True).start()

    def _read_atlas(self) -> Tuple[str, Atlas]:
        """Raises AtlasError; ValueError without a name."""
        name = self._atlas_name
        if not name:
            raise ValueError("~atlas must be a file, a folder or the name of a shipped atlas, got ''")
        path = shipped_atlases.find(name)
        return str(path), atlas_file.load(path)

    # -- decisions

    def _carry_out(self, decisions: List[Decision]) -> None:
        for decision in decisions:
            self._carry_out_as[type(decision)](decision)

    def _publish(self, status: SearchStatus) -> None:
        """Publish status, candidates and markers, latched."""
        frame, localizer = self._p.global_frame_id, self._session.localizer
        if status.estimate is None and status.belief is None:
            self._scene.forget()
        if localizer is not None and status.estimate is not None:
            self._scene.stepped(localizer)
        self._status.publish(topology_messages.status_msg(status, frame))
        self._candidates.publish(topology_messages.candidates_msg(status, self._atlas, frame, self._scene.ruled_out))
        if localizer is None:
            return
        if localizer.atlas is not self._shown_atlas:  # its markers are made once, and sent with those of each step
            self._shown_atlas = localizer.atlas
            self._atlas_markers = topology_displays.atlas_markers(localizer.atlas, frame)
        self._markers.publish(
            topology_displays.search_markers(localizer, status, self._scene, frame, self._atlas_markers)
        )

    def _send_feedback(self, progress: search_decisions.Progress) -> None:
        status = topology_messages.status_msg(progress.status, self._p.global_frame_id)
        self._server.publish_feedback(LocalizeGloballyFeedback(status))

    def _publish_turn(self, turn: search_decisions.Turn) -> None:
        self._turns.publish(topology_messages.turn_choice_msg(turn, self._base_frame))

    def _publish_pose(self, pose: search_decisions.InitialPose) -> None:
        self._poses.publish(self._pose_msg(pose.map_from_base, pose.stamp_ns))

    def _end_goal(self, end: search_decisions.GoalEnd) -> None:
        status, frame = end.status, self._p.global_frame_id
        result = LocalizeGloballyResult(
            status=topology_messages.status_msg(status, frame),
            candidates=topology_messages.candidates_msg(status, self._atlas, frame),
        )
        if status.map_from_base is not None:
            result.pose = self._pose_msg(status.map_from_base, status.stamp_ns)
        {
            GoalOutcome.SUCCEEDED: self._server.set_succeeded,
            GoalOutcome.ABORTED: self._server.set_aborted,
            GoalOutcome.PREEMPTED: self._server.set_preempted,
        }[end.outcome](result, end.reason)

    def _pose_msg(self, map_from_base: np.ndarray, stamp_ns: int) -> PoseWithCovarianceStamped:
        p = self._p
        return topology_messages.pose_msg(
            map_from_base, p.initial_pose_sigma_m, p.initial_pose_sigma_rad, stamp_ns, p.global_frame_id
        )

    @property
    def _atlas(self) -> Optional[Atlas]:
        return None if self._session.localizer is None else self._session.localizer.atlas


def main() -> None:
    """Start the node; exit code 2 if a parameter cannot be used, 3 if the atlas cannot, see ~end_without_atlas too."""
    if command_line.answers_help(__doc__):
        return
    shutdown.run_node("topology", _node, (AtlasError, OSError))


def _node(given: Dict[str, Any]) -> TopologyNode:
    kept, gone = topology_params.without_gone(given)
    for line in gone:
        rospy.logwarn(line)
    return TopologyNode(params.load(TopologyParams, kept, rospy.get_name()))
