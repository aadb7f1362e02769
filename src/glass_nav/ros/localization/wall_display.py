"""The glass map for rviz: squares on the walls, in a namespace each for solid, undecided and glass.

rviz' Map display can show `~glass_map` too, but its unknown cells cover the map below.
"""

from __future__ import annotations

import numpy as np
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.ros import conversions
from glass_nav.ros.packed_markers import PackedMarkerArray, colour, points_marker
from glass_nav.world.grid_map import GridMap

SOLID_BELOW, GLASS_FROM = 25, 75  # [percent]
WALL_NAMES = ("solid", "undecided", "glass")
WALL_COLOURS = np.array([[140, 95, 60], [240, 228, 66], [0, 225, 225]])  # (3, 3) brown, yellow, turquoise

_HEIGHT_M = -0.02  # below beams of a lidar at height 0; the map itself is drawn behind everything


def wall_markers(map_frame: str, grid_map: GridMap, glass: np.ndarray) -> MarkerArray:
    """A square of one cell's size on each wall cell with a known probability; for publishing only.

    Args:
        map_frame: frame of the map.
        grid_map: the map.
        glass: (H, W) probability of glass by wall cell [percent], -1 where unknown.
    """
    header = conversions.header(0, map_frame)  # stamp 0: for every time
    kinds = glass < SOLID_BELOW, (glass >= SOLID_BELOW) & (glass < GLASS_FROM), glass >= GLASS_FROM
    return PackedMarkerArray(
        [
            points_marker(
                header,
                name,
                0,
                Marker.POINTS,
                grid_map.centres(*np.nonzero(kind & (glass >= 0))),
                _HEIGHT_M,
                grid_map.resolution_m,
                colour(rgb),
            )
            for name, kind, rgb in zip(WALL_NAMES, kinds, WALL_COLOURS)
        ]
    )
