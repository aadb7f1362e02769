"""Conversions between ROS messages and the types of the core, with checks of the input.

Stamps are integer nanoseconds on the core's side. Invalid messages raise ValueError (ScanError
for scans) with one line for the log. B beams, P particles.
"""

from __future__ import annotations

import math
import struct
from io import BytesIO
from typing import Tuple

import numpy as np
import rospy
from geometry_msgs.msg import (
    PolygonStamped,
    Pose,
    PoseArray,
    PoseWithCovarianceStamped,
    Quaternion,
    Transform,
    TransformStamped,
)
from nav_msgs.msg import MapMetaData, OccupancyGrid
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.localization.initial_pose import PoseGuess
from glass_nav.localization.integrity import protection_level
from glass_nav.localization.integrity.protection_level import ProtectionLevels
from glass_nav.localization.localizer import BeamCases, Estimate
from glass_nav.msg import BeamCases as BeamCasesMsg
from glass_nav.msg import LocalizationStatus
from glass_nav.sensing.mounting import Mounting, level_mounting
from glass_nav.sensing.scan import Scan, ScanError
from glass_nav.sensing.scan_placement import PlacedScan, RawScan
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import GridMap

_X_Y_YAW = np.ix_([0, 1, 5], [0, 1, 5])  # of the 6x6 covariances of ROS: x y z roll pitch yaw


# -- time and frames


def ns_from_stamp(stamp: rospy.Time) -> int:
    return int(stamp.secs) * 1_000_000_000 + int(stamp.nsecs)


def stamp_from_ns(stamp_ns: int) -> rospy.Time:
    return rospy.Time(*divmod(int(stamp_ns), 1_000_000_000))


def frame_id(name: str) -> str:
    """The frame name for tf2: tf1 wrote a "/" in front."""
    return name.lstrip("/")


def header(stamp_ns: int, frame: str) -> Header:
    return Header(stamp=stamp_from_ns(stamp_ns), frame_id=frame)


# -- poses


def rotation_from_quaternion(quaternion: Quaternion) -> np.ndarray:
    """(3, 3) rotation matrix; the quaternion need not be of length 1, but must have one."""
    x, y, z, w = _unit(quaternion)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def _unit(quaternion: Quaternion) -> Tuple[float, float, float, float]:
    """x, y, z, w of the same rotation, of length 1. Arrays would take ten times as long, several times a scan."""
    x, y, z, w = quaternion.x, quaternion.y, quaternion.z, quaternion.w
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not 1e-6 <= length < math.inf:
        raise ValueError(f"a quaternion x y z w must be finite and not zero, got {[x, y, z, w]}")
    return x / length, y / length, z / length, w / length


def quaternion_from_yaw(yaw_rad: float) -> Quaternion:
    return Quaternion(0.0, 0.0, float(np.sin(0.5 * yaw_rad)), float(np.cos(0.5 * yaw_rad)))


def planar_from_pose(pose: Pose) -> np.ndarray:
    """x, y, yaw (3,) of a pose in space, seen from above."""
    x, y, z, w = _unit(pose.orientation)
    position = pose.position
    if not (math.isfinite(position.x) and math.isfinite(position.y)):
        raise ValueError(f"a position must be finite, got x {position.x}, y {position.y}")
    yaw_rad = math.atan2(2.0 * (x * y + z * w), 1.0 - 2.0 * (y * y + z * z))
    return np.array([position.x, position.y, yaw_rad], float)


def pose_from_planar(planar: np.ndarray) -> Pose:
    pose = Pose(orientation=quaternion_from_yaw(planar[2]))
    pose.position.x, pose.position.y = float(planar[0]), float(planar[1])
    return pose


def planar_from_transform(transform: Transform) -> np.ndarray:
    """x, y, yaw (3,) of a transform in space, seen from above."""
    return planar_from_pose(Pose(transform.translation, transform.rotation))


def transform_stamped(stamp_ns: int, parent: str, child: str, parent_from_child: np.ndarray) -> TransformStamped:
    pose = pose_from_planar(parent_from_child)
    return TransformStamped(header(stamp_ns, parent), child, Transform(pose.position, pose.orientation))


def guess_from_msg(msg: PoseWithCovarianceStamped, map_frame: str) -> PoseGuess:
    """The message that rviz sends on `initialpose`, checked. ValueError if it cannot be an initial pose."""
    frame = frame_id(msg.header.frame_id)
    if frame != map_frame:
        raise ValueError(f"the pose must be given in frame {map_frame!r}, got {msg.header.frame_id!r}")
    spatial = np.array(msg.pose.covariance, float).reshape(6, 6)
    if not np.all(np.isfinite(spatial)):
        raise ValueError("the covariance must be finite, got NaN or inf")
    planar = spatial[_X_Y_YAW]
    scale = max(float(np.abs(planar).max()), 1e-12)
    if np.abs(planar - planar.T).max() > 1e-6 * scale:
        raise ValueError(f"the covariance must be symmetric, got {planar.tolist()} for x, y, yaw")
    if np.linalg.eigvalsh(planar).min() < -1e-9 * scale:
        raise ValueError(f"the covariance must not be negative, got {planar.tolist()} for x, y, yaw")
    return PoseGuess(ns_from_stamp(msg.header.stamp), planar_from_pose(msg.pose.pose), 0.5 * (planar + planar.T))


