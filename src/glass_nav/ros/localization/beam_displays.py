"""The beams of one scan as rviz shows them: a coloured cloud, and markers with a checkbox per case. B beams."""

from __future__ import annotations

from dataclasses import replace
from typing import List, Optional

import numpy as np
from geometry_msgs.msg import Pose, Quaternion, Vector3
from sensor_msgs.msg import PointCloud2, PointField
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.localization.beam_classification import beam_cloud as beam_points
from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.ros import conversions
from glass_nav.ros.packed_markers import PackedMarkerArray, colour, points_marker
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import CASES_IN_ORDER, LocalizationState

STATE_COLOURS = {
    LocalizationState.LOCALIZED: (0, 60, 35),
    LocalizationState.UNCERTAIN: (130, 60, 0),
    LocalizationState.LOST: (150, 0, 0),
    LocalizationState.GLOBAL_SEARCH: (70, 20, 110),
    LocalizationState.UNKNOWN: (40, 40, 40),
}  # dark on free and unknown cells alike
STATUS_NAMESPACE = "status"

_POINT_M = 0.08  # edge of the square at the end of a beam
_LINE_M = 0.018  # width of the line from the surface to that end
_LINE_ALPHA = 0.6
_TEXT_M = 0.4  # height of a capital letter
_TEXT_ABOVE_M = 0.75  # of the robot: up and to the north, which is up on the screen in a top view
_REASON_WIDTH = 48  # characters per line


# -- cloud


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


# -- markers


def beam_markers(scan: Scan, cases: BeamCases, surface: SurfaceScan, height_m: float, base_frame: str) -> MarkerArray:
    """A namespace, and so a checkbox, per case: squares where its beams end, lines there from the first surface.

    For publishing only: `points` stay empty. A case without beams has one line of zero length, so that rviz
    shows the checkbox of its namespace from the first scan on.

    Args:
        scan: of one lidar.
        cases: of its beams.
        surface: where each beam met the first surface of the map; cut beams get a line.
        height_m: of the lidar above the robot's frame.
        base_frame: the robot's frame.
    """
    head = conversions.header(scan.stamp_ns, base_frame)
    ends = scan.points_in_base()
    cut = surface.cut & scan.answered
    starts = replace(scan, ranges_m=np.where(cut, surface.ranges_m, np.nan)).points_in_base()
    markers: List[Marker] = []
    for case in CASES_IN_ORDER:
        name = case.label
        in_case = (cases.case == case) & scan.answered
        lines = in_case & cut
        pairs = np.stack([starts[lines], ends[lines]], axis=1).reshape(-1, 2)
        if not lines.any():
            pairs = np.zeros((2, 2)) + scan.base_from_laser[:2]
        rgb = np.array(case.rgb)
        markers.append(
            points_marker(head, name, 0, Marker.LINE_LIST, pairs, height_m, _LINE_M, colour(rgb, _LINE_ALPHA))
        )
        markers.append(points_marker(head, name, 1, Marker.POINTS, ends[in_case], height_m, _POINT_M, colour(rgb)))
    return PackedMarkerArray(markers)


def status_marker(
    map_from_base: Optional[np.ndarray], map_frame: str, state: str, reason: str, used_share: float
) -> Marker:
    """The state in words above the robot, in the map's frame; at the map's origin before it has a pose.

    Args:
        map_from_base: (3,) where the robot is.
        map_frame: frame of the map.
        state, reason: as in ~status; the reason is shown if it matters.
        used_share: of the beams that the map covers, those that a case explains; NaN without any.
    """
    x, y, _ = np.zeros(3) if map_from_base is None else map_from_base
    text = state if np.isnan(used_share) else f"{state}, {100.0 * used_share:.0f} % of the beams explained"
    if state != LocalizationState.LOCALIZED:
        text += "\n" + _wrapped(reason)
    pose = Pose(orientation=Quaternion(w=1.0))
    pose.position.x, pose.position.y, pose.position.z = float(x), float(y) + _TEXT_ABOVE_M, _TEXT_ABOVE_M
    return Marker(
        header=conversions.header(0, map_frame),
        ns=STATUS_NAMESPACE,
        type=Marker.TEXT_VIEW_FACING,
        action=Marker.ADD,
        pose=pose,
        scale=Vector3(0.0, 0.0, _TEXT_M),
        text=text,
        color=colour(np.array(STATE_COLOURS[state])),
    )


def _wrapped(text: str) -> str:
    """The text broken at spaces: rviz does not break lines itself."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > _REASON_WIDTH:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)
