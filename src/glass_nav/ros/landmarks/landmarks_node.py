"""landmarks_node: where is a robot that sees landmarks in these directions?

Wiring only; the answer comes from triangulation. Callbacks store, one loop works.

Bearings come as the sensor turns, up to a minute for a turn. The newest bearing of each landmark within ~window_s is
kept; each message, once odometry is there for all of its stamps, gives a fix at the stamp of its last bearing, older
ones carried along by odometry. A turn that gives no fix says why, in the log and to whoever asks.

Subscribes: landmark_bearings (LandmarkBearings), localization_status (LocalizationStatus; launch/landmarks.launch
    remaps it to glass_localization/status), tf odom <- base <- sensor.
Publishes: ~pose (PoseWithCovarianceStamped in map, of base at the last bearing);
    initialpose (PoseWithCovarianceStamped, the fix carried along to the newest odometry): on request, and once for each
    fix while the localization is in one of ~rescue_states, at most every ~rescue_period_s, so that it can settle;
    ~markers (MarkerArray, latched): the landmarks, and lines to those of the last fix.
Services: ~send_initialpose (std_srvs/Trigger): the last fix to initialpose; refused, with the reason, if there is none
    younger than ~max_age_s.
Parameters: LandmarksNodeParams, TriangulationLimits, OdometryDrift, read once; explained in config/landmarks.yaml.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field
from typing import Dict, List, Optional, Tuple

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse
from visualization_msgs.msg import MarkerArray

from glass_nav import params
from glass_nav.geometry import se2
from glass_nav.localization.bearings import triangulation
from glass_nav.localization.bearings.triangulation import Fix, TriangulationLimits
from glass_nav.msg import LandmarkBearings as LandmarkBearingsMsg
from glass_nav.msg import LocalizationStatus
from glass_nav.ros import conversions, mailbox, shutdown
from glass_nav.ros.landmarks import bearing_messages, landmark_display
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.loop_clock import LoopClock
from glass_nav.ros.mailbox import Mailbox
from glass_nav.sensing import bearings
from glass_nav.sensing.bearings import LandmarkBearing, LandmarkBearings, OdometryDrift
from glass_nav.vocabulary import LocalizationState
from glass_nav.world import landmark_file
from glass_nav.world.landmark_map import LandmarkMap

METHODS = ("least_squares", "document")
SERVICE_TIMEOUT_S = 10.0


@dataclass(frozen=True)
class NodeParams:
    """What the node itself needs. Units by REP 103."""

    landmark_file: str = ""  # landmarks.yaml; must be given
    method: str = "least_squares"  # or "document": the average over all triples
    window_s: float = 90.0  # bearings older than this, against the newest, are forgotten
    transform_wait_s: float = 1.0  # how long a message waits for odometry at its stamps
    max_age_s: float = 120.0  # of the fix that ~send_initialpose sends
    rescue_states: str = "UNKNOWN LOST GLOBAL_SEARCH"  # of the localization: a fix goes to initialpose; "": never
    rescue_period_s: float = 10.0
    min_position_sigma_m: float = 0.05  # of initialpose: particles in one point would not find the scan's best place
    min_heading_sigma_rad: float = 0.02
    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"
    global_frame_id: str = "map"

    def __post_init__(self) -> None:
        if not self.landmark_file:
            raise ValueError("~landmark_file must name a file of landmarks, got ''")
        if self.method not in METHODS:
            raise ValueError(f"~method must be one of {', '.join(METHODS)}, got {self.method!r}")
        for name in (
            "window_s",
            "transform_wait_s",
            "max_age_s",
            "rescue_period_s",
            "min_position_sigma_m",
            "min_heading_sigma_rad",
        ):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be >= 0 and finite, got {getattr(self, name)}")
        unknown = [state for state in self.rescue_states.split() if state not in LocalizationState.__members__]
        if unknown:
            raise ValueError(f"~rescue_states must be words of {', '.join(LocalizationState)}, got {unknown[0]!r}")
        for name in ("odom_frame_id", "base_frame_id", "global_frame_id"):
            frame = conversions.frame_id(getattr(self, name))
            object.__setattr__(self, name, frame)
            if not frame:
                raise ValueError(f"~{name} must name a frame, got ''")


@dataclass(frozen=True)
class LandmarksNodeParams:
    """Everything the node reads, one flat set of names."""

    node: NodeParams = field(default_factory=NodeParams)
    limits: TriangulationLimits = field(default_factory=TriangulationLimits)
    drift: OdometryDrift = field(default_factory=OdometryDrift)


class LandmarksNode:
    """Wiring only: bearings in, one call of the core, a pose out."""

    def __init__(self, p: LandmarksNodeParams) -> None:
        """Raises:
        LandmarkError: the landmark file cannot be used; one line.
        ValueError: it has fewer than three landmarks.
        """
        self._p, self._limits, self._drift = p.node, p.limits, p.drift
        self._landmarks: LandmarkMap = landmark_file.load(self._p.landmark_file)
        if len(self._landmarks) < 3:
            raise ValueError(
                f"{self._p.landmark_file}: three landmarks are needed for a position, it has {len(self._landmarks)}"
            )
        self._log = LogThrottle()
        self._inbox = Mailbox(bearings=100, states=10, commands=20)
        self._waiting: "List[tuple[float, LandmarkBearingsMsg]]" = []  # arrival [s], for their odometry
        self._newest: Dict[str, Tuple[LandmarkBearing, np.ndarray]] = {}  # with odom_from_base at its stamp
        self._fix: Optional[Fix] = None
        self._odom_at_fix = np.zeros(3)
        self._why_none = "no bearings came yet"
        self._state = ""
        self._sent_ns = self._rescued_ns = 0  # stamps of fixes
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
                self._state = msg.state_name
            self._waiting += [(self._clock.now_s, msg) for msg in mail["bearings"]]
            self._work_off()
            if self._state in self._p.rescue_states.split():
                self._rescue()

    # -- bearings

    def _work_off(self) -> None:
        """Messages in the order in which they came, as soon as tf has what they need."""
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
        """The first transform that the message lacks, in words; "" if none."""
        sensor = conversions.frame_id(msg.header.frame_id)
        if not self._tf.can_transform(self._p.base_frame_id, sensor, rospy.Time(0)):
            return f"transform {self._p.base_frame_id} <- {sensor or 'the sensor (frame_id is empty)'}"
        for stamp in msg.stamps:
            if not self._tf.can_transform(self._p.odom_frame_id, self._p.base_frame_id, stamp):
                return f"transform {self._p.odom_frame_id} <- {self._p.base_frame_id} at {stamp.to_sec():.3f} s"
        return ""

    def _take(self, msg: LandmarkBearingsMsg) -> None:
        """One message, its transforms there: a fix, or why there is none."""
        mounting = conversions.mounting_from_transform(
            self._tf.lookup_transform(
                self._p.base_frame_id, conversions.frame_id(msg.header.frame_id), rospy.Time(0)
            ).transform
        )
        for bearing in bearing_messages.bearings_from_msg(msg, mounting):
            if bearing.landmark_id in self._landmarks:
                self._newest[bearing.landmark_id] = bearing, self._odom_from_base(bearing.stamp_ns)
            else:
                self._log.warn(f"bearing ignored: landmark {bearing.landmark_id!r} is not in {self._p.landmark_file}")
        if not self._newest:
            self._why_none = "no known landmark was seen"
            return
        newest_ns = max(bearing.stamp_ns for bearing, _ in self._newest.values())
        self._newest = {
            name: each for name, each in self._newest.items() if newest_ns - each[0].stamp_ns <= self._p.window_s * 1e9
        }
        in_order = sorted(self._newest.values(), key=lambda each: each[0].stamp_ns)
        self._fix_from(
            in_order[-1][1],
            bearings.collected(
                [bearing for bearing, _ in in_order],
                np.array([odometry for _, odometry in in_order]),
                mounting.base_from_laser,
                self._drift,
            ),
        )

    def _odom_from_base(self, stamp_ns: int) -> np.ndarray:
        return conversions.planar_from_transform(
            self._tf.lookup_transform(
                self._p.odom_frame_id, self._p.base_frame_id, conversions.stamp_from_ns(stamp_ns)
            ).transform
        )

    def _fix_from(self, odom_from_base: np.ndarray, taken: LandmarkBearings) -> None:
        solve = triangulation.average if self._p.method == "document" else triangulation.triangulate
        try:
            fix = solve(taken, self._landmarks, self._limits)
        except triangulation.TriangulationError as err:
            self._refuse(str(err))
            return
        self._fix, self._odom_at_fix = fix, odom_from_base
        if fix.excluded_ids:
            self._log.warn(f"bearings that contradict the others are left out: {', '.join(fix.excluded_ids)}")
        frame = self._p.global_frame_id
        self._poses.publish(conversions.pose_with_covariance(fix.stamp_ns, fix.map_from_base, fix.covariance, frame))
        self._markers.publish(landmark_display.fix_markers(fix, taken, self._landmarks, frame))
        x, y, yaw = fix.map_from_base
        rospy.loginfo(f"position from {', '.join(fix.used_ids)}: x {x:.2f} m, y {y:.2f} m, yaw {yaw:.3f} rad")

    def _refuse(self, why: str) -> None:
        self._why_none = why
        self._log.warn(f"no position from bearings: {why}")

    # -- initialpose

    def _serve_send(self, _request: TriggerRequest) -> TriggerResponse:
        try:
            mailbox.outcome(self._inbox.submit("commands", self._send_on_request), SERVICE_TIMEOUT_S)
        except (ValueError, TimeoutError) as err:
            return TriggerResponse(success=False, message=str(err))
        return TriggerResponse(success=True, message="sent to initialpose")

    def _send_on_request(self) -> None:
        if self._fix is None:
            raise ValueError(f"there is no position: {self._why_none}")
        age_s = self._clock.now_s - self._fix.stamp_ns * 1e-9
        if age_s > self._p.max_age_s:
            raise ValueError(
                f"the last position is {age_s:.0f} s old, allowed {self._p.max_age_s:g} s; since then: {self._why_none}"
            )
        self._send(self._fix, "as requested")

    def _rescue(self) -> None:
        """The localization does not know where it is: tell it, once for each fix."""
        fix = self._fix
        if (
            fix is None
            or fix.stamp_ns <= self._sent_ns
            or (fix.stamp_ns - self._rescued_ns) * 1e-9 < self._p.rescue_period_s
        ):
            return
        self._rescued_ns = fix.stamp_ns
        try:
            self._send(fix, f"the localization is {self._state}")
        except ValueError as err:
            self._log.warn(f"initialpose not sent: {err}")

    def _send(self, fix: Fix, why: str) -> None:
        """As of the newest odometry: whoever receives it need not remember the odometry of a whole turn."""
        try:
            newest = self._tf.lookup_transform(self._p.odom_frame_id, self._p.base_frame_id, rospy.Time(0))
        except tf2_ros.TransformException as err:  # tf was cleared since the fix
            raise ValueError(f"no odometry to carry the position along: {err}") from err
        self._sent_ns = fix.stamp_ns
        step = se2.compose(se2.inverse(self._odom_at_fix), conversions.planar_from_transform(newest.transform))
        fix = triangulation.carried_along(fix, conversions.ns_from_stamp(newest.header.stamp), step, self._drift)
        floor = np.diag(np.square([self._p.min_position_sigma_m] * 2 + [self._p.min_heading_sigma_rad]))
        self._initial_poses.publish(
            conversions.pose_with_covariance(
                fix.stamp_ns, fix.map_from_base, fix.covariance + floor, self._p.global_frame_id
            )
        )
        rospy.loginfo(f"initialpose sent, {why}")

    def _clock_jumped_back(self) -> bool:
        jump = self._clock.tick()
        if jump is None:
            return False
        rospy.logwarn(f"{jump}: bearings start over")
        self._tf.clear()
        self._waiting, self._newest, self._fix, self._state = [], {}, None, ""
        self._why_none = "no bearings came since time jumped back"
        self._sent_ns = self._rescued_ns = 0
        return True


def main() -> None:
    """Start the node; exit code 2 if a parameter or the landmark file cannot be used."""
    shutdown.run_node(
        "landmarks", lambda given: LandmarksNode(params.load(LandmarksNodeParams, given, rospy.get_name()))
    )
