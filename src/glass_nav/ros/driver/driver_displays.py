"""The markers of the driver for rviz, with a namespace for each kind.

Namespaces: `local_edges` and `local_nodes`, the Voronoi graph around the robot; `meetpoint`, where the robot stands or
which it left, with its edges; `way`, along which it drives; `route`, to a goal in the map; `state`, in words. Colours
are of the Okabe-Ito set.
"""

from __future__ import annotations

from typing import List, Optional

import numpy as np
from geometry_msgs.msg import Pose, Quaternion, Vector3
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.driving.edge_tracking.edge_driver import EdgeDriver
from glass_nav.geometry import se2
from glass_nav.ros import conversions
from glass_nav.ros.packed_markers import PackedMarkerArray, colour, points_marker

NAMESPACES = ("local_edges", "local_nodes", "meetpoint", "way", "route", "state")
EDGE_RGB, NODE_RGB, MEETPOINT_RGB, WAY_RGB, ROUTE_RGB = (
    (86, 180, 233),
    (0, 114, 178),
    (0, 158, 115),
    (230, 159, 0),
    (204, 121, 167),
)
_HEIGHT_M = 0.04
_ARM_M = 0.8  # of an edge at the meetpoint


def driver_markers(
    driver: EdgeDriver,
    route_m: Optional[np.ndarray],
    odom_from_base: np.ndarray,
    text: str,
    odom_frame: str,
    map_frame: str,
) -> MarkerArray:
    """All markers; namespaces without content are cleared.

    Args:
        driver: with its graph, meetpoint and way, in a frame of its own.
        route_m: (M, 2) in the map; None: none.
        odom_from_base: (3,) where the words go.
        text: state and reason.
        odom_frame: frame of the odometry.
        map_frame: frame of the map.
    """
    graph, node = driver.local_graph, driver.node
    lines = [] if graph is None else list(graph.graph.lines_m)
    nodes = np.zeros((0, 2)) if graph is None else graph.graph.position_m
    arms: List[np.ndarray] = []
    if node is not None:
        for branch in node.branches:
            direction = np.array([np.cos(branch.bearing_rad), np.sin(branch.bearing_rad)])
            arms.append(np.stack([node.position_m, node.position_m + _ARM_M * direction]))
    odom_from_local = se2.compose(odom_from_base, se2.inverse(driver.local_from_base(odom_from_base)))
    header, in_map = conversions.header(0, odom_frame), conversions.header(0, map_frame)  # stamp 0: for every time

    def line(namespace: str, points: np.ndarray, width_m: float, rgb: "tuple[int, int, int]") -> Marker:
        of = in_map if namespace == "route" else header
        points = points if namespace == "route" else se2.transform_points(odom_from_local, points)
        return points_marker(of, namespace, 0, Marker.LINE_LIST, points, _HEIGHT_M, width_m, colour(np.array(rgb)))

    route = [] if route_m is None else [route_m]
    return PackedMarkerArray(
        [
            line("local_edges", _pairs(lines), 0.03, EDGE_RGB),
            points_marker(
                header,
                "local_nodes",
                0,
                Marker.POINTS,
                se2.transform_points(odom_from_local, nodes),
                _HEIGHT_M,
                0.12,
                colour(np.array(NODE_RGB)),
            ),
            line("meetpoint", _pairs(arms), 0.08, MEETPOINT_RGB),
            line("way", _pairs([driver.way_m]), 0.06, WAY_RGB),
            line("route", _pairs(route), 0.06, ROUTE_RGB),
            _text(odom_from_base, text, odom_frame),
        ]
    )


def _pairs(lines: List[np.ndarray]) -> np.ndarray:
    """Lines (n, 2) as pairs of ends (K, 2)."""
    return np.concatenate([np.zeros((0, 2)), *(np.repeat(line, 2, axis=0)[1:-1] for line in lines if len(line) > 1)])


def _text(odom_from_base: np.ndarray, text: str, frame: str) -> Marker:
    pose = Pose(orientation=Quaternion(w=1.0))
    pose.position.x, pose.position.y, pose.position.z = float(odom_from_base[0]), float(odom_from_base[1]) + 0.8, 0.5
    return Marker(
        header=conversions.header(0, frame),
        ns="state",
        id=0,
        type=Marker.TEXT_VIEW_FACING,
        action=Marker.ADD,
        pose=pose,
        scale=Vector3(0.0, 0.0, 0.25),
        color=colour(np.zeros(3)),
        text=text,
    )
