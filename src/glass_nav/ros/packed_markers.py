"""Markers whose points are numpy arrays: 541 points are sent in under 1 ms, a list of Point takes 5.

For publishing only: `points` stay empty. K points.
"""

from __future__ import annotations

import struct
from io import BytesIO
from typing import Any

import numpy as np
from geometry_msgs.msg import Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.shapes import Shape, ShapeKind, Text


class PackedMarker(Marker):
    """A marker that holds its points as an array, of one colour and without text."""

    _AFTER_POINTS = 4 + 4 + 4 + 1  # bytes of no colors, no text, no mesh_resource, mesh_use_embedded_materials

    def __init__(self, packed: np.ndarray, **fields: Any) -> None:
        super().__init__(**fields)
        self.packed = packed  # (K, 3) x y z

    def serialize(self, buff: BytesIO) -> None:
        raw = BytesIO()
        super().serialize(raw)
        bare = raw.getvalue()
        buff.write(bare[: -self._AFTER_POINTS - 4])  # 4: the count of points, none so far
        buff.write(struct.pack("<I", len(self.packed)))
        buff.write(self.packed.astype("<f8").tobytes())
        buff.write(bare[-self._AFTER_POINTS :])


class PackedMarkerArray(MarkerArray):
    """Markers that serialize themselves; the generated code would read x, y and z of each point."""

    def serialize(self, buff: BytesIO) -> None:
        buff.write(struct.pack("<I", len(self.markers)))
        for marker in self.markers:
            marker.serialize(buff)


def points_marker(
    header: Header,
    namespace: str,
    number: int,
    kind: int,
    points: np.ndarray,
    height_m: float,
    width_m: float,
    marker_colour: ColorRGBA,
) -> PackedMarker:
    """Squares (Marker.POINTS) at points (K, 2), or lines (LINE_LIST) between pairs; a deletion if there are none.

    rviz complains about a marker without points, so the previous one is deleted instead.
    """
    packed = np.column_stack([points, np.full(len(points), height_m)])
    return PackedMarker(
        packed,
        header=header,
        ns=namespace,
        id=number,
        type=kind,
        action=Marker.ADD if len(points) else Marker.DELETE,
        pose=Pose(orientation=Quaternion(w=1.0)),
        scale=Vector3(width_m, width_m, 0.0),
        color=marker_colour,
    )


def shape_marker(header: Header, shape: Shape) -> PackedMarker:
    """A shape of glass_nav.shapes as a marker."""
    kind = Marker.POINTS if shape.kind is ShapeKind.SQUARES else Marker.LINE_LIST
    rgba = colour(np.array(shape.rgb), shape.alpha)
    return points_marker(
        header, shape.namespace, shape.number, kind, shape.points_m, shape.height_m, shape.width_m, rgba
    )


def text_marker(header: Header, text: Text) -> Marker:
    """A text of glass_nav.shapes as a marker; an empty one deletes what was there."""
    pose = Pose(orientation=Quaternion(w=1.0))
    pose.position.x, pose.position.y, pose.position.z = map(float, text.at_m)
    return Marker(
        header=header,
        ns=text.namespace,
        id=text.number,
        type=Marker.TEXT_VIEW_FACING,
        action=Marker.ADD if text.text else Marker.DELETE,
        pose=pose,
        scale=Vector3(0.0, 0.0, text.letter_m),
        text=text.text,
        color=colour(np.array(text.rgb)),
    )


def colour(rgb: np.ndarray, alpha: float = 1.0) -> ColorRGBA:
    """The colour of red, green, blue (3,) 0..255."""
    red, green, blue = (float(value) / 255.0 for value in rgb)
    return ColorRGBA(red, green, blue, alpha)
