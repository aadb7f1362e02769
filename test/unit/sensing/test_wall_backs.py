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


def test_the_compiled_code_agrees_with_numpy():
    grid_map, rng = room_beside_a_bridge(), np.random.default_rng(0)
    field, area = DistanceField(grid_map), KnownArea(grid_map)
    mounting = np.array([0.2, -0.1, 0.4])
    scan = Scan(0, rng.uniform(0.5, 6.0, 400), rng.uniform(-np.pi, np.pi, 400), 0.0, 30.0, mounting)
    pose, beams = se2.compose(PLACED, np.array([1.0, 3.0, 0.3])), np.arange(400)

    bearing = scan.angles_rad + mounting[2] + pose[2]
    ahead = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    before = se2.transform_points(pose, scan.points_in_base()) - 0.25 * ahead
    distance_m, along_x, along_y = field.at(before[:, 0], before[:, 1])
    away = np.stack([along_x, along_y], axis=-1)
    wall = before - distance_m[:, None] * away
    met = (distance_m < 0.75) & (np.sum(away * ahead, axis=1) < 0.0)
    met &= area.is_unmapped(wall + 0.15 * away) & area.is_free(wall - 0.15 * away)
    assert met.any()
    np.testing.assert_array_equal(wall_backs.without(scan, beams, pose, field, area), beams[~met])
