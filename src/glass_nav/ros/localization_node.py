"""localization_node: where is the robot in a map of walls and glass? Also startable as `amcl`.

Wiring only; the answer comes from GlassMcl. Callbacks store, one loop works: nothing else touches the filter.

Subscribes: scan (LaserScan), initialpose (PoseWithCovarianceStamped), map (OccupancyGrid, if ~use_map_topic),
    landmark_bearings (LandmarkBearings, if ~landmark_file is given), tf odom <- base <- laser.
Publishes: amcl_pose (PoseWithCovarianceStamped, latched), particlecloud (PoseArray, latched), tf map -> odom,
    ~status (LocalizationStatus, latched), ~beam_cases (BeamCases), /diagnostics;
    scan_surfaces (LaserScan): the scan for a costmap, with each beam cut at the first surface of the map that it
    passed or was mirrored at. Stamp, frame and beams are the scan's; its `intensities` say 0 as measured, 1 cut,
    and -1 for all beams while the pose is not trusted: the scan is passed on raw then. One for every scan that
    is used; none for a scan that is refused or has no transforms, as nobody knows where it would have to be cut;
    ~glass_map (OccupancyGrid, latched): how glassy each wall cell proved [percent], -1 where nothing is known;
    for rviz, while somebody listens: ~beam_cloud (PointCloud2), ~beam_markers (MarkerArray, a namespace per case
    and one for the status), ~wall_markers (MarkerArray, latched: the glass map without what is unknown), ~legend
    (Image, latched).
Services: global_localization, request_nomotion_update (Empty), set_map (SetMap). Calls static_map (GetMap).
Parameters: LocalizationNodeParams and GlassMclParams, read once; explained in config/localization.yaml.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Optional

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, SetMap, SetMapRequest, SetMapResponse
from sensor_msgs.msg import Image, LaserScan, PointCloud2
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse
from visualization_msgs.msg import MarkerArray

from glass_nav.geometry import se2
from glass_nav.localization.glass_mcl import Estimate, GlassMcl
from glass_nav.msg import BeamCases, LandmarkBearings, LocalizationStatus
from glass_nav.ros import beam_displays, bearing_messages, conversions, endings, legend, params, wall_display
from glass_nav.ros.diagnostics import Diagnostics
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.mailbox import Errand, Mailbox, WaitingScans
from glass_nav.sensing import bearings
from glass_nav.sensing.scan import Scan, ScanError
from glass_nav.world import landmark_file, landmark_map
from glass_nav.world.grid_map import GridMap

TIME_JUMP_S = 0.5       # a clock that goes back by less is noise between machines
STALE_SCANS = 20        # that many older scans in a row: the lidar's clock was set back
GUESS_WAIT_S = 1.0      # how long an initialpose waits for a scan at or after its stamp
NO_SCAN_WARNING_S = 15.0  # as AMCL
SILENCE_S = 3.0         # without a used scan for that long, ~status says why
SETTLING_S = 5.0        # map server and player of a launch file need some seconds: no warning before
ERRAND_TIMEOUT_S = 30.0
LONGEST_TURN_S = 300.0  # of a sensor of bearings: odometry is remembered for so long, where there are landmarks


@dataclass(frozen=True)
class _Start:
    """A pose somebody gave, and when it came."""
    guess: conversions.PoseGuess
    arrival_s: float


class LocalizationNode:
    """Wiring only: a message in, one call of the core, messages out."""

    def __init__(self, p: params.LocalizationParams) -> None:
        self._p = p.node
        self._mcl_params = p.mcl
        self._rng = p.node.rng
        self._mcl: Optional[GlassMcl] = None
        self._map: Optional[GridMap] = None
        self._estimate: Optional[Estimate] = None
        self._start: Optional[_Start] = None  # waits for its scan
        self._restart_pose = (p.start.pose, p.start.covariance)  # where a bag starts over
        self._publish_pose = True
        self._log = LogThrottle()
        self._inbox = Mailbox(scans=100, commands=100)
        self._waiting: WaitingScans[LaserScan] = WaitingScans(100, p.node.transform_wait_s)
        self._now_s = rospy.get_time()
        self._last_scan_s = self._last_estimate_s = self._now_s
        self._stale_scans = 0
        self._started_s = time.monotonic()
        self._simulated = bool(rospy.get_param("/use_sim_time", False))
        self._next_report_s = self._next_map_request_s = 0.0  # by the monotonic clock
        self._last_save_s = self._last_beams_s = self._last_particles_s = 0.0  # by ROS time
        self._last_glass_s = 0.0
        self._glass_changed = False  # since it was last sent
        self._trouble = "no scan used yet"

        self._landmarks = landmark_file.load(p.node.landmark_file) if p.node.landmark_file else landmark_map.NONE
        self._bearings: List[LandmarkBearings] = []  # wait for the next scan
        self._tf = tf2_ros.Buffer(rospy.Duration(LONGEST_TURN_S) if len(self._landmarks) else None)
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._poses = rospy.Publisher("amcl_pose", PoseWithCovarianceStamped, queue_size=2, latch=True)
        self._particles = rospy.Publisher("particlecloud", PoseArray, queue_size=2, latch=True)
        self._status = rospy.Publisher("~status", LocalizationStatus, queue_size=5, latch=True)
        self._beam_cases = rospy.Publisher("~beam_cases", BeamCases, queue_size=5)
        self._surfaces = rospy.Publisher("scan_surfaces", LaserScan, queue_size=5)
        self._glass_map = rospy.Publisher("~glass_map", OccupancyGrid, queue_size=1, latch=True)
        self._beam_cloud = rospy.Publisher("~beam_cloud", PointCloud2, queue_size=2)
        self._beam_markers = rospy.Publisher("~beam_markers", MarkerArray, queue_size=2)
        self._wall_markers = rospy.Publisher("~wall_markers", MarkerArray, queue_size=1, latch=True)
        self._legend = rospy.Publisher("~legend", Image, queue_size=1, latch=True)
        self._legend.publish(legend.image_msg(self._p.global_frame_id))
        self._diagnostics = Diagnostics(p.node, self._waiting.counts)

        rospy.Service("global_localization", Empty, self._serve_global_localization)
        rospy.Service("request_nomotion_update", Empty, self._serve_nomotion_update)
        rospy.Service("set_map", SetMap, self._serve_set_map)
        # Subscribers last: they may fire at once. Nagle's algorithm would hold small messages for 40 ms.
        self._listener = tf2_ros.TransformListener(self._tf, tcp_nodelay=True)
        self._scan_input = rospy.Subscriber("scan", LaserScan, lambda msg: self._inbox.put("scans", msg),
                                            queue_size=100, buff_size=2 ** 22, tcp_nodelay=True)
        rospy.Subscriber("initialpose", PoseWithCovarianceStamped, self._command(self._take_guess),
                         queue_size=2)
        if len(self._landmarks):
            rospy.Subscriber("landmark_bearings", LandmarkBearings, self._command(self._bearings.append), queue_size=10)
        if self._p.use_map_topic:
            rospy.Subscriber("map", OccupancyGrid, self._command(self._take_map_topic), queue_size=1,
                             buff_size=2 ** 24)

    def run(self, ending: threading.Event) -> None:
        """The only thread that touches the filter; returns when ROS shuts down or ending is set."""
        while not (rospy.is_shutdown() or ending.is_set()):
            mail = self._inbox.take(timeout_s=0.01 if len(self._waiting) else 0.1)
            if self._clock_jumped_back():
                mail["scans"] = []  # from before the jump
            for command in mail["commands"]:
                command()
            if self._mcl is None and not self._p.use_map_topic:
                self._request_map()
            for msg in mail["scans"]:
                self._receive(msg)
            msg, given_up = self._waiting.take_ready(self._has_transforms, self._now_s)
            if given_up:
                self._say_no_transform(given_up[-1])
            if msg is not None:
                self._step(msg)
            self._send_glass_map()
            self._report()

    def save_pose(self) -> None:
        """The pose to the parameter server, as AMCL does; the next start of the node begins there."""
        if self._estimate is None:
            return
        pose, covariance = self._estimate.map_from_base, self._estimate.covariance
        try:
            for name, value in (("x", pose[0]), ("y", pose[1]), ("a", pose[2])):
                rospy.set_param(f"~initial_pose_{name}", float(value))
            for name, index in (("xx", 0), ("yy", 1), ("aa", 2)):
                rospy.set_param(f"~initial_cov_{name}", float(covariance[index, index]))
        except OSError as err:
            self._log.warn(f"the pose is not saved: no parameter server ({err})", period_s=60.0)

    # -- callbacks of other threads: they store, services also wait for the outcome

    def _command(self, handle: Callable[[Any], None]) -> Callable[[Any], None]:
        return lambda msg: self._inbox.put("commands", lambda: handle(msg))

    def _run_errand(self, work: Callable[[], None]) -> None:
        errand = Errand(work)
        self._inbox.put("commands", errand.run)
        errand.wait(ERRAND_TIMEOUT_S)

    def _serve_global_localization(self, _request: EmptyRequest) -> EmptyResponse:
        try:
            self._run_errand(self._scatter)
        except (ValueError, TimeoutError) as err:
            rospy.logwarn(f"global_localization refused: {err}")
            raise rospy.ServiceException(str(err)) from err
        return EmptyResponse()

    def _serve_nomotion_update(self, _request: EmptyRequest) -> EmptyResponse:
        try:
            self._run_errand(lambda: self._core().request_update())
        except (ValueError, TimeoutError) as err:
            raise rospy.ServiceException(str(err)) from err
        return EmptyResponse()

    def _serve_set_map(self, request: SetMapRequest) -> SetMapResponse:
        try:
            self._run_errand(lambda: self._set_map_and_pose(request))
        except (ValueError, TimeoutError) as err:
            rospy.logwarn(f"set_map refused: {err}")
            return SetMapResponse(success=False)
        return SetMapResponse(success=True)

    # -- maps

    def _core(self) -> GlassMcl:
        if self._mcl is None:
            raise ValueError("there is no map yet")
        return self._mcl

    def _request_map(self) -> None:
        """Ask static_map once; the loop comes back to it until there is a map."""
        if time.monotonic() < self._next_map_request_s:
            return
        self._next_map_request_s = time.monotonic() + 0.5
        name = rospy.resolve_name("static_map")
        try:
            rospy.wait_for_service(name, timeout=0.1)
        except rospy.ROSException:
            self._trouble = f"no map: there is no service {name}"
            if self._settled() and not rospy.is_shutdown():
                self._log.warn(self._trouble)
            return
        try:
            msg = rospy.ServiceProxy(name, GetMap)().map
            self._use_map(conversions.map_from_msg(msg), msg.header.frame_id, f"service {name}")
        except rospy.ServiceException as err:
            self._trouble = f"no map: service {name} fails: {err}"
            self._log.warn(self._trouble)
        except ValueError as err:
            self._trouble = f"no map: the one of service {name} is refused: {err}"
            self._log.error(self._trouble)

    def _take_map_topic(self, msg: OccupancyGrid) -> None:
        if self._map is not None and self._p.first_map_only:
            return
        origin = f"topic {rospy.resolve_name('map')}"
        try:
            self._use_map(conversions.map_from_msg(msg), msg.header.frame_id, origin)
        except ValueError as err:
            rospy.logerr(f"the map of {origin} is refused: {err}")

    def _set_map_and_pose(self, request: SetMapRequest) -> None:
        guess = conversions.guess_from_msg(request.initial_pose, self._p.global_frame_id)
        grid_map = conversions.map_from_msg(request.map)
        _refuse_outside(guess, grid_map)
        self._use_map(grid_map, request.map.header.frame_id, "service set_map")
        self._start = _Start(guess, self._now_s)
        if self._p.force_update_after_set_map:
            self._core().request_update()

    def _use_map(self, grid_map: GridMap, frame: str, origin: str) -> None:
        """Build the filter around the first map; a later one leaves the particles where they are."""
        if self._mcl is None:
            self._mcl = self._new_core(grid_map, *self._restart_pose)
        else:
            self._mcl.set_map(grid_map)
        self._map, self._glass_changed = grid_map, True
        height, width = grid_map.occupancy.shape
        rospy.loginfo(f"map of {width} x {height} cells of {grid_map.resolution_m:g} m from {origin}")
        if conversions.frame_id(frame) != self._p.global_frame_id:
            rospy.logwarn(f"the map says it is in frame {frame!r}, ~global_frame_id is "
                          f"{self._p.global_frame_id!r}: used as the latter")

    def _new_core(self, grid_map: GridMap, map_from_base: np.ndarray, covariance: np.ndarray) -> GlassMcl:
        mcl = GlassMcl(self._mcl_params, grid_map, self._rng)
        mcl.set_pose(map_from_base, covariance)
        self._publish_pose = True
        return mcl

    # -- poses from outside

    def _take_guess(self, msg: PoseWithCovarianceStamped) -> None:
        try:
            guess = conversions.guess_from_msg(msg, self._p.global_frame_id)
            if self._map is not None:
                _refuse_outside(guess, self._map)
        except ValueError as err:
            rospy.logwarn(f"initialpose refused: {err}")
            return
        self._start = _Start(guess, self._now_s)

    def _scatter(self) -> None:
        self._core().scatter()
        self._start, self._publish_pose = None, True
        rospy.loginfo("global localization: the robot may be anywhere in the map")

    def _apply_start(self, scan_ns: int, odom_from_base: np.ndarray) -> None:
        """Give the filter the pose that waits, moved forward by the odometry from its stamp to the scan's."""
        assert self._start is not None and self._mcl is not None and self._map is not None
        guess = self._start.guess
        overdue = self._now_s - self._start.arrival_s > GUESS_WAIT_S
        if guess.stamp_ns > scan_ns and not overdue:
            return  # a scan at or after its stamp is on its way
        self._start = None
        map_from_base = guess.map_from_base
        if guess.stamp_ns != 0:
            try:
                odom_from_then = conversions.planar_from_transform(
                    self._tf.lookup_transform(self._p.odom_frame_id, self._p.base_frame_id,
                                              conversions.stamp_from_ns(guess.stamp_ns)).transform)
                moved = se2.compose(se2.inverse(odom_from_then), odom_from_base)
                map_from_base = se2.compose(map_from_base, moved)
            except (tf2_ros.TransformException, ValueError) as err:
                rospy.logwarn(f"initialpose of {guess.stamp_ns * 1e-9:.3f} s taken as of now: "
                              f"no odometry at its stamp ({err})")
        try:
            _refuse_outside(guess, self._map)
            self._mcl.set_pose(map_from_base, guess.covariance)
        except ValueError as err:
            rospy.logwarn(f"initialpose refused: {err}")
            return
        self._restart_pose = (guess.map_from_base, guess.covariance)
        self._publish_pose = True
        if self._p.force_update_after_initialpose:
            self._mcl.request_update()
        x, y, yaw = map_from_base
        rospy.loginfo(f"starting at x {x:.3f} m, y {y:.3f} m, yaw {yaw:.3f} rad")

    # -- bearings

    def _add_bearings(self, scan_ns: int) -> None:
        """Give the filter the bearings that came and are not newer than the scan, those to known landmarks."""
        assert self._mcl is not None
        ready = [msg for msg in self._bearings if conversions.ns_from_stamp(msg.header.stamp) <= scan_ns]
        self._bearings[:] = [msg for msg in self._bearings if msg not in ready]
        for msg in ready:
            try:
                mounting = conversions.mounting_from_transform(self._tf.lookup_transform(
                    self._p.base_frame_id, conversions.frame_id(msg.header.frame_id), rospy.Time(0)).transform)
                known = [bearing for bearing in bearing_messages.bearings_from_msg(msg, mounting)
                         if bearing.landmark_id in self._landmarks]
                if len(known) < len(msg.ids):
                    self._log.warn(f"bearings to landmarks that are not in {self._p.landmark_file} are not used")
                if known:
                    odometry = np.array([self._odom_from_base(bearing.stamp_ns) for bearing in known])
                    self._mcl.add_bearings(bearings.collected(known, odometry, mounting.base_from_laser),
                                           self._landmarks, odometry[-1])
            except (ValueError, tf2_ros.TransformException) as err:
                self._log.warn(f"bearings not used: {err}")

    def _odom_from_base(self, stamp_ns: int) -> np.ndarray:
        return conversions.planar_from_transform(self._tf.lookup_transform(
            self._p.odom_frame_id, self._p.base_frame_id, conversions.stamp_from_ns(stamp_ns)).transform)

    # -- scans

    def _receive(self, msg: LaserScan) -> None:
        """Let a scan wait for its transforms, unless it cannot be used at all."""
        self._waiting.counts.received += 1
        self._last_scan_s = self._now_s
        stamp_ns = conversions.ns_from_stamp(msg.header.stamp)
        if self._mcl is None:
            self._refuse("there is no map yet")
        elif stamp_ns == 0:
            self._refuse("it has no stamp")
        elif not conversions.frame_id(msg.header.frame_id):
            self._refuse("it has no frame_id")
        elif self._waiting.add(msg, stamp_ns, self._now_s):
            self._stale_scans = 0
        else:
            self._refuse(f"its stamp {stamp_ns * 1e-9:.3f} s is not after that of the last one used")
            self._stale_scans += 1
            if self._stale_scans >= STALE_SCANS:
                self._restart(f"the last {STALE_SCANS} scans are older than the one before them")

    def _refuse(self, why: str) -> None:
        self._waiting.counts.refused += 1
        self._trouble = f"scan refused: {why}"
        self._log.warn(self._trouble)

    def _transform_pairs(self, msg: LaserScan) -> "List[tuple[str, str]]":
        return [(self._p.odom_frame_id, self._p.base_frame_id),
                (self._p.base_frame_id, conversions.frame_id(msg.header.frame_id))]

    def _has_transforms(self, msg: LaserScan) -> bool:
        return all(self._tf.can_transform(target, source, msg.header.stamp)
                   for target, source in self._transform_pairs(msg))

    def _say_no_transform(self, msg: LaserScan) -> None:
        """The first pair that is missing, with tf's own reason."""
        wait = f"{self._p.transform_wait_s:g} s"
        for target, source in self._transform_pairs(msg):
            try:
                self._tf.lookup_transform(target, source, msg.header.stamp)
            except tf2_ros.TransformException as err:
                self._trouble = f"no transform {target} <- {source} at the scan's stamp: {err}"
                self._log.warn(f"scan dropped after {wait}: {self._trouble}")
                return
        self._log.warn(f"scan dropped: its transform came later than {wait}")

    def _step(self, msg: LaserScan) -> None:
        """One scan through the filter."""
        assert self._mcl is not None
        (odom, base), (_, laser) = self._transform_pairs(msg)
        try:
            odom_from_base = conversions.planar_from_transform(
                self._tf.lookup_transform(odom, base, msg.header.stamp).transform)
            mounting = conversions.mounting_from_transform(
                self._tf.lookup_transform(base, laser, msg.header.stamp).transform)
        except tf2_ros.TransformException as err:  # tf was cleared since it was asked
            self._refuse(f"no transform: {err}")
            return
        except ScanError as err:
            self._refuse(str(err))
            return
        except ValueError as err:
            self._refuse(f"transform {odom} <- {base}: {err}")
            return
        started = time.process_time()
        try:
            scan = conversions.scan_from_msg(msg, mounting)
            if self._start is not None:
                self._apply_start(scan.stamp_ns, odom_from_base)
            self._add_bearings(scan.stamp_ns)
            estimate = self._mcl.update(scan, odom_from_base)
        except ScanError as err:  # the pose moves on with the odometry
            self._refuse(str(err))
            if self._estimate is not None:
                stamp_ns = conversions.ns_from_stamp(msg.header.stamp)
                self._send_transform(stamp_ns, self._estimate.map_from_odom)
            return
        self._diagnostics.add_update(time.process_time() - started)
        if not conversions.is_finite(estimate):
            self._waiting.counts.refused += 1
            self._log.error("the filter's pose is not finite: nothing is published")
            return
        self._waiting.counts.used += 1
        self._estimate, self._last_estimate_s = estimate, self._now_s
        self._send_transform(estimate.stamp_ns, estimate.map_from_odom)
        self._surfaces.publish(conversions.surface_scan_msg(msg, estimate.surface_scan))
        self._publish(estimate)
        self._glass_changed = self._glass_changed or estimate.updated
        if self._beam_cases.get_num_connections():
            self._beam_cases.publish(conversions.beam_cases_msg(msg.header, estimate.cases))
        self._show_beams(scan, estimate, mounting.height_m)
        if self._p.save_pose_rate > 0.0 and self._due("_last_save_s", self._p.save_pose_rate):
            self.save_pose()

    # -- output

    def _send_transform(self, stamp_ns: int, map_from_odom: np.ndarray) -> None:
        if self._p.tf_broadcast:
            valid_until_ns = stamp_ns + round(self._p.transform_tolerance * 1e9)
            self._broadcaster.sendTransform(conversions.transform_stamped(
                valid_until_ns, self._p.global_frame_id, self._p.odom_frame_id, map_from_odom))

    def _publish(self, estimate: Estimate) -> None:
        frame = self._p.global_frame_id
        self._status.publish(conversions.status_msg(estimate.stamp_ns, frame, estimate.state, estimate.reason,
                                                    estimate.used_share))
        if not (estimate.updated or self._publish_pose):
            return
        self._poses.publish(conversions.pose_msg(estimate, frame))
        if self._publish_pose or self._due("_last_particles_s", self._p.gui_publish_rate):
            self._particles.publish(conversions.pose_array(estimate.stamp_ns, frame, estimate.particles))
        self._publish_pose = False

    def _show_beams(self, scan: Scan, estimate: Estimate, height_m: float) -> None:
        """The beams for rviz, if it listens and it is time."""
        listeners = self._beam_cloud.get_num_connections(), self._beam_markers.get_num_connections()
        if not any(listeners) or not self._due("_last_beams_s", self._p.gui_publish_rate):
            return
        base = self._p.base_frame_id
        if listeners[0]:
            self._beam_cloud.publish(beam_displays.beam_cloud(scan, estimate.cases, height_m, base))
        if listeners[1]:
            markers = beam_displays.beam_markers(scan, estimate.cases, estimate.surface_scan, height_m, base)
            markers.markers.append(beam_displays.status_marker(
                estimate.map_from_base, self._p.global_frame_id, estimate.state, estimate.reason,
                estimate.used_share))
            self._beam_markers.publish(markers)

    def _send_glass_map(self) -> None:
        """The glass map, if it is news to somebody and it is time."""
        if self._mcl is None or self._map is None or not self._glass_changed:
            return
        period_s = self._p.glass_map_period_s
        listeners = self._glass_map.get_num_connections() + self._wall_markers.get_num_connections()
        if not listeners or 0.0 <= self._now_s - self._last_glass_s < period_s:
            return
        self._last_glass_s, self._glass_changed = self._now_s, False
        stamp_ns = 0 if self._estimate is None else self._estimate.stamp_ns
        frame, glass = self._p.global_frame_id, self._mcl.glass_map.occupancy()
        self._glass_map.publish(conversions.glass_map_msg(stamp_ns, frame, self._map, glass))
        self._wall_markers.publish(wall_display.wall_markers(frame, self._map, glass))

    def _due(self, last: str, rate_hz: float) -> bool:
        """Whether 1 / rate has passed since the time in the attribute `last`, which then becomes now."""
        if rate_hz > 0.0 and 0.0 <= self._now_s - getattr(self, last) < 1.0 / rate_hz:
            return False
        setattr(self, last, self._now_s)
        return True

    # -- time, and what is missing

    def _clock_jumped_back(self) -> bool:
        before_s, self._now_s = self._now_s, rospy.get_time()
        if before_s == 0.0:  # the first /clock
            self._last_scan_s = self._last_estimate_s = self._now_s
        if self._now_s >= before_s - TIME_JUMP_S:
            return False
        self._restart(f"time jumped back by {before_s - self._now_s:.3f} s")
        return True

    def _restart(self, why: str) -> None:
        """Stamps start over: forget them. In simulated time the robot starts over too, else it stays."""
        self._waiting.restart()
        self._bearings.clear()
        self._tf.clear()
        self._stale_scans, self._start = 0, None
        self._last_scan_s = self._last_estimate_s = self._now_s
        if not self._simulated and self._estimate is not None:
            self._restart_pose = (self._estimate.map_from_base, self._estimate.covariance)
        self._rng = self._p.rng  # a bag that starts over gives the same poses again
        if self._map is not None:
            self._mcl = self._new_core(self._map, *self._restart_pose)
            self._glass_changed = True
        x, y, yaw = self._restart_pose[0]
        where = "the last pose it was given" if self._simulated else "its last pose"
        rospy.logwarn(f"{why}: the filter starts over at {where}, x {x:.3f} m, y {y:.3f} m, "
                      f"yaw {yaw:.3f} rad")
        self._estimate = None

    def _report(self) -> None:
        """Once a second: diagnostics, and in words what is missing if no scan is being used."""
        if time.monotonic() < self._next_report_s:
            return
        self._next_report_s = time.monotonic() + 1.0
        trouble = self._missing()
        if trouble is not None:
            self._say_trouble(trouble)
        self._diagnostics.publish(self._estimate, trouble)

    def _say_trouble(self, trouble: str) -> None:
        """~status, and the words in rviz, while no scan is being used."""
        stamp_ns, where, state = 0, None, "UNKNOWN"
        if self._estimate is not None:
            stamp_ns, where, state = self._estimate.stamp_ns, self._estimate.map_from_base, "UNCERTAIN"
        frame = self._p.global_frame_id
        self._status.publish(conversions.status_msg(stamp_ns, frame, state, trouble, float("nan")))
        if self._beam_markers.get_num_connections():
            self._beam_markers.publish(MarkerArray([beam_displays.status_marker(where, frame, state, trouble,
                                                                                float("nan"))]))

    def _settled(self) -> bool:
        return time.monotonic() - self._started_s > SETTLING_S

    def _missing(self) -> Optional[str]:
        """Why no scan is being used; None while all is well."""
        if self._now_s == 0.0:
            trouble = "time stands still: /use_sim_time is set and nothing publishes /clock"
            if self._settled():
                self._log.warn(trouble, NO_SCAN_WARNING_S)
            return trouble
        without_scan_s = self._now_s - self._last_scan_s
        topic = rospy.resolve_name("scan")
        silence = (f"no scan on {topic} for {without_scan_s:.0f} s: "
                   + ("its publisher is silent" if self._scan_input.get_num_connections()
                      else "nobody publishes it"))
        if without_scan_s > NO_SCAN_WARNING_S:
            self._log.warn(silence, NO_SCAN_WARNING_S)
        if self._mcl is None:
            return self._trouble if self._trouble.startswith("no map") else "no map yet"
        if without_scan_s > SILENCE_S:
            return silence
        if self._now_s - self._last_estimate_s > SILENCE_S or self._estimate is None:
            return self._trouble
        return None


