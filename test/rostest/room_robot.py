"""A robot that drives a circle in a room, for rostests that need a real scan and can do without a building.

The room's map is turned in its frame (an origin with yaw).
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass, replace
from typing import Any, Callable, List, Optional, Sequence, Tuple

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion, TransformStamped
from rostest_support import wait_until
from sensor_msgs.msg import LaserScan

from glass_nav.geometry import se2
from glass_nav.ros import conversions
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world.grid_map import GridMap

MAP_FROM_ODOM = np.array([1.0, 2.0, 0.5])
BEAMS = np.linspace(-2.0, 2.0, 181)
RATE_HZ = 10.0
RANGE_MAX_M = 20.0
TURN_RAD_S = 0.25  # round the circle


def room() -> GridMap:
    """10 x 7 m of free space, a cabinet in one corner so that it looks the same from nowhere else; 1 m of nothing known
    around it."""
    occupancy = np.full((190, 250), -1, dtype=np.int8)
    occupancy[20:170, 20:230] = 100
    occupancy[25:165, 25:225] = 0
    occupancy[120:125, 170:225], occupancy[120:165, 170:175] = 100, 100
    occupancy[125:165, 175:225] = -1  # in the cabinet
    return GridMap(occupancy, 0.05, se2.compose(np.array([-1.0, -2.0, 0.4]), np.array([-1.0, -1.0, 0.0])))


@dataclass
class Lidar:
    """One of the robot's lidars."""

    topic: str = "scan"
    frame: str = "laser"
    mounting: Tuple[float, float, float] = (0.2, 0.0, 0.3)  # x, y, yaw on the robot
    upside_down: bool = False
    swings: bool = False  # the mounting turns to and fro
    beams: Tuple[float, float] = (BEAMS[0], BEAMS[-1])
    turn_s: float = 0.0  # from its first beam to its last one
    silent: bool = False

    def base_from_laser(self, time_s: float) -> np.ndarray:
        """(3,) seen from above."""
        swing_rad = 0.6 * math.sin(2.0 * time_s) if self.swings else 0.0
        return np.array(self.mounting) + np.array([0.0, 0.0, swing_rad])

    def transform(self, stamp_ns: int) -> TransformStamped:
        """tf base_link -> laser."""
        x, y, yaw = self.base_from_laser(stamp_ns * 1e-9)
        msg = conversions.transform_stamped(stamp_ns, "base_link", self.frame, np.array([x, y, yaw]))
        if self.upside_down:  # turned about its own x axis by pi, after the yaw
            msg.transform.rotation = Quaternion(math.cos(0.5 * yaw), math.sin(0.5 * yaw), 0.0, 0.0)
        return msg


