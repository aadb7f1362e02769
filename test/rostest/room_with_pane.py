"""The room of room_robot.py with a clear pane across it, and a lidar that sees the pane head on only."""

from __future__ import annotations

import numpy as np
from room_robot import room

from glass_nav.geometry import angles
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world.grid_map import GridMap

PANE_COLUMN = 160
HEAD_ON_RAD = 0.15  # up to this angle to its normal the pane answers


def room_with_a_pane() -> GridMap:
    """The room, and a pane that parts its eastern third, 1.3 m and more from the robot."""
    empty = room()
    occupancy = empty.occupancy.copy()
    occupancy[20:170, PANE_COLUMN] = 100
    return GridMap(occupancy, empty.resolution_m, empty.map_from_grid)


class LidarAndPane:
    """Ranges in the room with the pane, as RayCaster gives them of one without panes."""

    def __init__(self) -> None:
        self.room, self.with_pane = RayCaster(room()), RayCaster(room_with_a_pane())
        self._normal_rad = room().map_from_grid[2]

    def cast(self, poses: np.ndarray, bearings: np.ndarray, max_range_m: float) -> np.ndarray:
        """(P, B) ranges [m] along bearings (B,) from poses (P, 3)."""
        head_on = self.incidence(poses, bearings) < HEAD_ON_RAD
        return np.where(
            head_on, self.with_pane.cast(poses, bearings, max_range_m), self.room.cast(poses, bearings, max_range_m)
        )

    def incidence(self, poses: np.ndarray, bearings: np.ndarray) -> np.ndarray:
        """(P, B) angles to the normal of the pane [rad]."""
        return np.abs(angles.wrap(poses[:, 2:] + bearings - self._normal_rad))
