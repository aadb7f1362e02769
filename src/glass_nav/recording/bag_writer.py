"""A simulated robot -> a ROS 1 bag, as a real robot's is recorded, with the truth beside; through rosbags.

/scan, /odom, /tf (odom -> base_link), /tf_static (base_link -> laser), /clock; and the truth: /ground_truth in the
frame map, /true_beams with the stamps of /scan. No ROS needed, and the same for rosbags 0.9.23 and later.
B beams.
"""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType
from typing import Any, Dict, Optional, Type

import numpy as np

from glass_nav.recording.recording import RecordingError
from glass_nav.sensing import deskew
from glass_nav.sensing.scan import Scan

MAP, ODOM, BASE, LASER = "map", "odom", "base_link", "laser"
TF_MESSAGE = "geometry_msgs/TransformStamped[] transforms\n"
TRUE_BEAMS = "Header header\nuint8[] cases\nfloat32[] exact\nfloat32[] crossing\n"  # msg/TrueBeams.msg without comments
KINDS = {
    "/scan": "sensor_msgs/msg/LaserScan",
    "/odom": "nav_msgs/msg/Odometry",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/clock": "rosgraph_msgs/msg/Clock",
    "/ground_truth": "geometry_msgs/msg/PoseStamped",
    "/true_beams": "glass_nav/msg/TrueBeams",
}


class BagWriter:
    """`with BagWriter(path) as bag:` write in the order of time; the file is there when all of it is.

    It grows under another name beside it, and an error leaves nothing behind. An older file of the name is replaced.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._growing = path.with_name(f".{path.name}.{os.getpid()}.part")
        self._connections: Dict[str, Any] = {}
        self._writer: Any = None

    def __enter__(self) -> "BagWriter":
        try:
            from rosbags.rosbag1 import Writer
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore
        except ImportError as err:
            raise RecordingError(f"{self._path}: writing bags needs the Python package rosbags "
                                 f"(pip install rosbags): {err}") from err
        self._store = get_typestore(Stores.ROS1_NOETIC)
        self._store.register(get_types_from_msg(TF_MESSAGE, KINDS["/tf"]))
        self._store.register(get_types_from_msg(TRUE_BEAMS, KINDS["/true_beams"]))
        if self._path.is_dir():
            raise RecordingError(f"{self._path}: is a folder, a bag is a file")
        try:
            self._growing.unlink()
        except FileNotFoundError:
            pass
        self._writer = Writer(self._growing)
        try:
            self._writer.open()
        except OSError as err:
            raise RecordingError(f"{self._path}: cannot be written: {err.strerror}") from err
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        try:
            self._writer.close()
            if kind is None:
                os.replace(self._growing, self._path)
        finally:
            if self._growing.exists():
                self._growing.unlink()

    def mounting(self, stamp_ns: int, base_from_laser: np.ndarray) -> None:
        """Where the laser sits on the robot, (3,): /tf_static, once, before the first scan."""
        self._send("/tf_static", stamp_ns, transforms=[self._transform(stamp_ns, BASE, LASER, base_from_laser)])

    def odometry(self, stamp_ns: int, odom_from_base: np.ndarray, velocity: np.ndarray) -> None:
        """/odom and /tf, and the time.

        Args:
            odom_from_base: (3,) pose.
            velocity: (3,) forward, left [m/s], turn [rad/s].
        """
        self._send("/clock", stamp_ns, clock=self._time(stamp_ns))
        self._send("/tf", stamp_ns, transforms=[self._transform(stamp_ns, ODOM, BASE, odom_from_base)])
        twist = self._new("geometry_msgs/Twist", linear=self._vector("Vector3", velocity[0], velocity[1]),
                          angular=self._new("geometry_msgs/Vector3", x=0.0, y=0.0, z=float(velocity[2])))
        self._send("/odom", stamp_ns, header=self._header(stamp_ns, ODOM), child_frame_id=BASE,
                   pose=self._new("geometry_msgs/PoseWithCovariance", pose=self._pose(odom_from_base),
                                  covariance=np.zeros(36)),
                   twist=self._new("geometry_msgs/TwistWithCovariance", twist=twist, covariance=np.zeros(36)))

    def scan(self, scan: Scan, period_s: float) -> None:
        """/scan, recorded when its last beam was there; the laser turns once in period_s."""
        angles_rad = scan.angles_rad
        increment = float(angles_rad[1] - angles_rad[0]) if len(scan) > 1 else 0.0
        self._send("/scan", scan.stamp_ns + deskew.turn_ns(len(scan), scan.time_increment_s),
                   header=self._header(scan.stamp_ns, LASER),
                   angle_min=float(angles_rad[0]), angle_max=float(angles_rad[-1]), angle_increment=increment,
                   time_increment=scan.time_increment_s, scan_time=period_s,
                   range_min=scan.range_min_m, range_max=scan.range_max_m,
                   ranges=scan.ranges_m.astype(np.float32), intensities=np.zeros(0, np.float32))

    def truth(self, stamp_ns: int, map_from_base: np.ndarray, case: np.ndarray, exact_m: np.ndarray,
              crossing_m: np.ndarray) -> None:
        """/ground_truth and /true_beams of the scan with that stamp: (3,), (B,) and (B,) as in TrueBeams.msg."""
        self._send("/ground_truth", stamp_ns, header=self._header(stamp_ns, MAP), pose=self._pose(map_from_base))
        self._send("/true_beams", stamp_ns, header=self._header(stamp_ns, LASER), cases=case.astype(np.uint8),
                   exact=exact_m.astype(np.float32), crossing=crossing_m.astype(np.float32))

    def _send(self, topic: str, stamp_ns: int, **fields: Any) -> None:
        kind = KINDS[topic]
        if topic not in self._connections:  # latched: a player sends what is static to those who come late, too
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=self._store, latching=1 if topic == "/tf_static" else None)
        message = self._store.types[kind](**fields)
        self._writer.write(self._connections[topic], stamp_ns, self._store.serialize_ros1(message, kind))

    def _new(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind.replace("/", "/msg/")](**fields)

    def _time(self, stamp_ns: int) -> Any:
        return self._new("builtin_interfaces/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)

    def _header(self, stamp_ns: int, frame: str) -> Any:
        return self._new("std_msgs/Header", seq=0, stamp=self._time(stamp_ns), frame_id=frame)

    def _vector(self, kind: str, x: float, y: float) -> Any:
        return self._new(f"geometry_msgs/{kind}", x=float(x), y=float(y), z=0.0)

    def _rotation(self, yaw_rad: float) -> Any:
        return self._new("geometry_msgs/Quaternion", x=0.0, y=0.0, z=float(np.sin(0.5 * yaw_rad)),
                         w=float(np.cos(0.5 * yaw_rad)))

    def _pose(self, planar: np.ndarray) -> Any:
        return self._new("geometry_msgs/Pose", position=self._vector("Point", planar[0], planar[1]),
                         orientation=self._rotation(float(planar[2])))

    def _transform(self, stamp_ns: int, parent: str, child: str, parent_from_child: np.ndarray) -> Any:
        x, y, yaw = (float(value) for value in parent_from_child)
        transform = self._new("geometry_msgs/Transform", translation=self._vector("Vector3", x, y),
                              rotation=self._rotation(yaw))
        return self._new("geometry_msgs/TransformStamped", header=self._header(stamp_ns, parent),
                         child_frame_id=child, transform=transform)
