"""landmarks_node: computes the pose from bearings to landmarks.

Wiring only: triangulation computes the pose. Callbacks store messages; one loop processes them.

Bearings come as the sensor turns; a sweep takes up to a minute. The newest bearing of each landmark within ~window_s is
kept. Each message, once odometry is available for all of its stamps, gives a fix at the stamp of its last bearing;
odometry carries older ones along. If a sweep gives no fix, the reason is logged and returned by ~send_initialpose.

Subscribes: landmark_bearings (LandmarkBearings), localization_status (LocalizationStatus; launch/landmarks.launch
    remaps it to glass_localization/status), tf odom <- base <- sensor.
Publishes: ~pose (PoseWithCovarianceStamped in map, of base at the last bearing);
    initialpose (PoseWithCovarianceStamped, the fix carried along to the newest odometry): on request, and once for each
    fix while the localization is in one of ~rescue_states, at most every ~rescue_period_s, so that it can settle;
    ~markers (MarkerArray, latched): the landmarks, and lines to those of the last fix.
Services: ~send_initialpose (std_srvs/Trigger): the last fix to initialpose; rejected, with the reason, if there is
    none younger than ~max_age_s.
Parameters: LandmarksNodeParams, TriangulationLimits, OdometryDrift, read once; explained in config/landmarks.yaml.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field
from typing import List

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse
from visualization_msgs.msg import MarkerArray

from glass_nav import params
from glass_nav.localization.bearings.landmark_fixes import FixParams, LandmarkFixes, PlacedFix
from glass_nav.localization.bearings.triangulation import TriangulationLimits
from glass_nav.msg import LandmarkBearings as LandmarkBearingsMsg
from glass_nav.msg import LocalizationStatus
from glass_nav.ros import command_line, conversions, mailbox, shutdown
from glass_nav.ros.landmarks import bearing_messages, landmark_display
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.loop_clock import LoopClock
from glass_nav.ros.mailbox import Mailbox
from glass_nav.sensing.bearings import OdometryDrift
from glass_nav.world import landmark_file
from glass_nav.world.landmark_map import LandmarkMap

SERVICE_TIMEOUT_S = 10.0


@dataclass(frozen=True)
class NodeParams:
    """Parameters of the node itself. Units by REP 103."""

    landmark_file: str = ""  # landmarks.yaml; must be given
    transform_wait_s: float = 1.0  # how long a message waits for odometry at its stamps
    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"
    global_frame_id: str = "map"

    def __post_init__(self) -> None:
        if not self.landmark_file:
            raise ValueError("~landmark_file must name a file of landmarks, got ''")
        if not 0.0 <= self.transform_wait_s < math.inf:
            raise ValueError(f"~transform_wait_s must be >= 0 and finite, got {self.transform_wait_s}")
        for name in ("odom_frame_id", "base_frame_id", "global_frame_id"):
            frame = conversions.frame_id(getattr(self, name))
            object.__setattr__(self, name, frame)
            if not frame:
                raise ValueError(f"~{name} must name a frame, got ''")


@dataclass(frozen=True)
class LandmarksNodeParams:
    """All parameters of the node, one flat set of names."""

    node: NodeParams = field(default_factory=NodeParams)
    fixes: FixParams = field(default_factory=FixParams)
    limits: TriangulationLimits = field(default_factory=TriangulationLimits)
    drift: OdometryDrift = field(default_factory=OdometryDrift)


class LandmarksNode:
    """Wiring only: bearings in, one call of the core, a pose out."""

    def __init__(self, p: LandmarksNodeParams) -> None:
        """
        Raises:
            LandmarkError: the landmark file is unusable; one line.
            ValueError: it has fewer than three landmarks.
        """
        self._p = p.node
        self._landmarks: LandmarkMap = landmark_file.load(self._p.landmark_file)
        try:
            self._fixes = LandmarkFixes(self._landmarks, p.fixes, p.limits, p.drift)
        except ValueError as err:
            raise ValueError(f"{self._p.landmark_file}: {err}") from err
        self._log = LogThrottle()
        self._inbox = Mailbox(bearings=100, states=10, commands=20)
        self._waiting: "List[tuple[float, LandmarkBearingsMsg]]" = []  # arrival [s]; they wait for odometry
        self._clock = LoopClock()

        self._tf = tf2_ros.Buffer(rospy.Duration(bearing_messages.LONGEST_TURN_S))
        self._poses = rospy.Publisher("~pose", PoseWithCovarianceStamped, queue_size=5)
        self._initial_poses = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=5)
        self._markers = rospy.Publisher("~markers", MarkerArray, queue_size=1, latch=True)
        self._markers.publish(landmark_display.landmark_markers(self._landmarks, self._p.global_frame_id))
        rospy.Service("~send_initialpose", Trigger, self._serve_send)
        self._listener = tf2_ros.TransformListener(self._tf, tcp_nodelay=True)
        rospy.Subscriber(
            "landmark_bearings",
            LandmarkBearingsMsg,
            lambda msg: self._inbox.put("bearings", msg),
            queue_size=100,
            tcp_nodelay=True,
        )
        rospy.Subscriber(
            "localization_status",
            LocalizationStatus,
            lambda msg: self._inbox.put("states", msg),
            queue_size=10,
            tcp_nodelay=True,
        )
        rospy.loginfo(
            f"{len(self._landmarks)} landmarks of {self._p.landmark_file}: "
            f"{', '.join(self._landmarks.ids[:20])}{', ...' if len(self._landmarks) > 20 else ''}"
        )

    def run(self, ending: threading.Event) -> None:
        """The only thread that works; returns when ROS shuts down or ending is set."""
        while not (rospy.is_shutdown() or ending.is_set()):
            mail = self._inbox.take(timeout_s=0.02 if self._waiting else 0.1)
            if self._clock_jumped_back():
                mail["bearings"] = []  # from before the jump
            for command in mail["commands"]:
                command()
            for msg in mail["states"]:
                self._fixes.localization_state = msg.state_name
            self._waiting += [(self._clock.now_s, msg) for msg in mail["bearings"]]
            self._work_off()
            self._rescue()

    # -- bearings

    def _work_off(self) -> None:
        """Process messages in order of arrival, each as soon as its transforms are available."""
        while self._waiting:
            arrival_s, msg = self._waiting[0]
            missing = self._missing_transform(msg)
            if missing and self._clock.now_s - arrival_s <= self._p.transform_wait_s:
                return
            del self._waiting[0]
            if missing:
                self._refuse(f"no {missing} within {self._p.transform_wait_s:g} s")
                continue
            try:
                self._take(msg)
            except (ValueError, tf2_ros.TransformException) as err:
                self._refuse(str(err))

    def _missing_transform(self, msg: LandmarkBearingsMsg) -> str:
        """The first transform missing for the message, in words; "" if none."""
        sensor = conversions.frame_id(msg.header.frame_id)
        if not self._tf.can_transform(self._p.base_frame_id, sensor, rospy.Time(0)):
            return f"transform {self._p.base_frame_id} <- {sensor or 'the sensor (frame_id is empty)'}"
        for stamp in msg.stamps:
            if not self._tf.can_transform(self._p.odom_frame_id, self._p.base_frame_id, stamp):
                return f"transform {self._p.odom_frame_id} <- {self._p.base_frame_id} at {stamp.to_sec():.3f} s"
        return ""

    def _take(self, msg: LandmarkBearingsMsg) -> None:
        """Process a message whose transforms are available: publish a fix, or report why there is none."""
        mounting = conversions.mounting_from_transform(
            self._tf.lookup_transform(
                self._p.base_frame_id, conversions.frame_id(msg.header.frame_id), rospy.Time(0)
            ).transform
        )
        taken = []
        for bearing in bearing_messages.bearings_from_msg(msg, mounting):
            if bearing.landmark_id in self._landmarks:
                taken.append((bearing, self._odom_from_base(bearing.stamp_ns)))
            else:
                self._log.warn(f"bearing ignored: landmark {bearing.landmark_id!r} is not in {self._p.landmark_file}")
        placed = self._fixes.take(taken, mounting.base_from_laser)
        if placed is not None:
            self._publish(placed)

    def _odom_from_base(self, stamp_ns: int) -> np.ndarray:
        return conversions.planar_from_transform(
            self._tf.lookup_transform(
                self._p.odom_frame_id, self._p.base_frame_id, conversions.stamp_from_ns(stamp_ns)
            ).transform
        )

    def _publish(self, placed: PlacedFix) -> None:
        fix = placed.fix
        if fix.excluded_ids:
            self._log.warn(f"bearings that contradict the others are left out: {', '.join(fix.excluded_ids)}")
        frame = self._p.global_frame_id
        self._poses.publish(conversions.pose_with_covariance(fix.stamp_ns, fix.map_from_base, fix.covariance, frame))
        self._markers.publish(landmark_display.fix_markers(fix, placed.bearings, self._landmarks, frame))
        x, y, yaw = fix.map_from_base
        rospy.loginfo(f"position from {', '.join(fix.used_ids)}: x {x:.2f} m, y {y:.2f} m, yaw {yaw:.3f} rad")

    def _refuse(self, why: str) -> None:
        self._fixes.why_none = why
        self._log.warn(f"no position from bearings: {why}")

    # -- initialpose

    def _serve_send(self, _request: TriggerRequest) -> TriggerResponse:
        try:
            mailbox.outcome(self._inbox.submit("commands", self._send_on_request), SERVICE_TIMEOUT_S)
        except (ValueError, TimeoutError) as err:
            return TriggerResponse(success=False, message=str(err))
        return TriggerResponse(success=True, message="sent to initialpose")

    def _send_on_request(self) -> None:
        self._send(self._fixes.requested(self._clock.now_s), "as requested")

    def _rescue(self) -> None:
        last = self._fixes.due_for_rescue()
        if last is None:
            return
        try:
            self._send(last, f"the localization is {self._fixes.localization_state}")
        except ValueError as err:
            self._log.warn(f"initialpose not sent: {err}")

    def _send(self, last: PlacedFix, why: str) -> None:
        try:
            newest = self._tf.lookup_transform(self._p.odom_frame_id, self._p.base_frame_id, rospy.Time(0))
        except tf2_ros.TransformException as err:  # tf was cleared since the fix
            raise ValueError(f"no odometry to carry the position along: {err}") from err
        fix = self._fixes.initial_pose(
            last, conversions.ns_from_stamp(newest.header.stamp), conversions.planar_from_transform(newest.transform)
        )
        self._initial_poses.publish(
            conversions.pose_with_covariance(fix.stamp_ns, fix.map_from_base, fix.covariance, self._p.global_frame_id)
        )
        rospy.loginfo(f"initialpose sent, {why}")

    def _clock_jumped_back(self) -> bool:
        jump = self._clock.tick()
        if jump is None:
            return False
        rospy.logwarn(f"{jump}: bearings start over")
        self._tf.clear()
        self._waiting = []
        self._fixes.restart("no bearings came since time jumped back")
        return True


def main() -> None:
    """Start the node; exit code 2 if a parameter or the landmark file cannot be used."""
    if command_line.answers_help(__doc__):
        return
    shutdown.run_node(
        "landmarks", lambda given: LandmarksNode(params.load(LandmarksNodeParams, given, rospy.get_name()))
    )
