"""simulator_node: a robot in a building of walls and glass, in simulated time, with the ground truth of every beam.

Wiring only: the robot is simulation.Simulation. One loop moves it; callbacks store messages.

Subscribes: cmd_vel (Twist; takes precedence over the path), tf map -> odom (only to know whether the localization
    runs and keeps up).
Publishes: /clock, scan (LaserScan), odom (Odometry), tf odom -> base_link and base_link -> laser (static),
    landmark_bearings (LandmarkBearings, at the end of each sweep of the scanner, if the building has tags), tf
    base_link -> emitter (static),
    ground_truth (PoseStamped in map) and true_beams (TrueBeams) with the stamps of scan, ~blocked (Bool, latched: an
    obstacle blocks the robot), initialpose (if ~give_initial_pose), map and map_metadata (latched, if ~serve_map).
Services: static_map (GetMap, if ~serve_map).
Parameters: SimulatorNodeParams, read once; explained in config/simulator.yaml.
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass, replace
from typing import Any, Optional

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from glass_nav import params
from glass_nav.msg import LandmarkBearings, TrueBeams
from glass_nav.ros import command_line, conversions, shutdown
from glass_nav.ros.landmarks import bearing_messages
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.mailbox import Mailbox
from glass_nav.ros.simulator import frame_messages
from glass_nav.ros.simulator.frame_messages import FrameNames
from glass_nav.ros.tools.served_map import ServedMap
from glass_nav.simulation import building_file, building_map, erased_glass, lidar, shipped_buildings, start_place
from glass_nav.simulation.landmark_scanner import ScannerModel
from glass_nav.simulation.path_follower import PathFollower, PathFollowerParams
from glass_nav.simulation.robot import RobotParams
from glass_nav.simulation.simulation import CONTROL_S, Frame, Simulation
from glass_nav.simulation.steering import Audience, Pace, Steering

ANSWER_WAIT_S = 1.0  # at full speed: longest wait for map -> odom of a scan, by the wall clock
DRIVER_WAIT_S = 2.0  # longest wait for a driver's next command, by the wall clock


@dataclass(frozen=True)
class SimulatorNodeParams:
    """Private parameters of the node. Units by REP 103."""

    building: str = "glass_office"  # yaml file, folder with building.yaml, or the name of a building in maps/
    opaque: bool = False  # the same building with film on all glass; the map is the same
    start: str = ""  # "x y yaw" in the map, or "random" by the seed; empty: the path's
    path: str = ""  # name, file of waypoints, or "first"; "none" or empty: cmd_vel only
    path_speed_m_s: float = 0.6
    repeat_path: bool = False  # back and forth along the path, forever
    lidar: str = "sensitive"  # sensitive, weak, coated
    beams: int = 0  # 0: the lidar's own
    echo: str = ""  # first, strongest, last; empty: the lidar's own
    robot: str = "diff"  # diff, omni
    braking_factor: float = 1.0  # deceleration over acceleration
    seed: int = 0
    changed: float = 0.0  # share of the movable furniture that moved since the map was drawn
    glass_erased: float = 0.0  # share of the panes that the served map lacks
    scan_rate_hz: float = 10.0
    turn_time_s: float = 0.0  # from the first beam of a scan to the last one
    speed_factor: float = 1.0  # simulated seconds per second; 0: as fast as the localization follows
    wait_for_driver: bool = False  # time does not pass while a command to move is more than 0.2 s old
    laser_x_m: float = 0.12  # where the laser sits on the robot
    laser_y_m: float = 0.0
    laser_yaw_rad: float = 0.0
    landmark_reading_deg: float = 1.0  # steps in which bearings to tags are read
    landmark_move_s: float = 0.8  # of the scanner: a sweep of four tags takes about 60 s
    emitter_x_m: float = 0.0  # where the landmark scanner sits on the robot
    emitter_y_m: float = 0.0
    emitter_yaw_rad: float = 0.0
    give_initial_pose: bool = False
    serve_map: bool = False
    map_resolution_m: float = 0.05
    global_frame_id: str = "map"
    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"
    laser_frame_id: str = "laser"
    emitter_frame_id: str = "emitter"

    def __post_init__(self) -> None:
        if not 0.0 <= self.speed_factor < math.inf:
            raise ValueError(f"~speed_factor must be >= 0, got {self.speed_factor}")
        if not 0.0 <= self.glass_erased <= 1.0:
            raise ValueError(f"~glass_erased must be 0 to 1, got {self.glass_erased}")
        if self.beams < 0:
            raise ValueError(f"~beams must be >= 0, got {self.beams}")
        if not 0.01 <= self.map_resolution_m <= 1.0:
            raise ValueError(f"~map_resolution_m must be 0.01 to 1 m, got {self.map_resolution_m}")
        names = (
            self.global_frame_id,
            self.odom_frame_id,
            self.base_frame_id,
            self.laser_frame_id,
            self.emitter_frame_id,
        )
        if len(set(names)) < len(names) or not all(names):
            raise ValueError(
                "~global_frame_id, ~odom_frame_id, ~base_frame_id, ~laser_frame_id and ~emitter_frame_id "
                f"must differ and name a frame, got {', '.join(map(repr, names))}"
            )


@dataclass(frozen=True)
class _Drive:
    """The objects that the parameters describe, built and validated."""

    simulation: Simulation
    follower: Optional[PathFollower]


class SimulatorNode:
    """Wiring only: each step advances time and publishes messages."""

    def __init__(self, p: SimulatorNodeParams) -> None:
        """
        Raises:
            ValueError: an invalid building, path, lidar or robot; one line.
        """
        self._p = p
        drive = _drive(p)
        self._simulation = drive.simulation
        self._steering = Steering(drive.follower, p.repeat_path, wait_for_answer=p.give_initial_pose)
        self._names = FrameNames(p.global_frame_id, p.odom_frame_id, p.base_frame_id, p.laser_frame_id)
        self._log = LogThrottle()
        self._inbox = Mailbox(commands=1)
        self._newcomers = Mailbox(publish=10)  # one for each new subscriber of initialpose
        self._blocked = False
        self._answers = 0  # transforms map -> odom; counted by the thread of tf
        self._answers_used, self._answering = 0, False
        self._began_s = time.monotonic()
        self._next_scan_ns = self._simulation.stamp_ns

        self._clock = rospy.Publisher("/clock", Clock, queue_size=100, tcp_nodelay=True)
        self._scans = rospy.Publisher("scan", LaserScan, queue_size=100, tcp_nodelay=True)
        self._odometry = rospy.Publisher("odom", Odometry, queue_size=100, tcp_nodelay=True)
        self._wheels = rospy.Publisher("joint_states", JointState, queue_size=100, tcp_nodelay=True)
        self._truth = rospy.Publisher("ground_truth", PoseStamped, queue_size=100)
        self._true_beams = rospy.Publisher("true_beams", TrueBeams, queue_size=100)
        self._bearings = rospy.Publisher("landmark_bearings", LandmarkBearings, queue_size=10)
        self._blocked_flag = rospy.Publisher("~blocked", Bool, queue_size=10, latch=True)
        self._transforms = rospy.Publisher("/tf", TFMessage, queue_size=100, tcp_nodelay=True)
        self._static_transforms = tf2_ros.StaticTransformBroadcaster()
        if p.serve_map:
            self._serve_map()
        if p.give_initial_pose:
            self._initial_pose = rospy.Publisher(
                "initialpose", PoseWithCovarianceStamped, queue_size=2, subscriber_listener=_Listener(self._newcomers)
            )
        rospy.Subscriber("cmd_vel", Twist, lambda msg: self._inbox.put("commands", msg), queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("/tf", TFMessage, self._hear_localization, queue_size=100, tcp_nodelay=True)

    def run(self, ending: threading.Event) -> None:
        """The only thread that moves the robot; returns when ROS shuts down or ending is set."""
        simulation = self._simulation
        self._static_transforms.sendTransform(
            [
                conversions.transform_stamped(simulation.stamp_ns, self._names.base, child, base_from_child)
                for child, base_from_child in (
                    (self._names.laser, simulation.base_from_laser),
                    (self._p.emitter_frame_id, simulation.base_from_emitter),
                )
            ]
        )
        self._blocked_flag.publish(Bool(False))
        self._publish_reading()
        pace = Pace(simulation.stamp_ns, time.monotonic())
        while not (rospy.is_shutdown() or ending.is_set()):
            if simulation.stamp_ns >= self._next_scan_ns:
                self._next_scan_ns += round(simulation.scan_period_s * 1e9)
                self._publish_frame(simulation.look())
                if self._p.speed_factor == 0.0:
                    self._await_answer(ending)
            if self._p.wait_for_driver:
                self._await_command(ending)
            left_s = (self._next_scan_ns - simulation.stamp_ns) * 1e-9
            simulation.move(min(CONTROL_S, left_s), self._wanted_velocity())
            self._publish_reading()
            self._keep_pace(pace, ending)

    def _keep_pace(self, pace: Pace, ending: threading.Event) -> None:
        factor = self._p.speed_factor
        if factor == 0.0 and self._steering.waits:
            factor = 1.0  # the localization that it waits for needs the processor
        wait_s = pace.wait_s(self._simulation.stamp_ns, factor, time.monotonic())
        if wait_s > 0.0:
            ending.wait(wait_s)
        elif wait_s < 0.0:
            self._log.warn(f"slower than ~speed_factor {factor:g}: behind by {-wait_s:.1f} s", 30.0)

    # -- callbacks of other threads: they only store

    def _hear_localization(self, msg: TFMessage) -> None:
        for transform in msg.transforms:
            if (
                conversions.frame_id(transform.header.frame_id) == self._names.map
                and conversions.frame_id(transform.child_frame_id) == self._names.odom
            ):
                self._answers += 1

    # -- commands

    def _await_command(self, ending: threading.Event) -> None:
        """Let the driver keep up, on a machine that is busy: the next command may be late, and must not be too late."""
        until_s = time.monotonic() + DRIVER_WAIT_S
        self._take_commands(0.0)
        while self._steering.is_overdue(self._simulation.stamp_ns) and not ending.is_set():
            self._take_commands(0.01)
            if time.monotonic() > until_s:
                self._steering.give_up_waiting()

    def _take_commands(self, timeout_s: float) -> None:
        for msg in self._inbox.take(timeout_s)["commands"]:
            try:
                self._steering.take(frame_messages.velocity_from_msg(msg), self._simulation.stamp_ns)
            except ValueError as err:
                self._log.warn(f"cmd_vel refused: {err}")

    def _wanted_velocity(self) -> np.ndarray:
        self._take_commands(0.0)
        audience = Audience(self._answers, self._scans.get_num_connections(), time.monotonic() - self._began_s)
        return self._steering.velocity(self._simulation.stamp_ns, self._simulation.map_from_base, audience)

    # -- output

    def _publish_reading(self) -> None:
        """Publish the time and the wheel readings."""
        reading = self._simulation.reading
        self._clock.publish(Clock(conversions.stamp_from_ns(reading.stamp_ns)))
        self._transforms.publish(
            TFMessage(
                [
                    conversions.transform_stamped(
                        reading.stamp_ns, self._names.odom, self._names.base, reading.odom_from_base
                    )
                ]
            )
        )
        self._odometry.publish(frame_messages.odometry_msg(reading, self._names))
        if reading.wheels_rad is not None:
            self._wheels.publish(frame_messages.wheels_msg(reading.stamp_ns, reading.wheels_rad))
        for turn in self._simulation.take_turns():
            self._bearings.publish(
                bearing_messages.msg_from_bearings(turn.stamp_ns, turn.bearings, self._p.emitter_frame_id)
            )
        if self._simulation.blocked != self._blocked:
            self._blocked = self._simulation.blocked
            self._blocked_flag.publish(Bool(self._blocked))
            if self._blocked:
                x, y, _ = self._simulation.map_from_base
                self._log.warn(f"an obstacle stops the robot at x {x:.2f} m, y {y:.2f} m")

    def _publish_frame(self, frame: Frame) -> None:
        names, period_s = self._names, self._simulation.scan_period_s
        self._scans.publish(frame_messages.scan_msg(frame.scan, period_s, names.laser))
        self._truth.publish(frame_messages.ground_truth_msg(frame, names))
        if self._true_beams.get_num_connections():
            self._true_beams.publish(frame_messages.true_beams_msg(frame.stamp_ns, frame.truth, names.laser))
        for publish in self._newcomers.take(timeout_s=0.0)["publish"]:
            publish(frame_messages.initial_pose_msg(frame, names))

    def _serve_map(self) -> None:
        """Publish the map that the package draws of the building."""
        stamp = conversions.stamp_from_ns(self._simulation.stamp_ns)
        building = self._simulation.building
        erased = erased_glass.choose(building, self._p.glass_erased, self._p.seed)
        grid_map = building_map.draw(building, self._p.map_resolution_m, erased)
        self._map = ServedMap()
        self._map.give(conversions.msg_from_map(grid_map, stamp, self._names.map))

    def _await_answer(self, ending: threading.Event) -> None:
        """Wait for the localization's transform at this scan, unless it has stopped answering."""
        until_s = time.monotonic() + (ANSWER_WAIT_S if self._answering else 0.0)
        while self._answers == self._answers_used and time.monotonic() < until_s and not ending.wait(0.001):
            pass
        self._answering = self._answers > self._answers_used
        self._answers_used = self._answers