def _refuse_outside(guess: conversions.PoseGuess, grid_map: GridMap) -> None:
    if not grid_map.contains(*grid_map.cells(guess.map_from_base[:2])):
        x, y = guess.map_from_base[:2]
        raise ValueError(f"the pose x {x:.3f} m, y {y:.3f} m lies outside the map")


def main(name: str = "glass_localization") -> None:
    """Start the node; exit code 2 if a parameter cannot be used."""
    rospy.init_node(name, disable_signals=True)
    ending = endings.event_on_signals()
    core_log = logging.getLogger("glass_nav")
    core_log.handlers = logging.getLogger("rosout").handlers
    core_log.setLevel(logging.INFO)
    core_log.propagate = False
    given: Dict[str, Any] = rospy.get_param("~", {})
    try:
        p, unused = params.localization_params(given, rospy.get_name())
    except params.ParamError as err:
        rospy.logfatal(str(err))
        rospy.signal_shutdown("a parameter cannot be used")
        sys.exit(2)
    if unused:
        rospy.loginfo(f"parameters of amcl that this filter does not use: ~{', ~'.join(unused)}")
    try:
        node = LocalizationNode(p)
    except landmark_file.LandmarkError as err:
        rospy.logfatal(f"{rospy.get_name()}: {err}")
        rospy.signal_shutdown("the landmark file cannot be used")
        sys.exit(2)
    try:
        node.run(ending)
    finally:
        node.save_pose()
        rospy.signal_shutdown("ended")
