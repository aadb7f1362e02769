"""Beams that ended at the back of a wall: the map shows its other side."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.sensing import wall_backs
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import UNKNOWN, GridMap

CELL_M = 0.05
PLACED = np.array([2.0, -1.0, 0.6])  # of the grid in the map


def room_beside_a_bridge() -> GridMap:
    """8 m by 6 m. A room from x = 5 m on, seen from inside: its wall is at x = 5 m; the robot drives left of x = 2 m."""
    occupancy = np.full((120, 160), UNKNOWN, np.int8)
    occupancy[:, :40] = 0
    occupancy[:, 101:] = 0
    occupancy[:, 100] = 100
    return GridMap(occupancy, CELL_M, PLACED)


def kept(grid_map, pose_in_grid, ranges_m, angles_rad=(0.0,)):
    scan = Scan(0, np.array(ranges_m, float), np.array(angles_rad, float), 0.0, 30.0, np.zeros(3))
    beams = np.flatnonzero(scan.answered)
    pose = se2.compose(PLACED, np.array(pose_in_grid, float))
    return wall_backs.without(scan, beams, pose, DistanceField(grid_map), KnownArea(grid_map)).tolist()


@pytest.mark.parametrize("thickness_m", [0.0, 0.1, 0.25, 0.4])
def test_a_wall_seen_from_where_the_mapper_was_not_is_left_out(thickness_m):
    """Wherever its back is: at the face that is drawn, too, which would attract the scan."""
    assert kept(room_beside_a_bridge(), [1.0, 3.0, 0.0], [4.02 - thickness_m]) == []


@pytest.mark.parametrize("error_m", [-0.3, 0.0, 0.2])
def test_a_wall_seen_from_where_the_mapper_was_stays(error_m):
    """Also where the pose is somewhat wrong."""
    assert kept(room_beside_a_bridge(), [7.0 + error_m, 3.0, np.pi], [1.98]) == [0]


def test_a_wall_that_the_mapper_saw_from_both_sides_stays():
    occupancy = np.zeros((120, 160), np.int8)
    occupancy[:, 100] = 100
    grid_map = GridMap(occupancy, CELL_M, PLACED)
    assert kept(grid_map, [1.0, 3.0, 0.0], [4.02]) == kept(grid_map, [7.0, 3.0, np.pi], [1.98]) == [0]


def test_what_ends_at_no_wall_stays():
    assert kept(room_beside_a_bridge(), [1.0, 3.0, 0.0], [0.5, 2.0, np.nan], [0.0, 0.1, 0.2]) == [0, 1]


def test_no_beams_are_no_beams():
    assert kept(room_beside_a_bridge(), [1.0, 3.0, 0.0], [np.nan]) == []
