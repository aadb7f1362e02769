"""localization_node: localizes a robot in a map with walls and glass. Also startable as `amcl`.

Wiring only: the Localizer computes the pose. Callbacks store messages and send tf again; only one loop uses the filter.

Subscribes: scan (LaserScan; or each of ~scan_topics), initialpose (PoseWithCovarianceStamped), map (OccupancyGrid, if
    ~use_map_topic), global_localization_area (PolygonStamped in the map's frame: where to search for the robot),
    landmark_bearings (LandmarkBearings, if ~landmark_file is given), tf odom <- base <- laser, each of ~wheel_topics
    (JointState, an array of two numbers, or a number each), in place of tf odom <- base.
Publishes: amcl_pose (PoseWithCovarianceStamped, latched), particlecloud (PoseArray, latched), tf map -> odom,
    tf odom -> base (if ~publish_wheel_tf),
    ~status (LocalizationStatus, latched), ~beam_cases (BeamCases), /diagnostics;
    scan_surfaces (LaserScan): the scan for a costmap, with each beam cut at the first surface of the map that it
    passed or was mirrored at. Stamp, frame and beams are the scan's; its `intensities` are 0 as measured, 1 cut,
    and -1 for all beams while the state is not LOCALIZED: then it is the raw scan. One for every scan that is
    used; none for a scan that is rejected or has no transforms, because it is unknown where to cut it;
    ~glass_map (OccupancyGrid, latched): probability of glass by wall cell [percent], -1 where unknown, with the cells
    of panes that were found and that the map lacks;
    ~segment_quality (SegmentQuality), while it has subscribers: how well the scan lies on the wall segments of the map;
    for rviz, with subscribers: ~beam_cloud (PointCloud2), ~beam_markers (MarkerArray, a namespace per case
    and one for the status), ~wall_markers (MarkerArray, latched: the known cells of the glass map, and
    the panes that the map lacks), legend and ~legend (Image, latched).
Services: ~save_panes (Trigger: writes ~panes_file), global_localization, request_nomotion_update (Empty), set_map (SetMap), ~locate (Locate: a rough pose
    corrected by wall segments), ~set_parameters (Reconfigure, with
    its topics ~parameter_descriptions and ~parameter_updates). Calls static_map (GetMap).
Parameters: LocalizationNodeParams and LocalizerParams; explained in config/localization.yaml.
"""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple, TypeVar
from xmlrpc.client import MultiCall, ServerProxy

import numpy as np
import rosgraph
import rospkg
import rospy
import tf2_ros
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import SetMap, SetMapRequest, SetMapResponse
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse, Trigger, TriggerRequest, TriggerResponse

from glass_nav import machine
from glass_nav.localization import health, initial_pose
from glass_nav.localization.health import LocalizationHealth, Situation
from glass_nav.localization.pose_memory import PoseMemory
from glass_nav.localization.saved_pose import SavedPose
from glass_nav.localization.session import Inputs, LocalizationSession
from glass_nav.localization.start_hints import what_to_start
from glass_nav.ros import command_line, conversions, mailbox, shutdown
from glass_nav.ros.diagnostics import Diagnostics
from glass_nav.ros.landmarks.bearing_messages import LONGEST_TURN_S
from glass_nav.ros.localization import params, reconfigure
from glass_nav.ros.localization.bearing_input import BearingInput
from glass_nav.ros.localization.map_source import MapSource
from glass_nav.ros.localization.publishers import Publishers
from glass_nav.ros.localization.reconfigure import ReconfigureServer
from glass_nav.ros.localization.segment_service import SegmentService
from glass_nav.ros.localization.sender_watch import SenderWatch
from glass_nav.ros.localization.shown_parameters import ShownParameters
from glass_nav.ros.localization.wheel_input import WheelTransforms
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.loop_clock import LoopClock
from glass_nav.ros.mailbox import Mailbox
from glass_nav.ros.scan_input import ScanInput
from glass_nav.ros.tf_transforms import TfTransforms
from glass_nav.sensing.scan import Scan, ScanError
from glass_nav.sensing.scan_queue import ReadyScan
from glass_nav.srv import LocateRequest
from glass_nav.world import landmark_file
from glass_nav.world.grid_map import GridMap