class Robot:
    """Drives the circle and publishes tf and scans by the wall clock."""

    def __init__(self, grid_map: GridMap, caster: Any = None, lidars: Sequence[Lidar] = ()) -> None:
        """
        Args:
            grid_map: the room.
            caster: cast(poses, angles, max_range); what the lidars truly see.
            lidars: one when not given.
        """
        self._caster = RayCaster(grid_map) if caster is None else caster
        self._centre = se2.compose(grid_map.map_from_grid, np.array([5.5, 4.2, 0.0]))
        self._turned_rad = 0.0
        self._steps = 0
        self.lidars: List[Lidar] = list(lidars) or [Lidar()]
        self._as_built = [replace(lidar) for lidar in self.lidars]
        self.moving = True
        self.odometry_is_told = True
        self.map_from_odom = MAP_FROM_ODOM
        self.spoil: Callable[[LaserScan], Optional[LaserScan]] = lambda msg: msg
        self._scans = {
            topic: rospy.Publisher(topic, LaserScan, queue_size=10) for topic in {lidar.topic for lidar in self.lidars}
        }
        self._broadcaster = tf2_ros.TransformBroadcaster()
        threading.Thread(target=self._run, daemon=True).start()

    @property
    def lidar(self) -> Lidar:
        """The first one."""
        return self.lidars[0]

    def reset(self) -> None:
        """As at the start, but for the place."""
        self.moving = self.odometry_is_told = True
        self.map_from_odom = MAP_FROM_ODOM
        self.spoil = lambda msg: msg
        for lidar, built in zip(self.lidars, self._as_built):
            vars(lidar).update(vars(built))

    def map_from_base(self) -> np.ndarray:
        """Where the robot truly is."""
        return self._on_the_circle(self._turned_rad)

    def _on_the_circle(self, turned: float) -> np.ndarray:
        return se2.compose(
            self._centre, np.array([1.2 * math.cos(turned), 1.2 * math.sin(turned), turned + math.pi / 2])
        )

    def odom_from_base(self) -> np.ndarray:
        """What odometry says, which has no error."""
        return se2.compose(se2.inverse(self.map_from_odom), self.map_from_base())

    def make_steps(self, count: int) -> None:
        """Returns after so many more turns of the lidar."""
        wanted = self._steps + count
        if not wait_until(lambda: self._steps >= wanted, 30.0):
            raise AssertionError(f"the robot of the test made no {count} steps within 30 s")

    def _run(self) -> None:
        while not rospy.is_shutdown():
            self._step(rospy.Time.now())
            self._steps += 1
            time.sleep(1.0 / RATE_HZ)

    def _step(self, stamp: rospy.Time) -> None:
        if self.moving:
            self._turned_rad += TURN_RAD_S / RATE_HZ
        stamp_ns = conversions.ns_from_stamp(stamp)
        transforms = [lidar.transform(stamp_ns) for lidar in self.lidars]
        if self.odometry_is_told:
            transforms.append(conversions.transform_stamped(stamp_ns, "odom", "base_link", self.odom_from_base()))
        self._broadcaster.sendTransform(transforms)
        for lidar in self.lidars:
            msg = None if lidar.silent else self.spoil(self._scan(lidar, stamp_ns))
            if msg is not None:
                self._scans[lidar.topic].publish(msg)

    def _scan(self, lidar: Lidar, stamp_ns: int) -> LaserScan:
        bearings = BEAMS[(BEAMS >= lidar.beams[0]) & (BEAMS <= lidar.beams[1])]
        base_from_laser = lidar.base_from_laser(stamp_ns * 1e-9)
        seen = -bearings if lidar.upside_down else bearings
        step_s = lidar.turn_s / (len(bearings) - 1)
        if lidar.turn_s:
            turned = self._turned_rad + self.moving * TURN_RAD_S * step_s * np.arange(len(bearings))
            beams = [
                se2.compose(se2.compose(self._on_the_circle(each), base_from_laser), np.array([0.0, 0.0, bearing]))
                for each, bearing in zip(turned, seen)
            ]
            ranges = self._caster.cast(np.array(beams), np.zeros(1), RANGE_MAX_M)[:, 0]
        else:
            map_from_laser = se2.compose(self.map_from_base(), base_from_laser)
            ranges = self._caster.cast(map_from_laser[None], seen, RANGE_MAX_M)[0]
        return LaserScan(
            header=conversions.header(stamp_ns, "/" + lidar.frame),
            angle_min=bearings[0],
            angle_max=bearings[-1],
            angle_increment=BEAMS[1] - BEAMS[0],
            time_increment=step_s,
            range_min=0.05,
            range_max=RANGE_MAX_M,
            ranges=ranges.tolist(),
        )


def pose_message(planar: np.ndarray, variance: float = 0.01) -> PoseWithCovarianceStamped:
    """What somebody sends on initialpose, now."""
    msg = PoseWithCovarianceStamped()
    msg.header.frame_id, msg.header.stamp = "map", rospy.Time.now()
    msg.pose.pose = conversions.pose_from_planar(planar)
    spatial = np.zeros((6, 6))
    spatial[[0, 1, 5], [0, 1, 5]] = variance
    msg.pose.covariance = spatial.ravel().tolist()
    return msg


def changed(msg: Any, **values: Any) -> Any:
    """The message with fields set by dotted name, dots written as __."""
    for name, value in values.items():
        *parents, last = name.split("__")
        part = msg
        for parent in parents:
            part = getattr(part, parent)
        setattr(part, last, value)
    return msg
