"""The background of a picture of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.world.grid_map import GridMap


@dataclass(frozen=True)
class Ground:
    """The map, and what the run learnt of its walls."""

    grid: GridMap
    glass: Optional[
        np.ndarray
    ]  # (H, W) int8 [percent] probability of glass of each wall cell, -1 unknown; None: not learnt