T = TypeVar("T")
NO_SCAN_WARNING_S = 15.0  # as AMCL
SETTLING_S = 5.0  # a player in a launch file needs some seconds: no warning before
SERVICE_TIMEOUT_S = 30.0


class LocalizationNode:
    """Wiring only: a message in, one call of the core, messages out."""

    def __init__(self, p: params.LocalizationParams) -> None:
        self._p = p
        self._log = LogThrottle()
        self._inbox = Mailbox(scans=100, commands=100)
        self._clock = LoopClock()
        self._started_s = time.monotonic()
        self._next_report_s = 0.0  # by the monotonic clock

        self._tf = tf2_ros.Buffer(rospy.Duration(LONGEST_TURN_S) if p.node.landmark_file else None)
        self._wheels = WheelTransforms(p, self._tf, self._log) if p.wheels.wheel_topics else None
        self._transforms = self._wheels or TfTransforms(self._tf, p.node.odom_frame_id, p.node.base_frame_id)
        max_range_m = p.localizer.limits.laser_max_range
        self._scans = ScanInput(p.node, p.deskew, self._tf, self._log, max_range_m, self._transforms)
        self._bearings = BearingInput(p.node, self._tf, self._transforms, self._log)
        self._maps = MapSource(p.node, self._log, self._use_map)
        self._memory = PoseMemory(p.pose_file, _keep_on_server, lambda line: self._log.warn(line, period_s=60.0))
        self._outputs = Publishers(p.node)
        self._session = LocalizationSession(
            p.session,
            self._transforms.odom_from_base,
            bool(rospy.get_param("/use_sim_time", False)),
            self._clock.now_s,
            self._outputs.start_over,
        )
        self._health = LocalizationHealth(p.node.warn_deviations, self._scans.counts)
        self._diagnostics = Diagnostics(*health.ENTRIES)

        rospy.Service("global_localization", Empty, self._serve_global_localization)
        rospy.Service("request_nomotion_update", Empty, self._serve_nomotion_update)
        rospy.Service("~save_panes", Trigger, self._serve_save_panes)
        rospy.Service("set_map", SetMap, self._serve_set_map)
        self._segments = SegmentService(p.node.global_frame_id, self._scan_and_map)
        self._reconfigure = ReconfigureServer(
            params.changeable(p),
            reconfigure.explanations(_parameter_file()),
            lambda values: self._in_run_loop(lambda: self._take_parameters(values)),
        )
        # Subscribers last: they may fire at once.
        self._listener = tf2_ros.TransformListener(self._tf, tcp_nodelay=True)
        self._sender_watch = SenderWatch(p.node, self._log)
        if self._wheels is not None:
            self._wheels.subscribe()
        self._scans.subscribe(self._take_scan)
        self._bearings.subscribe(self._command(self._bearings.receive))
        rospy.Subscriber("initialpose", PoseWithCovarianceStamped, self._command(self._take_guess), queue_size=2)
        rospy.Subscriber("global_localization_area", PolygonStamped, self._command(self._take_area), queue_size=2)
        if p.node.use_map_topic:
            rospy.Subscriber("map", OccupancyGrid, self._command(self._maps.take_topic), queue_size=1, buff_size=2**24)

    def run(self, ending: threading.Event) -> None:
        """The only thread that touches the filter; returns when ROS shuts down or ending is set."""
        while not (rospy.is_shutdown() or ending.is_set()):
            mail = self._inbox.take(timeout_s=0.01 if self._scans.is_waiting else 0.1)
            if self._clock_jumped_back():
                mail["scans"] = []  # from before the jump
            for command in mail["commands"]:
                command()
            self._maps.request()
            mail["scans"] += self._inbox.take_now("scans")  # loading a new map takes a while
            if self._session.waits_for_pose and mail["scans"]:
                mail["scans"], self._scans.last_arrival_s = [], self._clock.now_s
            for msg in mail["scans"]:
                stale = self._scans.receive(msg, self._clock.now_s, self._session.refusal)
                if stale is not None:
                    self._restart(stale)
            if self._session.refusal is None:
                for ready in self._scans.take_ready(self._clock.now_s):
                    self._step(ready)
            self._send_glass_map()
            self._report()

    def save(self) -> None:
        """The pose and the panes, for the next start."""
        self._memory.save()
        self._session.keep_panes()

    # -- callbacks of other threads: they store, services also wait for the outcome

    def _take_scan(self, msg: LaserScan) -> None:
        self._inbox.put("scans", msg)
        self._outputs.send_transform_again(conversions.ns_from_stamp(msg.header.stamp), rospy.Time.now().to_nsec())

    def _command(self, handle: Callable[[Any], None]) -> Callable[[Any], None]:
        return lambda msg: self._inbox.put("commands", lambda: handle(msg))

    def _in_run_loop(self, work: Callable[[], T]) -> T:
        return mailbox.outcome(self._inbox.submit("commands", work), SERVICE_TIMEOUT_S)

    def _serve_global_localization(self, _request: EmptyRequest) -> EmptyResponse:
        try:
            self._in_run_loop(self._session.search)
        except (ValueError, TimeoutError) as err:
            rospy.logwarn(f"global_localization refused: {err}")
            raise rospy.ServiceException(str(err)) from err
        return EmptyResponse()

    def _serve_nomotion_update(self, _request: EmptyRequest) -> EmptyResponse:
        try:
            self._in_run_loop(self._session.request_update)
        except (ValueError, TimeoutError) as err:
            raise rospy.ServiceException(str(err)) from err
        return EmptyResponse()

    def _serve_save_panes(self, _request: TriggerRequest) -> TriggerResponse:
        written: List[str] = []
        try:
            self._in_run_loop(lambda: written.append(self._session.save_panes()))
        except (ValueError, TimeoutError) as err:
            rospy.logwarn(f"save_panes refused: {err}")
            return TriggerResponse(success=False, message=str(err))
        return TriggerResponse(success=True, message=written[0])

    def _serve_set_map(self, request: SetMapRequest) -> SetMapResponse:
        try:
            self._in_run_loop(lambda: self._set_map_and_pose(request))
        except (ValueError, TimeoutError) as err:
            rospy.logwarn(f"set_map refused: {err}")
            return SetMapResponse(success=False)
        return SetMapResponse(success=True)

    def _scan_and_map(self, request: LocateRequest) -> Tuple[Scan, GridMap]:
        """Scan and map for the service ~locate."""
        scan, grid_map = self._session.scan, self._session.grid_map
        if request.scan.ranges:
            raw = conversions.raw_scan_from_msg(request.scan)
            scan = self._in_run_loop(lambda: self._scans.place(ReadyScan(raw))).scan
        if grid_map is None or scan is None:
            raise ValueError(f"there is no {'map' if grid_map is None else 'scan'} yet")
        return scan, grid_map

    # -- maps, poses and parameters from outside

    def _use_map(self, grid_map: GridMap, frame: str, origin: str) -> None:
        if not self._session.use_map(grid_map, origin):
            return
        self._outputs.glass_is_news()
        machine.give_back_memory()  # of the message, and of what the map was looked through with
        if conversions.frame_id(frame) != self._p.node.global_frame_id:
            rospy.logwarn(
                f"the map says it is in frame {frame!r}, ~global_frame_id is "
                f"{self._p.node.global_frame_id!r}: used as the latter"
            )

    def _set_map_and_pose(self, request: SetMapRequest) -> None:
        guess = conversions.guess_from_msg(request.initial_pose, self._p.node.global_frame_id)
        grid_map = conversions.map_from_msg(request.map)
        initial_pose.refuse_outside(guess, grid_map)  # before the map is taken
        self._maps.take(grid_map, request.map.header.frame_id, "service set_map")
        self._session.give_with_map(guess, self._clock.now_s)

    def _take_guess(self, msg: PoseWithCovarianceStamped) -> None:
        try:
            guess = conversions.guess_from_msg(msg, self._p.node.global_frame_id)
            self._session.give(guess, self._clock.now_s)
        except ValueError as err:
            rospy.logwarn(f"initialpose refused: {err}")

    def _take_area(self, msg: PolygonStamped) -> None:
        try:
            self._session.search(conversions.area_from_msg(msg, self._p.node.global_frame_id))
        except ValueError as err:
            rospy.logwarn(f"global_localization_area refused: {err}")

    def _take_parameters(self, values: Dict[str, Any]) -> None:
        """Change parameters; the filter keeps what it knows. ParamError if one is invalid: then none changes."""
        p = params.changed(self._p, values, rospy.get_name())
        self._session.reconfigure(p.session)
        self._p = p
        self._scans.reconfigure(p.node, p.deskew, p.localizer.limits.laser_max_range)
        if self._wheels is not None:
            self._wheels.reconfigure(p)
        self._outputs.reconfigure(p.node)
        self._health.warn_deviations = p.node.warn_deviations

    # -- scans

    def _step(self, ready: ReadyScan) -> None:
        """Process one scan."""
        try:
            placed = self._scans.place(ready)
        except ScanError as err:
            self._pass_over(ready.raw.stamp_ns, str(err))
            return
        began_cpu_s, began_s = time.process_time(), time.monotonic()
        session, scan, odom_from_base = self._session, placed.scan, placed.odom_from_base
        session.start_at_given_pose(scan.stamp_ns, odom_from_base, self._clock.now_s)
        self._bearings.give(session.localizer, scan.stamp_ns)
        try:
            estimate = session.update(scan, odom_from_base, self._clock.now_s)
        except ValueError as err:  # ScanError, or the filter fails: the robot drives on by odometry
            self._pass_over(ready.raw.stamp_ns, str(err))
            return
        if estimate is None:
            self._scans.counts.refused += 1
            self._log.error("the filter's pose is not finite: nothing is published")
            return
        self._scans.counts.used += 1
        self._outputs.send(placed, estimate, self._clock.now_s, session.pose_is_news)
        self._segments.send_quality(session.grid_map, scan, estimate)
        session.pose_is_news = False
        self._memory.take(estimate, session.grid_map.digest, self._p.node.save_pose_rate, self._clock.now_s)
        self._health.add_update(time.process_time() - began_cpu_s, time.monotonic() - began_s)

    def _pass_over(self, stamp_ns: int, why: str) -> None:
        """Move the pose on by odometry after a scan was rejected."""
        self._scans.refuse(why)
        if self._session.estimate is not None:
            self._outputs.send_transform(stamp_ns, self._session.estimate.map_from_odom)

    def _send_glass_map(self) -> None:
        session = self._session
        if session.localizer is not None and session.grid_map is not None:
            stamp_ns = 0 if session.estimate is None else session.estimate.stamp_ns
            self._outputs.send_glass_map(session.localizer, session.grid_map, stamp_ns, self._clock.now_s)

    # -- time, and what is missing

    def _clock_jumped_back(self) -> bool:
        jump = self._clock.tick()
        if self._clock.has_begun:
            self._scans.last_arrival_s = self._session.last_estimate_s = self._clock.now_s
        if jump is not None:
            self._restart(jump)
        return jump is not None

    def _restart(self, why: str) -> None:
        """Start the filter over: time jumped."""
        self._scans.restart(self._clock.now_s)
        self._bearings.restart()
        self._tf.clear()
        if self._wheels is not None:
            self._wheels.restart()
        self._session.restart(why, self._clock.now_s)

    def _report(self) -> None:
        """Once a second: publish diagnostics, and log missing inputs while no scan is used."""
        if time.monotonic() < self._next_report_s:
            return
        self._next_report_s = time.monotonic() + 1.0
        session, silence = self._session, self._scans.silence(self._clock.now_s)
        trouble = session.missing(
            Inputs(self._clock.now_s, self._scans.last_arrival_s, silence, self._scans.trouble, self._maps.trouble)
        )
        if self._clock.now_s == 0.0:
            if time.monotonic() - self._started_s > SETTLING_S:
                self._log.warn(trouble, NO_SCAN_WARNING_S)
        elif self._clock.now_s - self._scans.last_arrival_s > NO_SCAN_WARNING_S:
            self._log.warn(silence, NO_SCAN_WARNING_S)
        self._say_what_to_start()
        if trouble is not None:
            self._outputs.send_trouble(session.estimate, session.state_without_scans, trouble)
        situation = Situation(
            session.estimate,
            session.scan,
            trouble,
            session.grid_map,
            session.map_origin if session.grid_map else self._maps.trouble or "no map yet",
            self._scans.period_s,
            self._scans.lidars,
            session.lacking_glass,
        )
        self._diagnostics.publish(self._health.report(situation))

    def _say_what_to_start(self) -> None:
        """Log what is missing as long as nothing was localized, for those who start this node alone."""
        if self._session.estimate is not None or time.monotonic() - self._started_s < SETTLING_S:
            return
        hint = what_to_start(
            self._maps.is_missing,
            self._scans.unpublished,
            "" if self._transforms.has_odometry() else self._transforms.odometry_name,
        )
        if hint is not None:
            self._log.warn(hint, NO_SCAN_WARNING_S)