def pose_msg(estimate: Estimate, map_frame: str) -> PoseWithCovarianceStamped:
    """The message of `amcl_pose`: the covariance is filled at x, y and yaw and 0 elsewhere, as AMCL's."""
    return pose_with_covariance(estimate.stamp_ns, estimate.map_from_base, estimate.covariance, map_frame)


def pose_with_covariance(
    stamp_ns: int, map_from_base: np.ndarray, covariance: np.ndarray, map_frame: str
) -> PoseWithCovarianceStamped:
    """A pose (3,) with its covariance (3, 3) of x, y, yaw; 0 elsewhere."""
    msg = PoseWithCovarianceStamped(header=header(stamp_ns, map_frame))
    msg.pose.pose = pose_from_planar(map_from_base)
    spatial = np.zeros((6, 6))
    spatial[_X_Y_YAW] = covariance
    msg.pose.covariance = spatial.ravel().tolist()
    return msg


class _PackedPoseArray(PoseArray):
    """A PoseArray that holds its poses as an array: 5000 are sent in under 1 ms instead of 30."""

    def __init__(self, head: Header, packed: np.ndarray) -> None:
        super().__init__(header=head)
        self._packed = packed  # (P, 7) x y z, quaternion x y z w

    def serialize(self, buff: BytesIO) -> None:
        self.header.serialize(buff)
        buff.write(struct.pack("<I", len(self._packed)))
        buff.write(self._packed.astype("<f8").tobytes())


def pose_array(stamp_ns: int, map_frame: str, poses: np.ndarray) -> PoseArray:
    """Poses (P, 3) as the message of `particlecloud`; for publishing only: its `poses` stay empty."""
    packed = np.zeros((len(poses), 7))
    packed[:, :2] = poses[:, :2]
    packed[:, 5], packed[:, 6] = np.sin(0.5 * poses[:, 2]), np.cos(0.5 * poses[:, 2])
    return _PackedPoseArray(header(stamp_ns, map_frame), packed)


# -- scans


def mounting_from_transform(base_from_laser: Transform) -> Mounting:
    """Mounting of a level lidar, upright or upside down. ScanError if it is neither."""
    try:
        planar = planar_from_transform(base_from_laser)
        upwardness = rotation_from_quaternion(base_from_laser.rotation)[2, 2]
    except ValueError as err:
        raise ScanError(f"the laser's place on the robot: {err}") from err
    return level_mounting(planar, float(base_from_laser.translation.z), float(upwardness))


def raw_scan_from_msg(msg: LaserScan) -> RawScan:
    """The fields of a LaserScan, unchecked."""
    return RawScan(
        ns_from_stamp(msg.header.stamp),
        frame_id(msg.header.frame_id),
        np.array(msg.ranges, float),
        msg.angle_min,
        msg.angle_max,
        msg.angle_increment,
        msg.range_min,
        msg.range_max,
        msg.time_increment,
        msg.scan_time,
        np.array(msg.intensities, float),
    )


# Meaning of the `intensities` of scan_surfaces.
AS_MEASURED, CUT, NOT_JUDGED = 0.0, 1.0, -1.0


def surface_scan_msg(placed: PlacedScan, surface: SurfaceScan) -> LaserScan:
    """The message of `scan_surfaces`: the scan with its beams cut at the first surface of the map.

    Fields, order and ranges are the driver's own, except the ranges of cut beams and the intensities: 0 as
    measured, 1 cut; -1 for all beams while the pose is not trusted and nothing is cut.

    Args:
        placed: the scan; its beams keep the driver's order, upside down or not.
        surface: per beam, in that order.
    """
    raw = placed.raw
    ranges = np.array(raw.ranges_m, float)
    ranges[surface.cut] = placed.scan.as_measured(surface.ranges_m)[surface.cut]
    flags = np.where(surface.cut, CUT, AS_MEASURED) if surface.trusted else np.full(len(ranges), NOT_JUDGED)
    return LaserScan(
        header=header(raw.stamp_ns, raw.lidar),
        angle_min=raw.angle_min_rad,
        angle_max=raw.angle_max_rad,
        angle_increment=raw.angle_increment_rad,
        time_increment=raw.time_increment_s,
        scan_time=raw.scan_time_s,
        range_min=raw.range_min_m,
        range_max=raw.range_max_m,
        ranges=ranges.tolist(),
        intensities=flags.tolist(),
    )


# -- maps


