"""topology_node: where in the atlas is a robot that woke up somewhere?

Wiring only; the answer comes from AtlasLocalizer. Callbacks store, one loop works: nothing else touches the search.

Subscribes: meetpoint (Meetpoint), edge_traversal (EdgeTraversal): of the driver, or by hand; in either order, the
    traversal and the meetpoint at its end belong together. map (OccupancyGrid, if ~check_map): the atlas must be its.
    scan (LaserScan), tf ~odom_frame_id <- frame of the meetpoint <- laser, and map, if ~judge_by_scans: candidates from
    where the map does not explain the scan of a meetpoint's stamp are ruled out; where meetpoints have odometry, the
    poses that explain the scans are followed from one to the next, too.
Publishes: turn_choice (TurnChoice): the answer to each meetpoint while there is something to find out;
    initialpose (PoseWithCovarianceStamped) once when CONFIRMED, with the stamp of the meetpoint;
    ~candidates (TopologyCandidates, latched), ~status (TopologyStatus, latched), ~markers (MarkerArray, latched):
    see topology_displays.py for the namespaces.
Action: localize_globally (LocalizeGlobally): begins a search; feedback is ~status; succeeds when CONFIRMED, is aborted
    when AMBIGUOUS or LOST, and when preempted the search is over.
Services: ~restart (Trigger): forget the search, the next meetpoint begins one; ~reload_atlas (Trigger): read the file
    that the parameter ~atlas names by now; if it cannot be used, the old atlas stays.
Parameters: TopologyNodeParams and SearchParams, read once; explained in config/topology.yaml.
"""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any, Callable, Optional

import actionlib
import numpy as np
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse
from visualization_msgs.msg import MarkerArray

from glass_nav import params
from glass_nav.msg import (
    EdgeTraversal,
    LocalizeGloballyAction,
    LocalizeGloballyFeedback,
    LocalizeGloballyGoal,
    LocalizeGloballyResult,
    Meetpoint,
    TopologyCandidates,
    TopologyStatus,
    TurnChoice,
)
from glass_nav.ros import action_status, conversions, shutdown
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.mailbox import Errand, Mailbox
from glass_nav.ros.topology import topology_displays, topology_messages
from glass_nav.ros.topology.scan_memory import ScanMemory
from glass_nav.ros.topology.served_explanation import ServedExplanation
from glass_nav.ros.topology.topology_params import TopologyParams
from glass_nav.topology import observations
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import AtlasError
from glass_nav.topology.observations import ObservationError
from glass_nav.topology.search.atlas_localizer import CONFIRMED, AtlasLocalizer, Estimate

NO_ATLAS, IDLE, WAITING = "NO_ATLAS", "IDLE", "WAITING"  # beside those of the localizer
TIME_JUMP_S = 0.5  # a clock that goes back by less is noise between machines
ERRAND_TIMEOUT_S = 30.0


