"""What tests of more than one room share: the real data, and small bags of a robot in a room."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np
import pytest

REPO = Path(__file__).resolve().parents[1]
UNIT = REPO / "test" / "unit"
CELL_M = 0.05
GIVING_WAY = 10  # niceness
# The room of RoomBag: 6 x 4 m without its upper right corner, so that it looks the same from no two places.
CORNERS_M = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 2.8], [4.6, 2.8], [4.6, 4.0], [0.0, 4.0]])


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Where tests run at a time, those that need no clock give way: rostests have their processor first.

    The group of those comes first, to a worker that gave way to nobody yet: see its marks, xdist_group.
    """
    if "PYTEST_XDIST_WORKER" in os.environ and not item.get_closest_marker("xdist_group"):
        os.nice(max(0, GIVING_WAY - os.nice(0)))


def pytest_collection_modifyitems(items: List[pytest.Item]) -> None:
    """Unit tests alone are traced for coverage: it costs a fifth of the time of the others, which reach no more."""
    for item in items:
        if UNIT not in item.path.parents:
            item.add_marker("no_cover")


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real logs and maps, GLASS_NAV_DATA. Without it a test skips, but fails in CI."""
    path = Path(os.environ.get("GLASS_NAV_DATA", REPO.parent / "shared" / "data"))
    if not (path / "logs").is_dir():
        reason = f"no real logs in {path}: set GLASS_NAV_DATA"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return path


@pytest.fixture(scope="session")
def room_map(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """map.yaml of the room, its lower left inner corner at (0, 0)."""
    folder = tmp_path_factory.mktemp("room")
    columns, rows = np.rint(CORNERS_M.max(axis=0) / CELL_M).astype(int) + 2
    grey = np.full((rows, columns), 254, np.uint8)  # the lowest row first
    grey[0, :] = grey[-1, :] = grey[:, 0] = grey[:, -1] = 0
    left, bottom = np.rint(CORNERS_M[3] / CELL_M).astype(int) + 1
    grey[bottom:, left:] = 0
    write_pgm(folder / "map.pgm", grey[::-1])
    path = folder / "map.yaml"
    path.write_text(
        f"image: map.pgm\nresolution: {CELL_M}\norigin: [{-CELL_M}, {-CELL_M}, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


def write_pgm(path: Path, grey: np.ndarray) -> None:
    path.write_bytes(b"P5\n%d %d\n255\n" % (grey.shape[1], grey.shape[0]) + grey.astype(np.uint8).tobytes())


def room_ranges(pose: np.ndarray, angles_rad: np.ndarray) -> np.ndarray:
    """Ranges (B,) from a pose (3,) inside the room to its walls: each ray cut with each wall."""
    ray = np.stack([np.cos(angles_rad + pose[2]), np.sin(angles_rad + pose[2])], axis=-1)[:, None]  # (B, 1, 2)
    wall = np.roll(CORNERS_M, -1, axis=0) - CORNERS_M
    to_corner = CORNERS_M - pose[:2]
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = ray[..., 0] * wall[:, 1] - ray[..., 1] * wall[:, 0]  # (B, W)
        along_ray = (to_corner[:, 0] * wall[:, 1] - to_corner[:, 1] * wall[:, 0]) / cross
        along_wall = (to_corner[:, 0] * ray[..., 1] - to_corner[:, 1] * ray[..., 0]) / cross
        met = (along_ray > 0.0) & (along_wall >= -1e-9) & (along_wall <= 1.0 + 1e-9)
    return np.where(met, along_ray, np.inf).min(axis=1)


def quaternion(roll: float, yaw: float) -> Tuple[float, float, float, float]:
    """x, y, z, w of Rz(yaw) Rx(roll)."""
    cr, sr, cy, sy = np.cos(roll / 2), np.sin(roll / 2), np.cos(yaw / 2), np.sin(yaw / 2)
    return float(cy * sr), float(sy * sr), float(sy * cr), float(cy * cr)


@dataclass
class RoomBag:
    """Writes a bag of a robot that drives an arc through the room, a scan every 0.1 s.

    Change the fields for the fault under test; scan_fields(index, fields) may change or drop (None) scans.
    """

    path: Path
    scans: int = 20
    beams: int = 60
    laser: Tuple[float, float, float] = (0.1, 0.0, 0.3)  # x, y, yaw on the robot
    laser_roll: float = 0.0
    odometry: str = "tf"  # "tf", "topic" or "none"
    odom_topics: Tuple[str, ...] = ("/odom",)
    odom_child: str = "base_link"
    truth_type: str = "PoseStamped"  # or PoseWithCovarianceStamped
    ground_truth: bool = True
    static_laser: bool = True  # on /tf_static rather than on /tf
    laser_tf: bool = True
    scan_topics: Tuple[str, ...] = ("/scan",)
    frame_prefix: str = ""  # "/" as old drivers write it
    compressed: bool = False
    amcl_error_m: Optional[float] = None  # another localization's, on /amcl_pose and tf map <- odom: at each fifth scan
    #                                       but the first it is so much more too far along x
    true_beams: Tuple[Tuple[str, str], ...] = ()  # topics and their types, TrueBeams or BeamCases; all beams diffuse
    true_fields: Callable[[int, Dict[str, Any]], Optional[Dict[str, Any]]] = lambda index, fields: fields
    scan_fields: Callable[[int, Dict[str, Any]], Optional[Dict[str, Any]]] = lambda index, fields: fields
    start_ns: int = 1_000_000_000_000

    @property
    def stamps_ns(self) -> np.ndarray:
        """(S,) of the scans."""
        return self.start_ns + 100_000_000 * np.arange(self.scans)

    def poses(self, stamps_ns: np.ndarray) -> np.ndarray:
        """(S, 3) of the robot in the room's map."""
        seconds = (stamps_ns - self.start_ns) * 1e-9
        yaw = 0.4 * seconds
        return np.stack([2.0 + 0.5 / 0.4 * np.sin(yaw), 1.2 + 0.5 / 0.4 * (1.0 - np.cos(yaw)), yaw], axis=-1)

    @staticmethod
    def distance_to_wall(points_m: np.ndarray) -> np.ndarray:
        """(N,) of points (N, 2) of the map, to the nearest wall."""
        wall = np.roll(CORNERS_M, -1, axis=0) - CORNERS_M
        offset = points_m[:, None] - CORNERS_M
        share = np.clip((offset * wall).sum(axis=-1) / (wall * wall).sum(axis=-1), 0.0, 1.0)
        return np.linalg.norm(offset - share[..., None] * wall, axis=-1).min(axis=1)

    def write(self) -> Path:
        """The bag; odometry starts at (0, 0, 0) and has no error."""
        from rosbags.rosbag1 import Writer
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        store = get_typestore(Stores.ROS1_NOETIC)
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
        for name in ("TrueBeams", "BeamCases"):
            store.register(get_types_from_msg((REPO / "msg" / f"{name}.msg").read_text(), f"glass_nav/msg/{name}"))
        types = store.types
        writer = Writer(self.path)
        if self.compressed:
            writer.set_compression(Writer.CompressionFormat.BZ2)
        connections: Dict[str, Any] = {}

        def time(stamp_ns: int) -> Any:
            return types["builtin_interfaces/msg/Time"](sec=int(stamp_ns) // 10**9, nanosec=int(stamp_ns) % 10**9)

        def header(stamp_ns: int, frame: str) -> Any:
            return types["std_msgs/msg/Header"](seq=0, stamp=time(stamp_ns), frame_id=frame)

        def vector(kind: str, x: float, y: float) -> Any:
            return types[f"geometry_msgs/msg/{kind}"](x=float(x), y=float(y), z=0.0)

        def rotation(roll: float, yaw: float) -> Any:
            x, y, z, w = quaternion(roll, yaw)
            return types["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w)

        def pose(values: np.ndarray) -> Any:
            return types["geometry_msgs/msg/Pose"](
                position=vector("Point", values[0], values[1]), orientation=rotation(0.0, values[2])
            )

        def stamped(stamp_ns: int, parent: str, child: str, values: Any, roll: float = 0.0) -> Any:
            transform = types["geometry_msgs/msg/Transform"](
                translation=vector("Vector3", values[0], values[1]), rotation=rotation(roll, values[2])
            )
            return types["geometry_msgs/msg/TransformStamped"](
                header=header(stamp_ns, self.frame_prefix + parent),
                child_frame_id=self.frame_prefix + child,
                transform=transform,
            )

        def send(topic: str, kind: str, stamp_ns: int, message: Any) -> None:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], int(stamp_ns), store.serialize_ros1(message, kind))

        def send_tf(topic: str, stamp_ns: int, *transforms: Any) -> None:
            send(
                topic, "tf2_msgs/msg/TFMessage", stamp_ns, types["tf2_msgs/msg/TFMessage"](transforms=list(transforms))
            )

        angles = np.linspace(-np.pi, np.pi, self.beams, endpoint=False)
        with writer:
            if self.laser_tf and self.static_laser:
                send_tf(
                    "/tf_static",
                    self.start_ns,
                    stamped(self.start_ns, "base_link", "laser", self.laser, self.laser_roll),
                )
            odometry_ns = self.start_ns + 50_000_000 * np.arange(-1, 2 * self.scans + 1)
            start = self.poses(self.stamps_ns[:1])[0]
            for stamp_ns, true in zip(odometry_ns.tolist(), self.poses(odometry_ns)):
                odom = np.array([true[0] - start[0], true[1] - start[1], true[2]])
                transforms = []
                if self.odometry == "tf":
                    transforms.append(stamped(stamp_ns, "odom", "base_link", odom))
                if self.laser_tf and not self.static_laser:
                    transforms.append(stamped(stamp_ns, "base_link", "laser", self.laser, self.laser_roll))
                if transforms:
                    send_tf("/tf", stamp_ns, *transforms)
                if self.odometry == "topic":
                    covariance = np.zeros(36)
                    twist = types["geometry_msgs/msg/Twist"](
                        linear=vector("Vector3", 0, 0), angular=vector("Vector3", 0, 0)
                    )
                    message = types["nav_msgs/msg/Odometry"](
                        header=header(stamp_ns, "odom"),
                        child_frame_id=self.odom_child,
                        pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose(odom), covariance=covariance),
                        twist=types["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=covariance),
                    )
                    for topic in self.odom_topics:
                        send(topic, "nav_msgs/msg/Odometry", stamp_ns, message)
            for index, (stamp_ns, true) in enumerate(zip(self.stamps_ns.tolist(), self.poses(self.stamps_ns))):
                x, y, yaw = self.laser
                cos, sin = np.cos(true[2]), np.sin(true[2])
                laser = np.array([true[0] + cos * x - sin * y, true[1] + sin * x + cos * y, true[2] + yaw])
                seen = -angles if abs(self.laser_roll) > np.pi / 2 else angles
                fields: Optional[Dict[str, Any]] = {
                    "stamp_ns": stamp_ns,
                    "frame": "laser",
                    "angle_min": float(angles[0]),
                    "angle_max": float(angles[-1]),
                    "angle_increment": float(angles[1] - angles[0]),
                    "range_min": 0.05,
                    "range_max": 10.0,
                    "ranges": room_ranges(laser, seen).astype(np.float32),
                }
                fields = self.scan_fields(index, fields)
                if fields is None:
                    continue
                message = types["sensor_msgs/msg/LaserScan"](
                    header=header(fields["stamp_ns"], self.frame_prefix + fields["frame"] if fields["frame"] else ""),
                    angle_min=fields["angle_min"],
                    angle_max=fields["angle_max"],
                    angle_increment=fields["angle_increment"],
                    time_increment=fields.get("time_increment", 0.0),
                    scan_time=0.1,
                    range_min=fields["range_min"],
                    range_max=fields["range_max"],
                    ranges=np.asarray(fields["ranges"], np.float32),
                    intensities=np.zeros(0, np.float32),
                )
                for topic in self.scan_topics:
                    send(topic, "sensor_msgs/msg/LaserScan", stamp_ns, message)
                truth = self.true_fields(
                    index,
                    {
                        "stamp_ns": fields["stamp_ns"],
                        "cases": np.ones(self.beams, np.uint8),
                        "crossing": np.full(self.beams, np.nan),
                    },
                )
                for topic, name in self.true_beams if truth is not None else ():
                    nothing = np.zeros(0, np.float32)
                    rest = (
                        {
                            "exact": np.asarray(fields["ranges"], np.float32),
                            "crossing": np.asarray(truth["crossing"], np.float32),
                        }
                        if name == "TrueBeams"
                        else {"expected": nothing, "residual": nothing, "weight": nothing}
                    )
                    kind = f"glass_nav/msg/{name}"
                    send(
                        topic,
                        kind,
                        stamp_ns,
                        types[kind](
                            header=header(truth["stamp_ns"], "laser"),
                            cases=np.asarray(truth["cases"], np.uint8),
                            **rest,
                        ),
                    )
                if self.amcl_error_m is not None and index and index % 5 == 0:
                    off = np.array([self.amcl_error_m * (index // 5), 0.0, 0.0])
                    send_tf("/tf", stamp_ns, stamped(stamp_ns, "map", "odom", off + [*start[:2], 0.0]))
                    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
                    send(
                        "/amcl_pose",
                        kind,
                        stamp_ns,
                        types[kind](
                            header=header(stamp_ns, "map"),
                            pose=types["geometry_msgs/msg/PoseWithCovariance"](
                                pose=pose(true + off), covariance=np.zeros(36)
                            ),
                        ),
                    )
                if self.ground_truth:
                    there = pose(true)
                    if self.truth_type == "PoseWithCovarianceStamped":
                        there = types["geometry_msgs/msg/PoseWithCovariance"](pose=there, covariance=np.zeros(36))
                    kind = f"geometry_msgs/msg/{self.truth_type}"
                    send("/ground_truth", kind, stamp_ns, types[kind](header=header(stamp_ns, "map"), pose=there))
        return self.path


@pytest.fixture
def room_bag(tmp_path: Path) -> Callable[..., RoomBag]:
    """room_bag(field=value, ...): a RoomBag that writes tmp_path/room.bag."""
    return lambda **fields: RoomBag(tmp_path / "room.bag", **fields)
