"""The glass map for displays: squares on walls (solid, undecided, glass), lines where the map lacks a pane.

The Map display of rviz can show `~glass_map` too, but its unknown cells cover the map below.
"""

from __future__ import annotations

from typing import List, Sequence

import numpy as np

from glass_nav.shapes import Shape, ShapeKind
from glass_nav.vocabulary import GLASS_FROM, SOLID_BELOW, UNMAPPED_GLASS, UNMAPPED_GLASS_RGB, WallKind
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

_PANE_M, _PANE_HEIGHT_M = 0.08, -0.01  # width of the line, above the squares
_HEIGHT_M = -0.02  # below beams of a lidar at height 0; the map itself is drawn behind everything


def wall_shapes(grid_map: GridMap, glass: np.ndarray, panes: Sequence[Pane]) -> List[Shape]:
    """A square of one cell's size on each wall cell with a known probability, a line on each pane, in the map's frame.

    Args:
        grid_map: the map.
        glass: (H, W) probability of glass by wall cell [percent], -1 where unknown.
        panes: that the map lacks.
    """
    kinds = {
        WallKind.SOLID: glass < SOLID_BELOW,
        WallKind.UNDECIDED: (glass >= SOLID_BELOW) & (glass < GLASS_FROM),
        WallKind.GLASS: glass >= GLASS_FROM,
    }
    lines = np.array([end for pane in panes for end in (pane.start_m, pane.end_m)], float).reshape(-1, 2)
    squares = [
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
    unmapped = Shape(UNMAPPED_GLASS, 0, ShapeKind.LINES, lines, _PANE_HEIGHT_M, _PANE_M, UNMAPPED_GLASS_RGB)
    return [*squares, unmapped]
