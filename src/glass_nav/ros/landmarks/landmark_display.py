"""Landmarks and the bearings of a fix, for rviz."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Point
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.geometry import se2
from glass_nav.localization.bearings.triangulation import Fix
from glass_nav.ros import conversions
from glass_nav.ros.packed_markers import colour
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.vocabulary import LEFT_OUT_RGB, TAG_RGB, USED_RGB, Rgb
from glass_nav.world.landmark_map import LandmarkMap

HEIGHT_M = 0.9  # of the emitter in the seed document
ARROW_M, LINE_M, LETTER_M = 0.6, 0.03, 0.35


def landmark_markers(landmarks: LandmarkMap, frame: str) -> MarkerArray:
    """Positions, directions and ids of landmarks; namespaces landmarks and landmark_ids."""
    markers = []
    for number, name in enumerate(landmarks.ids):
        x, y = landmarks.positions_m[number]
        facing = landmarks.facing_rad[number]
        arrow = np.isfinite(facing)
        marker = _marker(frame, "landmarks", number, Marker.ARROW if arrow else Marker.SPHERE, TAG_RGB)
        marker.pose = conversions.pose_from_planar(np.array([x, y, facing if arrow else 0.0]))
        marker.pose.position.z = HEIGHT_M
        marker.scale.x, marker.scale.y, marker.scale.z = (ARROW_M, 0.1, 0.1) if arrow else (0.2, 0.2, 0.2)
        text = _marker(frame, "landmark_ids", number, Marker.TEXT_VIEW_FACING, TAG_RGB)
        text.pose = conversions.pose_from_planar(np.array([x, y, 0.0]))
        text.pose.position.z, text.scale.z, text.text = HEIGHT_M + LETTER_M, LETTER_M, name
        markers += [marker, text]
    return MarkerArray(markers)


def fix_markers(fix: Fix, taken: LandmarkBearings, landmarks: LandmarkMap, frame: str) -> MarkerArray:
    """The landmarks, and a line from the sensor to each that was seen; namespace landmark_bearings."""
    lines = _marker(frame, "landmark_bearings", 0, Marker.LINE_LIST, USED_RGB)
    lines.header.stamp, lines.scale.x = conversions.stamp_from_ns(fix.stamp_ns), LINE_M
    sensors = se2.compose(fix.map_from_base, taken.base_from_sensor)
    for name, sensor in zip(taken.ids, sensors):
        end = landmarks.positions_m[landmarks.numbers([name])[0]]
        lines.points += [Point(float(x), float(y), HEIGHT_M) for x, y in (sensor[:2], end)]
        lines.colors += [colour(np.array(USED_RGB if name in fix.used_ids else LEFT_OUT_RGB))] * 2
    return MarkerArray([*landmark_markers(landmarks, frame).markers, lines])


def _marker(frame: str, namespace: str, number: int, kind: int, rgb: Rgb) -> Marker:
    marker = Marker(ns=namespace, id=number, type=kind, action=Marker.ADD, color=colour(np.array(rgb)))
    marker.header.frame_id = frame
    marker.pose.orientation.w = 1.0
    return marker