class TopologyNode:
    """Wiring only: a meetpoint and an edge in, one call of the core, a turn out."""

    def __init__(self, p: TopologyParams) -> None:
        self._p, self._search_params = p.node, p.search
        self._map_fingerprint: Optional[str] = None
        self._explanation = ServedExplanation()
        self._scans = ScanMemory(p.node.odom_frame_id) if p.node.judge_by_scans else None
        self._localizer: Optional[AtlasLocalizer] = self._loaded(p.node.atlas)
        self._show_atlas()
        self._state, self._reason = IDLE, "no search was asked for"
        self._estimate: Optional[Estimate] = None  # of the search that is on
        self._meetpoint: Optional[Meetpoint] = None  # the last that was used or could have been
        self._waiting_meetpoint: Optional[Meetpoint] = None  # for its traversal
        self._waiting_traversal: Optional[EdgeTraversal] = None  # for its meetpoint
        self._goal: Optional[LocalizeGloballyGoal] = None
        self._log = LogThrottle()
        self._inbox = Mailbox(reports=100, commands=100)  # reports: meetpoints and traversals, in order
        self._now_s = rospy.get_time()

        self._turns = rospy.Publisher("turn_choice", TurnChoice, queue_size=5)
        self._poses = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=2)
        self._candidates = rospy.Publisher("~candidates", TopologyCandidates, queue_size=2, latch=True)
        self._status = rospy.Publisher("~status", TopologyStatus, queue_size=10, latch=True)
        self._markers = rospy.Publisher("~markers", MarkerArray, queue_size=2, latch=True)
        self._server = actionlib.SimpleActionServer("localize_globally", LocalizeGloballyAction, auto_start=False)
        self._server.register_goal_callback(lambda: self._inbox.put("commands", self._accept_goal))
        self._server.register_preempt_callback(lambda: self._inbox.put("commands", self._preempt))
        if self._p.search_at_start:
            self._begin("the node has started")
        else:
            self._publish(0)
        rospy.Service("~restart", Trigger, self._errand(self._restart))
        rospy.Service("~reload_atlas", Trigger, self._errand(self._reload_atlas))
        action_status.start(self._server)
        # Subscribers last: they may fire at once.
        rospy.Subscriber(
            "meetpoint", Meetpoint, lambda msg: self._inbox.put("reports", msg), queue_size=10, tcp_nodelay=True
        )
        rospy.Subscriber(
            "edge_traversal",
            EdgeTraversal,
            lambda msg: self._inbox.put("reports", msg),
            queue_size=10,
            tcp_nodelay=True,
        )
        if self._p.check_map or self._p.judge_by_scans:
            rospy.Subscriber(
                "map",
                OccupancyGrid,
                lambda msg: self._inbox.put("commands", lambda: self._check_map(msg)),
                queue_size=1,
                buff_size=2**24,
            )

    def run(self, ending: threading.Event) -> None:
        """The only thread that touches the search; returns when ROS shuts down or ending is set."""
        while not (rospy.is_shutdown() or ending.is_set()):
            mail = self._inbox.take(timeout_s=0.1)
            before_s, self._now_s = self._now_s, rospy.get_time()
            if self._now_s < before_s - TIME_JUMP_S and self._localizer is not None:
                self._begin(f"time jumped back by {before_s - self._now_s:.3f} s")
            for command in mail["commands"]:
                command()
            for msg in mail["reports"]:
                self._take_report(msg)

    # -- commands

    def _errand(self, work: Callable[[], str]) -> Callable[[TriggerRequest], TriggerResponse]:
        """A service that has the run loop do something and gives back what it says."""

        def serve(_request: TriggerRequest) -> TriggerResponse:
            said = []
            errand = Errand(lambda: said.append(work()))
            self._inbox.put("commands", errand.run)
            try:
                errand.wait(ERRAND_TIMEOUT_S)
            except (ValueError, TimeoutError) as err:
                return TriggerResponse(success=False, message=str(err))
            return TriggerResponse(success=True, message=said[0])

        return serve

    def _restart(self) -> str:
        if self._localizer is None:
            raise ValueError(self._reason)
        self._begin("restarted by service")
        return "the next meetpoint begins a search"

    def _begin(self, why: str) -> None:
        """Forget the search; the next meetpoint begins one."""
        self._forget()
        self._set_state(WAITING, f"the next meetpoint begins a search: {why}")

    def _forget(self) -> None:
        self._estimate, self._waiting_meetpoint, self._waiting_traversal = None, None, None

    def _accept_goal(self) -> None:
        if not self._server.is_new_goal_available():  # another one came since, or it was cancelled
            return
        self._goal = self._server.accept_new_goal()
        meetpoint = self._meetpoint
        if self._localizer is None:
            self._finish_goal(self._reason)
        elif self._goal.here and meetpoint is None:
            self._finish_goal("no meetpoint was reported yet, where a search could begin")
        else:
            self._begin("asked for by the action")
            if self._goal.here:
                self._take_report(meetpoint)

    def _preempt(self) -> None:
        if self._goal is None or not self._server.is_preempt_requested() or self._server.is_new_goal_available():
            return
        self._goal = None
        self._forget()
        self._set_state(IDLE, "the search was preempted")
        self._server.set_preempted(self._result(), self._reason)

    def _finish_goal(self, text: str, succeeded: bool = False) -> None:
        if self._goal is None:
            return
        self._goal = None
        (self._server.set_succeeded if succeeded else self._server.set_aborted)(self._result(), text)

    # -- atlas and map

    def _loaded(self, name: str) -> AtlasLocalizer:
        """Raises AtlasError; ValueError without a name."""
        if not name:
            raise ValueError("~atlas must be a file, a folder or the name of a shipped atlas, got ''")
        path = shipped_atlases.find(name)
        atlas = atlas_file.load(path)
        if self._map_fingerprint is not None:
            try:
                atlas.refuse_other_map(self._map_fingerprint, f"that of topic {rospy.resolve_name('map')}")
            except AtlasError as err:
                raise AtlasError(f"{path}: {err}") from err
        rospy.loginfo(f"{path}: {len(atlas.nodes)} nodes, {len(atlas.edges)} edges")
        if not self._p.judge_by_scans:
            return AtlasLocalizer(atlas, self._search_params)
        return AtlasLocalizer(atlas, self._search_params, self._explanation.shares, self._explanation)

    def _show_atlas(self) -> None:
        """Work out its markers, which are sent with those of each step."""
        assert self._localizer is not None
        self._atlas_markers = topology_displays.atlas_markers(self._localizer.atlas, self._p.global_frame_id)

    def _reload_atlas(self) -> str:
        name = str(rospy.get_param("~atlas", self._p.atlas))
        try:
            self._localizer = self._loaded(name)
        except (ValueError, OSError) as err:
            rospy.logerr(f"reload_atlas refused: {err}")
            raise ValueError(str(err)) from err
        self._show_atlas()
        self._begin("the atlas was reloaded")
        return f"{name}: {len(self._localizer.atlas.nodes)} nodes"

    def _check_map(self, msg: OccupancyGrid) -> None:
        """A map came: is the atlas one of it?"""
        topic = rospy.resolve_name("map")
        try:
            grid_map = conversions.map_from_msg(msg)
            if self._p.judge_by_scans:
                self._explanation.take(grid_map)
            if not self._p.check_map:
                return
            self._map_fingerprint = grid_map.fingerprint
            if self._localizer is not None:
                self._localizer.atlas.refuse_other_map(self._map_fingerprint, f"that of topic {topic}")
            elif self._state == NO_ATLAS:
                self._localizer = self._loaded(str(rospy.get_param("~atlas", self._p.atlas)))
                self._show_atlas()
                self._begin("there is another map")
        except (AtlasError, OSError) as err:
            rospy.logerr(f"atlas refused: {err}")
            self._localizer = None
            self._forget()
            self._set_state(NO_ATLAS, f"the atlas {err}")
            self._finish_goal(self._reason)
        except ValueError as err:
            rospy.logerr(f"the map of topic {topic} is refused: {err}")

    # -- reports

    def _take_report(self, msg: Any) -> None:
        """A meetpoint or a traversal; refused in one line if it cannot be true."""
        kind = "meetpoint" if isinstance(msg, Meetpoint) else "edge_traversal"
        try:
            if isinstance(msg, Meetpoint):
                topology_messages.meetpoint_from_msg(msg)
                self._meetpoint = msg
            if self._state == WAITING and isinstance(msg, Meetpoint):
                self._start(msg)
            elif self._estimate is None or self._estimate.done:
                rospy.loginfo_throttle(5.0, f"{kind} not used: the search is {self._state}")
            elif isinstance(msg, Meetpoint):
                self._waiting_meetpoint = msg
                self._step()
            else:
                told = self._estimate.choice
                topology_messages.traversal_from_msg(msg, told)
                self._waiting_traversal = msg
                self._step()
        except ObservationError as err:
            self._log.warn(f"{kind} refused: {err}")

    def _with_scan(self, msg: Meetpoint) -> observations.Meetpoint:
        """The meetpoint, with the scan of its stamp if that can be used."""
        meetpoint = topology_messages.meetpoint_from_msg(msg)
        if self._scans is None or not self._explanation.has_map or not meetpoint.stamp_ns:
            return meetpoint
        scan, why_not = self._scans.at(msg.header.stamp, msg.header.frame_id)
        if scan is None:
            self._log.warn(f"candidates are not judged by the scan at this meetpoint: {why_not}")
        return replace(meetpoint, scan=scan)

    def _start(self, msg: Meetpoint) -> None:
        assert self._localizer is not None
        self._judge(self._localizer.start(self._with_scan(msg)), msg)

    def _step(self) -> None:
        """One edge through the search, once both of its reports are there."""
        meetpoint, traversal = self._waiting_meetpoint, self._waiting_traversal
        if meetpoint is None or traversal is None:
            return
        assert self._localizer is not None and self._estimate is not None
        apart_s = topology_messages.stamps_differ_s(meetpoint, traversal)
        if apart_s > self._p.pairing_tolerance_s:
            older = "meetpoint" if meetpoint.header.stamp < traversal.header.stamp else "traversal"
            setattr(self, f"_waiting_{older}", None)
            self._log.warn(
                f"a {older} is dropped: the edge_traversal and the meetpoint at its end are stamped "
                f"{apart_s:.3f} s apart, allowed ~pairing_tolerance_s {self._p.pairing_tolerance_s:g} s"
            )
            return
        self._waiting_traversal = None
        try:
            estimate = self._localizer.update(
                topology_messages.traversal_from_msg(traversal, self._estimate.choice), self._with_scan(meetpoint)
            )
        except ObservationError as err:  # whichever of the two came last; the meetpoint waits for another traversal
            self._log.warn(f"edge_traversal refused: {err}")
            return
        self._waiting_meetpoint = None
        self._judge(estimate, meetpoint)

    def _judge(self, estimate: Estimate, meetpoint: Meetpoint) -> None:
        """Tell what a step found out."""
        assert self._localizer is not None
        stamp_ns, frame = conversions.ns_from_stamp(meetpoint.header.stamp), self._p.global_frame_id
        given_up = self._goal is not None and not estimate.done and 0 < self._goal.max_edges <= estimate.depth
        if given_up:
            estimate = replace(estimate, choice=None)  # nobody is to drive on
        self._estimate = estimate
        self._set_state(estimate.state, estimate.reason, stamp_ns)
        rospy.loginfo(f"{estimate.depth} edges: {estimate.state}, {estimate.reason}")
        if self._goal is not None and not estimate.done:
            self._server.publish_feedback(LocalizeGloballyFeedback(self._status_msg(stamp_ns)))
        if given_up:
            self._finish_goal(f"not found behind {estimate.depth} edges: {estimate.reason}")
            self._forget()
            self._set_state(IDLE, f"gave up behind {estimate.depth} edges", stamp_ns)
            return
        if estimate.choice is not None:
            self._turns.publish(topology_messages.turn_choice_msg(estimate.choice, stamp_ns, meetpoint.header.frame_id))
        if estimate.state == CONFIRMED:
            self._localizer.count_visits(self._localizer.atlas.visits)
            self._save_visits()
            if self._p.publish_initial_pose:
                self._poses.publish(self._pose_msg(stamp_ns, frame))
        if estimate.done:
            self._finish_goal(estimate.reason, succeeded=estimate.state == CONFIRMED)

    def _save_visits(self) -> None:
        if not self._p.visits_file:
            return
        assert self._localizer is not None
        try:
            atlas_file.save(self._localizer.atlas, self._p.visits_file)
        except OSError as err:
            rospy.logerr(f"the atlas with its statistics is not saved: {self._p.visits_file}: {err.strerror}")

    # -- output

    def _set_state(self, state: str, reason: str, stamp_ns: int = 0) -> None:
        self._state, self._reason = state, reason
        self._publish(stamp_ns)

    def _publish(self, stamp_ns: int) -> None:
        """Status, candidates and markers, all latched: whoever comes later sees what is."""
        self._status.publish(self._status_msg(stamp_ns))
        self._candidates.publish(self._candidates_msg(stamp_ns))
        if self._localizer is None:
            return
        frame = self._p.global_frame_id
        self._markers.publish(
            topology_displays.search_markers(
                self._localizer,
                self._estimate,
                self._listed_poses(),
                frame,
                f"{self._state}\n{self._reason}",
                self._atlas_markers,
            )
        )

    def _status_msg(self, stamp_ns: int) -> TopologyStatus:
        return topology_messages.status_msg(
            self._state, self._reason, stamp_ns, self._p.global_frame_id, self._estimate
        )

    def _candidates_msg(self, stamp_ns: int) -> TopologyCandidates:
        frame = self._p.global_frame_id
        if self._localizer is None or self._estimate is None:
            return TopologyCandidates(header=conversions.header(stamp_ns, frame))
        return topology_messages.candidates_msg(
            self._localizer.atlas, self._estimate, self._listed_poses(), stamp_ns, frame
        )

    def _listed_poses(self) -> np.ndarray:
        if self._localizer is None or self._estimate is None:
            return np.zeros((0, 3))
        return self._localizer.poses(self._estimate, self._p.listed_candidates)

    def _pose_msg(self, stamp_ns: int, frame: str) -> PoseWithCovarianceStamped:
        return topology_messages.pose_msg(
            self._listed_poses()[0], self._p.initial_pose_sigma_m, self._p.initial_pose_sigma_rad, stamp_ns, frame
        )

    def _result(self) -> LocalizeGloballyResult:
        stamp_ns = 0
        if self._estimate is not None and self._meetpoint is not None:
            stamp_ns = conversions.ns_from_stamp(self._meetpoint.header.stamp)
        result = LocalizeGloballyResult(status=self._status_msg(stamp_ns), candidates=self._candidates_msg(stamp_ns))
        if self._state == CONFIRMED:
            result.pose = self._pose_msg(stamp_ns, self._p.global_frame_id)
        return result


def main() -> None:
    """Start the node; exit code 2 if a parameter cannot be used, 3 if the atlas cannot."""
    shutdown.run_node(
        "topology",
        lambda given: TopologyNode(params.load(TopologyParams, given, rospy.get_name())),
        (AtlasError, OSError),
    )