class _Listener(rospy.SubscribeListener):
    """Reports new subscribers."""

    def __init__(self, newcomers: Mailbox) -> None:
        super().__init__()
        self._newcomers = newcomers

    def peer_subscribe(self, topic_name: str, topic_publish: Any, peer_publish: Any) -> None:
        self._newcomers.put("publish", peer_publish)


def _drive(p: SimulatorNodeParams) -> _Drive:
    """Build the simulation and its path; ValueError with one line."""
    model = lidar.preset(p.lidar)
    if p.beams:
        model = replace(model, beams=p.beams)
    if p.echo:
        model = replace(model, echo=p.echo)
    building = building_file.load(shipped_buildings.find(p.building))
    if p.opaque:
        building = building.opaque()
    scanner = ScannerModel(reading_rad=math.radians(p.landmark_reading_deg), move_s=p.landmark_move_s)
    simulation = Simulation(
        building,
        model,
        RobotParams(p.robot, braking_factor=p.braking_factor),
        seed=p.seed,
        scan_rate_hz=p.scan_rate_hz,
        start=start_place.start(p.start, building, p.seed),
        base_from_laser=np.array([p.laser_x_m, p.laser_y_m, p.laser_yaw_rad]),
        changed_share=p.changed,
        turn_time_s=p.turn_time_s,
        scanner=scanner if len(building.tags) else None,
        base_from_emitter=np.array([p.emitter_x_m, p.emitter_y_m, p.emitter_yaw_rad]),
    )
    if p.path in ("", "none"):  # roslaunch cannot pass on an empty command-line argument
        return _Drive(simulation, None)
    return _Drive(simulation, simulation.follower(p.path, PathFollowerParams(speed_m_s=p.path_speed_m_s)))


def main() -> None:
    """Start the node; exit code 2 if a parameter cannot be used."""
    if command_line.answers_help(__doc__):
        return
    shutdown.run_node(
        "simulator", lambda given: SimulatorNode(params.load(SimulatorNodeParams, given, rospy.get_name()))
    )
