"""Writes the results of a replay as a ROS 1 bag for rviz and PlotJuggler, as the running node would publish them.

The bag is complete: it has the map, tf from map to laser, and the scans. Stamps are those of the scans, map -> odom included, so
that nothing lies ahead of its data. Not compressed: the player of ROS cannot read what rosbags compresses by lz4.
B beams, P particles, H rows and W columns of the map.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Sequence, Set, Tuple, Union

import numpy as np

from glass_nav.recording.message_writer import TF_TYPE, MessageWriter
from glass_nav.recording.messages import BEAM_CASES, STATUS
from glass_nav.sensing.scan import Scan
from glass_nav.shapes import Shape, ShapeKind, Text
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import GridMap

NODE = "/glass_localization"
MAX_SHOWN = 500  # particles: the cloud is only for display
_FLOAT32 = 7  # of sensor_msgs/PointField
_LINES, _SQUARES, _TEXT = 5, 8, 9  # of visualization_msgs/Marker: LINE_LIST, POINTS, TEXT_VIEW_FACING
_ADD, _DELETE = 0, 2


class ResultBag(MessageWriter):
    """Write in the order of time; `begin` once, first."""

    KINDS = {
        "/tf": TF_TYPE,
        "/tf_static": TF_TYPE,
        "/map": "nav_msgs/msg/OccupancyGrid",
        "/scan": "sensor_msgs/msg/LaserScan",
        "/scan_surfaces": "sensor_msgs/msg/LaserScan",
        "/amcl_pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
        "/particlecloud": "geometry_msgs/msg/PoseArray",
        "/ground_truth": "geometry_msgs/msg/PoseStamped",
        NODE + "/status": "glass_nav/msg/LocalizationStatus",
        NODE + "/beam_cases": "glass_nav/msg/BeamCases",
        NODE + "/beam_cloud": "sensor_msgs/msg/PointCloud2",
        NODE + "/glass_map": "nav_msgs/msg/OccupancyGrid",
        NODE + "/beam_markers": "visualization_msgs/msg/MarkerArray",
        NODE + "/wall_markers": "visualization_msgs/msg/MarkerArray",
        "/legend": "sensor_msgs/msg/Image",
    }
    LATCHED = ("/tf_static", "/map", NODE + "/glass_map", NODE + "/wall_markers", "/legend")
    OWN_TYPES = {"glass_nav/msg/LocalizationStatus": STATUS, "glass_nav/msg/BeamCases": BEAM_CASES}

    def __init__(self, path: Path, frames: "Tuple[str, str, str]") -> None:
        """
        Args:
            path: of the bag.
            frames: names of map, odom and base.
        """
        super().__init__(path)
        self._map, self._odom, self._base = frames
        self._mounted: Set[str] = set()

    def begin(self, stamp_ns: int, grid_map: GridMap) -> None:
        """The map."""
        self._grid("/map", stamp_ns, grid_map, grid_map.occupancy)

    def scan(
        self,
        scan: Scan,
        surfaces_m: np.ndarray,
        cases: np.ndarray,
        expected_m: np.ndarray,
        residual_m: np.ndarray,
        weight: np.ndarray,
    ) -> None:
        """Writes a scan, the cases of its beams (B,), and where each is cut (B,), as measured by the lidar."""
        frame = scan.lidar or "laser"
        if frame not in self._mounted:
            self._mounted.add(frame)
            self._send(
                "/tf_static",
                scan.stamp_ns,
                transforms=[self._transform(scan.stamp_ns, self._base, frame, scan.base_from_laser)],
            )
        for topic, ranges_m in (("/scan", scan.ranges_m), ("/scan_surfaces", surfaces_m)):
            angles_rad = scan.angles_rad
            self._send(
                topic,
                scan.stamp_ns,
                header=self._header(scan.stamp_ns, frame),
                angle_min=float(angles_rad[0]),
                angle_max=float(angles_rad[-1]),
                angle_increment=float(angles_rad[-1] - angles_rad[0]) / max(len(scan) - 1, 1),
                time_increment=0.0,
                scan_time=0.0,
                range_min=scan.range_min_m,
                range_max=scan.range_max_m,
                ranges=ranges_m.astype(np.float32),
                intensities=np.zeros(0, np.float32),
            )
        self._send(
            NODE + "/beam_cases",
            scan.stamp_ns,
            header=self._header(scan.stamp_ns, frame),
            cases=cases.astype(np.uint8),
            expected=expected_m.astype(np.float32),
            residual=residual_m.astype(np.float32),
            weight=weight.astype(np.float32),
        )

    def cloud(self, stamp_ns: int, fields: "Tuple[str, ...]", points: np.ndarray) -> None:
        """Points (N, F) of the robot's frame, float32, with a name for each column."""
        step = 4 * len(fields)
        layout = [
            self._new("sensor_msgs/PointField", name=name, offset=4 * column, datatype=_FLOAT32, count=1)
            for column, name in enumerate(fields)
        ]
        self._send(
            NODE + "/beam_cloud",
            stamp_ns,
            header=self._header(stamp_ns, self._base),
            height=1,
            width=len(points),
            fields=layout,
            is_bigendian=False,
            point_step=step,
            row_step=step * len(points),
            data=np.frombuffer(points.astype("<f4").tobytes(), np.uint8),
            is_dense=True,
        )

    def transforms(self, stamp_ns: int, map_from_odom: np.ndarray, odom_from_base: np.ndarray) -> None:
        """tf of the robot: both (3,)."""
        self._send(
            "/tf",
            stamp_ns,
            transforms=[
                self._transform(stamp_ns, self._map, self._odom, map_from_odom),
                self._transform(stamp_ns, self._odom, self._base, odom_from_base),
            ],
        )

    def pose(self, stamp_ns: int, map_from_base: np.ndarray, covariance: np.ndarray, particles: np.ndarray) -> None:
        """The pose (3,), its covariance (3, 3) of x, y, yaw, and some of the particles (P, 3)."""
        spatial = np.zeros((6, 6))
        spatial[np.ix_([0, 1, 5], [0, 1, 5])] = covariance
        pose = self._new("geometry_msgs/PoseWithCovariance", pose=self._pose(map_from_base), covariance=spatial.ravel())
        self._send("/amcl_pose", stamp_ns, header=self._header(stamp_ns, self._map), pose=pose)
        shown = particles[:: max(1, -(-len(particles) // MAX_SHOWN))]
        self._send(
            "/particlecloud",
            stamp_ns,
            header=self._header(stamp_ns, self._map),
            poses=[self._pose(each) for each in shown],
        )

    def status(
        self,
        stamp_ns: int,
        state: str,
        reason: str,
        used_share: float,
        reliability: float,
        level_95: np.ndarray,
        level_999: np.ndarray,
    ) -> None:
        """The state in words, its figures, and protection levels (3,) along [m], across [m] and of the heading [rad]."""
        levels = {
            f"level_{name}_{what}": float(value)
            for name, level in (("95", level_95), ("999", level_999))
            for what, value in zip(("along_m", "across_m", "heading_deg"), (*level[:2], np.degrees(level[2])))
        }
        self._send(
            NODE + "/status",
            stamp_ns,
            header=self._header(stamp_ns, self._map),
            state=LocalizationState(state).code,
            state_name=state,
            reason=reason,
            used_share=used_share,
            reliability=reliability,
            **levels,
        )

    def legend(self, stamp_ns: int, pixels: np.ndarray) -> None:
        """Writes the legend of the markers: (H, W, 3) uint8."""
        height, width, _ = pixels.shape
        self._send(
            "/legend",
            stamp_ns,
            header=self._header(stamp_ns, self._map),
            height=height,
            width=width,
            encoding="rgb8",
            is_bigendian=0,
            step=3 * width,
            data=np.ascontiguousarray(pixels, np.uint8).ravel(),
        )

    def beam_markers(self, stamp_ns: int, of_base: Sequence[Shape], of_map: Sequence[Union[Shape, Text]]) -> None:
        """Shapes in the robot's frame and in the map's."""
        markers = [self._marker(stamp_ns, self._base, each) for each in of_base]
        markers += [self._marker(stamp_ns, self._map, each) for each in of_map]
        self._send(NODE + "/beam_markers", stamp_ns, markers=markers)

    def wall_markers(self, stamp_ns: int, shapes: Sequence[Shape]) -> None:
        """Shapes in the map's frame."""
        self._send(
            NODE + "/wall_markers", stamp_ns, markers=[self._marker(stamp_ns, self._map, each) for each in shapes]
        )

    def _marker(self, stamp_ns: int, frame: str, each: Union[Shape, Text]) -> Any:
        if isinstance(each, Text):
            kind, shown, alpha, text = _TEXT, bool(each.text), 1.0, each.text
            points: List[Any] = []
            size, at_m = (0.0, 0.0, each.letter_m), each.at_m
        else:
            kind = _SQUARES if each.kind is ShapeKind.SQUARES else _LINES
            shown, alpha, text = len(each.points_m) > 0, each.alpha, ""
            points = [self._point(x, y, each.height_m) for x, y in each.points_m.tolist()]
            size, at_m = (each.width_m, each.width_m, 0.0), np.zeros(3)
        red, green, blue = (value / 255.0 for value in each.rgb)
        pose = self._new("geometry_msgs/Pose", position=self._point(*map(float, at_m)), orientation=self._rotation(0.0))
        return self._new(
            "visualization_msgs/Marker",
            header=self._header(stamp_ns, frame),
            ns=each.namespace,
            id=each.number,
            type=kind,
            action=_ADD if shown else _DELETE,
            pose=pose,
            scale=self._new("geometry_msgs/Vector3", x=size[0], y=size[1], z=size[2]),
            color=self._new("std_msgs/ColorRGBA", r=red, g=green, b=blue, a=alpha),
            lifetime=self._new("builtin_interfaces/Duration", sec=0, nanosec=0),
            frame_locked=False,
            points=points,
            colors=[],
            text=text,
            mesh_resource="",
            mesh_use_embedded_materials=False,
        )

    def _point(self, x: float, y: float, z: float) -> Any:
        return self._new("geometry_msgs/Point", x=x, y=y, z=z)

    def truth(self, stamp_ns: int, map_from_base: np.ndarray) -> None:
        """Writes the true pose of the robot, (3,)."""
        self._send("/ground_truth", stamp_ns, header=self._header(stamp_ns, self._map), pose=self._pose(map_from_base))

    def glass_map(self, stamp_ns: int, grid_map: GridMap, glass: np.ndarray) -> None:
        """Probability of glass of each wall cell so far: (H, W) int8 [percent], -1 unknown."""
        self._grid(NODE + "/glass_map", stamp_ns, grid_map, glass)

    def _grid(self, topic: str, stamp_ns: int, grid_map: GridMap, cells: np.ndarray) -> None:
        height, width = cells.shape
        info: Any = self._new(
            "nav_msgs/MapMetaData",
            map_load_time=self._time(stamp_ns),
            resolution=grid_map.resolution_m,
            width=width,
            height=height,
            origin=self._pose(grid_map.map_from_grid),
        )
        self._send(
            topic,
            stamp_ns,
            header=self._header(stamp_ns, self._map),
            info=info,
            data=np.ascontiguousarray(cells, np.int8).ravel(),
        )
