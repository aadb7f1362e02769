"""Writes a simulated robot as a ROS 1 bag, with the ground truth.

/scan, /odom, /tf (odom -> base_link), /joint_states (of two wheels), /tf_static (base_link -> laser), /clock; and the truth: /ground_truth in the
frame map, /true_beams with the stamps of /scan.
B beams.
"""

from __future__ import annotations

from typing import Sequence

import numpy as np

from glass_nav.recording.message_writer import TF_TYPE, MessageWriter
from glass_nav.recording.messages import TRUE_BEAMS
from glass_nav.sensing import deskew
from glass_nav.sensing.scan import Scan

MAP, ODOM, BASE, LASER = "map", "odom", "base_link", "laser"


class BagWriter(MessageWriter):
    """Write in order of time."""

    KINDS = {
        "/scan": "sensor_msgs/msg/LaserScan",
        "/odom": "nav_msgs/msg/Odometry",
        "/tf": TF_TYPE,
        "/joint_states": "sensor_msgs/msg/JointState",
        "/tf_static": TF_TYPE,
        "/clock": "rosgraph_msgs/msg/Clock",
        "/ground_truth": "geometry_msgs/msg/PoseStamped",
        "/true_beams": "glass_nav/msg/TrueBeams",
    }
    LATCHED = ("/tf_static",)
    OWN_TYPES = {"glass_nav/msg/TrueBeams": TRUE_BEAMS}

    def mounting(self, stamp_ns: int, base_from_laser: np.ndarray) -> None:
        """Writes the pose of the laser on the robot, (3,), to /tf_static; once, before the first scan."""
        self._send("/tf_static", stamp_ns, transforms=[self._transform(stamp_ns, BASE, LASER, base_from_laser)])

    def odometry(self, stamp_ns: int, odom_from_base: np.ndarray, velocity: np.ndarray) -> None:
        """/odom, /tf and /clock.

        Args:
            odom_from_base: (3,) pose.
            velocity: (3,) forward, left [m/s], turn [rad/s].
        """
        self._send("/clock", stamp_ns, clock=self._time(stamp_ns))
        self._send("/tf", stamp_ns, transforms=[self._transform(stamp_ns, ODOM, BASE, odom_from_base)])
        twist = self._new(
            "geometry_msgs/Twist",
            linear=self._vector("Vector3", velocity[0], velocity[1]),
            angular=self._new("geometry_msgs/Vector3", x=0.0, y=0.0, z=float(velocity[2])),
        )
        self._send(
            "/odom",
            stamp_ns,
            header=self._header(stamp_ns, ODOM),
            child_frame_id=BASE,
            pose=self._new(
                "geometry_msgs/PoseWithCovariance", pose=self._pose(odom_from_base), covariance=np.zeros(36)
            ),
            twist=self._new("geometry_msgs/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
        )

    def wheels(self, stamp_ns: int, joints: Sequence[str], turned_rad: np.ndarray) -> None:
        """/joint_states: how far wheels have turned, by the names of their joints."""
        self._send(
            "/joint_states",
            stamp_ns,
            header=self._header(stamp_ns, ""),
            name=list(joints),
            position=np.asarray(turned_rad, float),
            velocity=np.zeros(0),
            effort=np.zeros(0),
        )

    def scan(self, scan: Scan, period_s: float) -> None:
        """/scan, recorded at the time of its last beam; the laser turns once in period_s."""
        angles_rad = scan.angles_rad
        increment = float(angles_rad[1] - angles_rad[0]) if len(scan) > 1 else 0.0
        self._send(
            "/scan",
            scan.stamp_ns + deskew.sweep_ns(len(scan), scan.time_increment_s),
            header=self._header(scan.stamp_ns, LASER),
            angle_min=float(angles_rad[0]),
            angle_max=float(angles_rad[-1]),
            angle_increment=increment,
            time_increment=scan.time_increment_s,
            scan_time=period_s,
            range_min=scan.range_min_m,
            range_max=scan.range_max_m,
            ranges=scan.ranges_m.astype(np.float32),
            intensities=np.array([] if scan.intensities is None else scan.intensities, np.float32),
        )

    def truth(
        self, stamp_ns: int, map_from_base: np.ndarray, case: np.ndarray, exact_m: np.ndarray, crossing_m: np.ndarray
    ) -> None:
        """/ground_truth and /true_beams of the scan with that stamp: (3,), (B,) and (B,) as in TrueBeams.msg."""
        self._send("/ground_truth", stamp_ns, header=self._header(stamp_ns, MAP), pose=self._pose(map_from_base))
        self._send(
            "/true_beams",
            stamp_ns,
            header=self._header(stamp_ns, LASER),
            cases=case.astype(np.uint8),
            exact=exact_m.astype(np.float32),
            crossing=crossing_m.astype(np.float32),
        )