def _keep_on_server(saved: SavedPose) -> None:
    """Store the pose on the parameter server as AMCL does, in one request; OSError without a server."""
    requests = MultiCall(ServerProxy(rosgraph.get_master_uri()))
    pose = zip(("pose_x", "pose_y", "pose_a"), saved.map_from_base)
    covariance = zip(("cov_xx", "cov_yy", "cov_aa"), np.diag(saved.covariance))
    for name, value in (*pose, *covariance):
        requests.setParam(rospy.get_name(), rospy.resolve_name(f"~initial_{name}"), float(value))
    requests()


def _parameter_file() -> Optional[Path]:
    """config/localization.yaml, which explains the parameters."""
    try:
        return Path(rospkg.RosPack().get_path("glass_nav")) / "config" / "localization.yaml"
    except rospkg.ResourceNotFound:
        return None


def main(name: str = "glass_localization") -> None:
    """Start the node; exit code 2 if a parameter or the landmark file is unusable."""
    if command_line.answers_help(__doc__):
        return
    rospy.init_node(name, disable_signals=True)
    if "--run-from-bag" in rospy.myargv():
        rospy.logfatal(
            f"{rospy.get_name()}: --run-from-bag is the command glass_nav replay here: "
            "rosrun glass_nav glass_nav replay BAG --map MAP --out FOLDER"
        )
        sys.exit(2)
    ending = shutdown.event_on_signals()
    shutdown.core_logs_to_rosout()
    given: Dict[str, Any] = rospy.get_param("~", {})
    ignored: List[str] = []
    if name == "amcl":
        given, unknown = params.without_unknown(given, rospy.get_name())
        given, wrong = params.as_amcl_reads(given, rospy.get_name())
        ignored = unknown + wrong
    try:
        p, unused = params.localization_params(given, rospy.get_name())
    except params.ParamError as err:
        shutdown.refuse_to_start(err)
    try:
        node = LocalizationNode(p)
    except landmark_file.LandmarkError as err:
        shutdown.refuse_to_start(err)
    shown = ShownParameters(params.on_server(p), given)
    for line in ignored:
        rospy.logwarn(line)
    if unused:
        rospy.loginfo(f"parameters of amcl that this filter does not use: ~{', ~'.join(unused)}")
    try:
        node.run(ending)
    finally:
        node.save()
        shown.hide()
        rospy.signal_shutdown("ended")