def map_from_msg(msg: OccupancyGrid) -> GridMap:
    """OccupancyGrid -> GridMap, with the yaw of its origin; a quaternion 0 0 0 0 is no rotation.

    ValueError if it is no valid map.
    """
    info = msg.info
    if info.width == 0 or info.height == 0:
        raise ValueError(f"a map needs at least one cell, got {info.width} x {info.height}")
    if len(msg.data) != info.width * info.height:
        raise ValueError(
            f"a map of {info.width} x {info.height} cells needs {info.width * info.height} values, got {len(msg.data)}"
        )
    occupancy = np.array(msg.data, dtype=np.int8).reshape(info.height, info.width)
    if occupancy.min() < -1 or occupancy.max() > 100:
        wrong = occupancy[(occupancy < -1) | (occupancy > 100)]
        raise ValueError(f"cells of a map must be 0 to 100 or -1 for unknown, got {wrong[0]} in {len(wrong)} cell(s)")
    origin, turn = info.origin, info.origin.orientation
    if (turn.x, turn.y, turn.z, turn.w) == (0.0, 0.0, 0.0, 0.0):  # of a node that does not set it
        rospy.logwarn("the quaternion of the map's origin is 0 0 0 0: taken as no rotation")
        origin = Pose(origin.position, Quaternion(w=1.0))
    try:
        map_from_grid = planar_from_pose(origin)
    except ValueError as err:
        raise ValueError(f"the origin of the map: {err}") from err
    return GridMap(occupancy, float(np.round(info.resolution, 7)), map_from_grid)  # float32 in the message


def msg_from_map(grid_map: GridMap, stamp: rospy.Time, map_frame: str) -> OccupancyGrid:
    msg = OccupancyGrid(header=Header(stamp=stamp, frame_id=map_frame))
    msg.info = grid_info(grid_map)
    msg.info.map_load_time = stamp
    msg.data = grid_map.occupancy.ravel().tolist()
    return msg


class _PackedGrid(OccupancyGrid):
    """An OccupancyGrid that holds its cells as an array: a million are sent in 1 ms instead of 50."""

    def __init__(self, head: Header, packed: np.ndarray) -> None:
        super().__init__(header=head)
        self._packed = packed  # (H, W) int8

    def serialize(self, buff: BytesIO) -> None:
        raw = BytesIO()
        super().serialize(raw)
        buff.write(raw.getvalue()[:-4])  # 4: the count of cells, none so far
        buff.write(struct.pack("<I", self._packed.size))
        buff.write(self._packed.tobytes())


def glass_map_msg(stamp_ns: int, map_frame: str, grid_map: GridMap, glass: np.ndarray) -> OccupancyGrid:
    """The message of `~glass_map`; for publishing only: its `data` stays empty.

    Args:
        stamp_ns: of the last scan used, 0 before the first.
        map_frame: frame of the map.
        grid_map: the map that gives its geometry.
        glass: (H, W) int8, probability of glass by wall cell [percent], -1 where unknown.
    """
    msg = _PackedGrid(header(stamp_ns, map_frame), np.asarray(glass, np.int8))
    msg.info = grid_info(grid_map)
    msg.info.map_load_time = msg.header.stamp
    return msg


def grid_info(grid_map: GridMap) -> MapMetaData:
    info = MapMetaData(resolution=grid_map.resolution_m, origin=pose_from_planar(grid_map.map_from_grid))
    info.height, info.width = grid_map.occupancy.shape
    return info


# -- what the filter reports


def status_msg(
    stamp_ns: int,
    map_frame: str,
    state: str,
    reason: str,
    used_share: float,
    reliability: float,
    levels: ProtectionLevels = protection_level.UNKNOWN,
) -> LocalizationStatus:
    msg = LocalizationStatus(header=header(stamp_ns, map_frame), state=LocalizationState(state).code, state_name=state)
    msg.reason, msg.used_share, msg.reliability = reason, used_share, reliability
    msg.level_95_along_m, msg.level_95_across_m = levels.p95[:2].tolist()
    msg.level_999_along_m, msg.level_999_across_m = levels.p999[:2].tolist()
    msg.level_95_heading_deg, msg.level_999_heading_deg = np.degrees([levels.p95[2], levels.p999[2]]).tolist()
    return msg


def area_from_msg(msg: PolygonStamped, map_frame: str) -> np.ndarray:
    """(N, 2) corners [m, in map] of an area to search; ValueError if it is invalid."""
    if frame_id(msg.header.frame_id) != map_frame:
        raise ValueError(f"the area must be given in frame {map_frame!r}, got {msg.header.frame_id!r}")
    corners = np.array([(point.x, point.y) for point in msg.polygon.points], float).reshape(-1, 2)
    if len(corners) < 3:
        raise ValueError(f"an area needs at least 3 corners, got {len(corners)}")
    if not np.all(np.isfinite(corners)):
        raise ValueError(f"the corners of an area must be finite, got {corners.tolist()}")
    return corners


def beam_cases_msg(scan: Scan, cases: BeamCases) -> BeamCasesMsg:
    msg = BeamCasesMsg(header=header(scan.stamp_ns, scan.lidar))
    msg.cases = cases.case.astype(np.uint8).tobytes()
    msg.expected, msg.residual = scan.as_measured(cases.expected_m).tolist(), cases.residual_m.tolist()
    msg.weight = cases.weight.tolist()
    return msg
