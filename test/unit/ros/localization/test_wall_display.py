"""The glass map in rviz: each known wall cell once, at its place, in the namespace of what it is."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.ros.localization import wall_display
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane


def received(glass, panes=()) -> "dict[str, Marker]":
    grid_map = GridMap(np.zeros(np.shape(glass), np.int8), 0.1, np.array([1.0, 2.0, np.pi / 2]))
    raw = BytesIO()
    wall_display.wall_markers("map", grid_map, np.array(glass, np.int8), panes).serialize(raw)
    return {marker.ns: marker for marker in MarkerArray().deserialize(raw.getvalue()).markers}


def test_cells_are_sorted_by_their_probability_of_glass():
    markers = received([[0, 24, 25, 74, 75, 100, -1]])
    assert {name: len(marker.points) for name, marker in markers.items()} == {
        "solid": 2,
        "undecided": 2,
        "glass": 2,
        "unmapped glass": 0,
    }


def test_a_square_lies_on_its_cell():
    marker = received([[-1, -1], [-1, 90]])["glass"]
    (point,) = marker.points  # cell row 1, column 1 of a grid turned by 90 degrees
    assert (round(point.x, 9), round(point.y, 9)) == (0.85, 2.15)
    assert (marker.scale.x, marker.header.frame_id, marker.header.stamp.to_nsec()) == (0.1, "map", 0)


def test_a_pane_that_the_map_lacks_is_a_line():
    marker = received([[-1]], [Pane(np.array([1.0, 2.0]), np.array([1.5, 2.0]))])["unmapped glass"]
    assert marker.type == Marker.LINE_LIST
    assert [(point.x, point.y) for point in marker.points] == [(1.0, 2.0), (1.5, 2.0)]


def test_what_is_not_there_any_more_is_taken_away():
    markers = received([[-1, -1]])
    assert [marker.action for marker in markers.values()] == [Marker.DELETE] * 4
