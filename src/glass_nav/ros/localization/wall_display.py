"""The glass map for rviz."""

from __future__ import annotations

from typing import Sequence

import numpy as np
from visualization_msgs.msg import MarkerArray

from glass_nav.localization.beam_classification.wall_shapes import wall_shapes
from glass_nav.ros import conversions
from glass_nav.ros.packed_markers import PackedMarkerArray, shape_marker
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane


def wall_markers(map_frame: str, grid_map: GridMap, glass: np.ndarray, panes: Sequence[Pane]) -> MarkerArray:
    """wall_shapes() in the map's frame, for every time; for publishing only."""
    header = conversions.header(0, map_frame)
    return PackedMarkerArray([shape_marker(header, shape) for shape in wall_shapes(grid_map, glass, panes)])
