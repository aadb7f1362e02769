"""The beams of one scan as rviz shows them: a coloured cloud, and markers with a checkbox per case. B beams."""

from __future__ import annotations

from typing import List, Optional

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.localization.beam_classification import beam_cloud as beam_points
from glass_nav.localization.beam_classification.beam_shapes import beam_shapes
from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.localization.place_shapes import place_shapes
from glass_nav.localization.status_text import status_text
from glass_nav.ros import conversions
from glass_nav.ros.packed_markers import PackedMarkerArray, shape_marker, text_marker
from glass_nav.sensing.scan import Scan
from glass_nav.shapes import Text


def beam_cloud(scan: Scan, cases: BeamCases, height_m: float, base_frame: str) -> PointCloud2:
    """End points of the beams that answered, in the robot's frame, coloured by case.

    All fields are float32, so that rviz' Select tool shows each of them for a picked beam.
    """
    points = beam_points.points(scan, cases, height_m)
    msg = PointCloud2(header=conversions.header(scan.stamp_ns, base_frame), height=1, width=len(points), is_dense=True)
    msg.fields = [PointField(name, 4 * index, PointField.FLOAT32, 1) for index, name in enumerate(beam_points.FIELDS)]
    msg.point_step = 4 * len(beam_points.FIELDS)
    msg.row_step = msg.point_step * len(points)
    msg.data = points.tobytes()
    return msg


def beam_markers(scan: Scan, cases: BeamCases, surface: SurfaceScan, height_m: float, base_frame: str) -> MarkerArray:
    """beam_shapes() in the robot's frame; for publishing only: `points` stay empty."""
    head = conversions.header(scan.stamp_ns, base_frame)
    return PackedMarkerArray([shape_marker(head, shape) for shape in beam_shapes(scan, cases, surface, height_m)])


def place_markers(state: str, particles: np.ndarray, map_frame: str) -> List[Marker]:
    """place_shapes() in the map's frame."""
    header = conversions.header(0, map_frame)
    return [
        text_marker(header, each) if isinstance(each, Text) else shape_marker(header, each)
        for each in place_shapes(state, particles)
    ]


def status_marker(
    map_from_base: Optional[np.ndarray], map_frame: str, state: str, reason: str, used_share: float
) -> Marker:
    """status_text() in the map's frame."""
    return text_marker(conversions.header(0, map_frame), status_text(map_from_base, state, reason, used_share))
