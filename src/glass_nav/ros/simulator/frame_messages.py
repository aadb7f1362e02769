"""Converts frames of the simulator to ROS messages. B beams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState, LaserScan

from glass_nav.msg import TrueBeams
from glass_nav.ros import conversions
from glass_nav.sensing.scan import Scan
from glass_nav.simulation.lidar import TrueScan
from glass_nav.simulation.odometry import JOINTS
from glass_nav.simulation.simulation import Frame, OdometrySample

START_DEVIATION = np.array([0.1, 0.1, 0.05])  # m, m, rad: of a person who points at the robot on a map


@dataclass(frozen=True)
class FrameNames:
    """Names of the frames of the simulated robot."""

    map: str = "map"
    odom: str = "odom"
    base: str = "base_link"
    laser: str = "laser"


def velocity_from_msg(msg: Twist) -> np.ndarray:
    """(3,) forward, left [m/s], turn [rad/s]; ValueError if one of them is not finite."""
    velocity = np.array([msg.linear.x, msg.linear.y, msg.angular.z])
    if not np.all(np.isfinite(velocity)):
        raise ValueError(
            f"a velocity must be finite, got linear.x {msg.linear.x}, linear.y {msg.linear.y}, "
            f"angular.z {msg.angular.z}"
        )
    return velocity


def scan_msg(scan: Scan, period_s: float, frame: str) -> LaserScan:
    """Scan -> LaserScan, as a driver sends it; the laser turns once in period_s."""
    angles_rad = scan.angles_rad
    return LaserScan(
        header=conversions.header(scan.stamp_ns, frame),
        angle_min=angles_rad[0],
        angle_max=angles_rad[-1],
        angle_increment=angles_rad[1] - angles_rad[0],
        scan_time=period_s,
        time_increment=scan.time_increment_s,
        range_min=scan.range_min_m,
        range_max=scan.range_max_m,
        ranges=scan.ranges_m.tolist(),
        intensities=[] if scan.intensities is None else scan.intensities.tolist(),
    )


def true_beams_msg(stamp_ns: int, truth: TrueScan, frame: str) -> TrueBeams:
    return TrueBeams(
        header=conversions.header(stamp_ns, frame),
        cases=truth.case.astype(np.uint8).tobytes(),
        exact=truth.exact_m.tolist(),
        crossing=truth.crossing_m.tolist(),
    )


def odometry_msg(reading: OdometrySample, names: FrameNames) -> Odometry:
    msg = Odometry(header=conversions.header(reading.stamp_ns, names.odom), child_frame_id=names.base)
    msg.pose.pose = conversions.pose_from_planar(reading.odom_from_base)
    twist = msg.twist.twist
    twist.linear.x, twist.linear.y, twist.angular.z = (float(value) for value in reading.velocity)
    return msg


def wheels_msg(stamp_ns: int, wheels_rad: np.ndarray) -> JointState:
    return JointState(
        header=conversions.header(stamp_ns, ""), name=list(JOINTS), position=[float(angle) for angle in wheels_rad]
    )


def ground_truth_msg(frame: Frame, names: FrameNames) -> PoseStamped:
    return PoseStamped(
        header=conversions.header(frame.stamp_ns, names.map), pose=conversions.pose_from_planar(frame.map_from_base)
    )


def initial_pose_msg(frame: Frame, names: FrameNames) -> PoseWithCovarianceStamped:
    """The robot's pose, as a person gives it with rviz."""
    msg = PoseWithCovarianceStamped(header=conversions.header(frame.stamp_ns, names.map))
    msg.pose.pose = conversions.pose_from_planar(frame.map_from_base)
    spatial = np.zeros((6, 6))
    spatial[[0, 1, 5], [0, 1, 5]] = START_DEVIATION**2
    msg.pose.covariance = spatial.ravel().tolist()
    return msg
