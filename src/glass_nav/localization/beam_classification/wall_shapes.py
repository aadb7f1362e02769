"""The glass map as a display draws it: squares on the walls, in a namespace each for solid, undecided and glass.

rviz' Map display can show `~glass_map` too, but its unknown cells cover the map below.
"""

from __future__ import annotations

from typing import List

import numpy as np

from glass_nav.shapes import Shape, ShapeKind
from glass_nav.vocabulary import GLASS_FROM, SOLID_BELOW, WallKind
from glass_nav.world.grid_map import GridMap

_HEIGHT_M = -0.02  # below beams of a lidar at height 0; the map itself is drawn behind everything


def wall_shapes(grid_map: GridMap, glass: np.ndarray) -> List[Shape]:
    """A square of one cell's size on each wall cell with a known probability, in the frame of the map.

    Args:
        grid_map: the map.
        glass: (H, W) probability of glass by wall cell [percent], -1 where unknown.
    """
    kinds = {
        WallKind.SOLID: glass < SOLID_BELOW,
        WallKind.UNDECIDED: (glass >= SOLID_BELOW) & (glass < GLASS_FROM),
        WallKind.GLASS: glass >= GLASS_FROM,
    }
    return [
        Shape(
            str(kind),
            0,
            ShapeKind.SQUARES,
            grid_map.centres(*np.nonzero(chosen & (glass >= 0))),
            _HEIGHT_M,
            grid_map.resolution_m,
            kind.rgb,
        )
        for kind, chosen in kinds.items()
    ]
