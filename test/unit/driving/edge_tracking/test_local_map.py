"""What a simulated lidar shows of rooms with panes and people, against where these are."""

from __future__ import annotations

import math

import made_buildings
import numpy as np
import pytest
from made_buildings import scan_at, walled

from glass_nav.driving.edge_tracking.local_map import LocalMap, LocalMapParams
from glass_nav.sensing.scan import Scan
from glass_nav.simulation.building import Building, Pane, Person, Wall, box
from glass_nav.simulation.lidar import LidarModel

SMALL = LocalMapParams(window_m=8.0)
ROOM_M = np.array([[0.0, 0.0], [7.0, 0.0], [7.0, 5.0], [0.0, 5.0]])
PANE_Y_M = 2.0
DOOR_M = (3.0, 4.0)  # along the pane's line


def glass_front(door: bool = False) -> Building:
    """A hall behind a pane at y = 2 that runs along x from 0 to 7, or has a doorway in it."""
    ends = [[0.0, DOOR_M[0]], [DOOR_M[1], 7.0]] if door else [[0.0, 7.0]]
    panes = tuple(Pane(np.array([[first, PANE_Y_M], [last, PANE_Y_M]]), dirt=0.0) for first, last in ends)
    return Building(walled(ROOM_M).walls, panes=panes)


CLEAN = LidarModel(beams=361, dirty_share=0.0)


def seen_from(building, poses, p=SMALL, model=CLEAN, seed=0):
    """A map after a scan from each pose (S, 3), ten in a second."""
    rng, local = np.random.default_rng(seed), LocalMap(p)
    for index, pose in enumerate(poses):
        local.add(scan_at(building, pose, rng, 0.1 * index, model), np.array(pose))
    return local


def standing(pose, scans):
    return [pose] * scans


def along_x(first_m, last_m, y_m, step_m=0.05):
    return [(x, y_m, 0.0) for x in np.arange(first_m, last_m, step_m)]


def cells(grid, mask):
    """(K, 2) centres of cells."""
    return grid.centres(*np.nonzero(mask))


def pane_cells(local, mask, y_m=PANE_Y_M, ends_out=True):
    """x (K,) of cells near the line of the pane, not where it meets the walls."""
    found = cells(local.walls(), mask)
    x = np.unique(np.round(found[np.abs(found[:, 1] - y_m) < 0.08, 0], 3))
    return x[(x > 0.1) & (x < 6.9)] if ends_out else x


def covered(x, first_m, last_m, cell_m=0.05):
    """Share of the columns between two x that are there."""
    columns = np.arange(first_m + 0.5 * cell_m, last_m, cell_m)
    return float(np.mean([np.abs(x - column).min(initial=9.0) < 0.6 * cell_m for column in columns]))


def test_walls_stand_where_they_are_and_the_rest_is_free_or_unknown():
    local = seen_from(walled(ROOM_M), standing((3.0, 2.0, 0.3), 5))
    grid = local.grid()
    walls = cells(grid, grid.occupied)
    outside = np.maximum(np.abs(walls - [3.5, 2.5]) - [3.5, 2.5], -np.inf)
    assert np.abs(outside.max(axis=1)).max() < 0.1 and len(walls) > 200
    free = cells(grid, grid.free)
    assert (np.abs(free - [3.5, 2.5]) < [3.5, 2.5]).all()
    assert grid.is_free(np.array([[3.0, 2.0], [5.0, 3.0]])).all()
    assert (grid.occupied == local.walls().occupied).all()  # no glass here, nothing is extended
    assert not local.glass().any()
    assert local.params is SMALL


def test_who_walks_through_leaves_no_wall_two_seconds_later():
    person = Person(np.array([[4.5, 0.6], [4.5, 4.4]]))
    building = Building(walled(ROOM_M).walls, people=(person,))
    rng, local, seen = np.random.default_rng(3), LocalMap(SMALL), 0
    for index in range(38):
        local.add(scan_at(building, (2.0, 2.5, 0.0), rng, 0.1 * index), np.array([2.0, 2.5, 0.0]))
        stands = cells(local.walls(), local.occupied())
        inside = stands[(np.abs(stands - [3.5, 2.5]) < [3.35, 2.35]).all(axis=1)]
        y_m = 0.6 + 0.1 * index
        seen += bool(len(inside))
        assert (inside[:, 1] > y_m - person.radius_m - 2.0).all(), f"{0.1 * index:.1f} s"
    assert seen > 20  # who walks is an obstacle while there


def test_a_pane_that_was_driven_along_stands_though_most_beams_pass_it():
    building, poses = glass_front(), along_x(1.0, 5.0, 1.0)
    local = seen_from(building, poses)
    scan = scan_at(building, poses[40], np.random.default_rng(0), model=CLEAN)
    up = np.abs(scan.angles_rad - math.pi / 4) < math.pi / 12  # 30 to 60 degrees to the left
    assert (scan.ranges_m[up] * np.sin(scan.angles_rad[up]) > 2.0).all()  # these went through
    assert covered(pane_cells(local, local.occupied()), 1.2, 5.0) > 0.95
    assert covered(pane_cells(local, local.glass()), 1.2, 5.0) > 0.95
    behind = cells(local.walls(), local.occupied() & ~local.glass())
    assert (np.abs(behind[:, 1] - 5.0) < 0.1).sum() > 40  # the wall behind the pane, seen through it


def test_a_pane_goes_on_where_nothing_was_seen_of_it_but_not_where_beams_passed():
    """The field of view ends at the normal of the pane: what is to its left was looked at from the side only."""
    building, poses = glass_front(), standing((1.2, 1.2, 0.0), 5) + standing((3.5, 1.0, -math.pi / 4), 10)
    local = seen_from(building, poses)
    seen = pane_cells(local, local.occupied())
    seen = seen[seen > 3.2]  # from the second place
    grid = local.grid()
    extended = pane_cells(local, grid.occupied)
    extended = extended[extended > 2.5]
    assert 0.2 < seen.max() - seen.min() < 0.8  # within some 15 degrees of its normal
    assert extended.min() == pytest.approx(seen.min() - SMALL.extend_glass_m, abs=0.11)
    assert extended.max() < seen.max() + 0.1
    more = cells(grid, grid.occupied & ~local.occupied())
    assert len(more) > 8 and (np.abs(more[:, 1] - PANE_Y_M) < 0.11).all()  # along its line, nowhere else
    without = seen_from(building, poses, LocalMapParams(window_m=8.0, extend_glass_m=0.0))
    assert (without.grid().occupied == without.occupied()).all()


def test_an_open_doorway_beside_a_pane_is_not_closed_once_the_robot_stood_before_it():
    building = glass_front(door=True)
    poses = standing((6.4, 1.2, math.pi), 5) + standing((4.2, 1.2, -math.pi / 4), 10)
    before = seen_from(building, poses)
    x = pane_cells(before, before.grid().occupied)
    assert x.min() < DOOR_M[1] - 0.15  # for all that was seen it might be glass still
    after = seen_from(building, poses + [(x, 1.2, 0.0) for x in np.arange(4.2, 3.0, -0.05)])
    x = pane_cells(after, after.grid().occupied)
    assert not ((x > DOOR_M[0] + 0.08) & (x < DOOR_M[1] - 0.08)).any()
    assert covered(x, DOOR_M[1] + 0.05, 4.4) > 0.9


def test_where_the_robot_stood_there_is_room_for_it_whatever_a_beam_says():
    rng, local = np.random.default_rng(0), LocalMap(SMALL)
    post = Building(walled(ROOM_M).walls + (Wall(box(3.0, 2.0, 0.1, 0.1), 0.02),))
    for _ in range(5):
        local.add(scan_at(post, (2.0, 2.0, 0.0), rng), np.array([2.0, 2.0, 0.0]))
    assert (np.hypot(*(cells(local.walls(), local.occupied()) - [3.0, 2.0]).T) < 0.2).any()
    local.add(scan_at(walled(ROOM_M), (3.0, 2.0, 0.0), rng), np.array([3.0, 2.0, 0.0]))
    stands = cells(local.walls(), local.occupied())
    assert (np.hypot(*(stands - [3.0, 2.0]).T) > SMALL.robot_radius_m).all()


def test_what_stood_for_long_and_went_away_is_forgotten():
    with_box = Building(walled(ROOM_M).walls + (Wall(box(4.5, 2.5, 0.4, 0.4), 0.05),))
    rng, local, pose = np.random.default_rng(0), LocalMap(LocalMapParams(window_m=8.0, resolution_m=0.1)), (2.0, 2.5, 0)

    def stands():
        found = cells(local.walls(), local.occupied())
        return int((np.hypot(*(found - [4.5, 2.5]).T) < 0.4).sum())

    for _ in range(200):
        local.add(scan_at(with_box, pose, rng), np.array(pose, float))
    assert stands() >= 3
    gone = walled(ROOM_M)
    for _ in range(200):
        local.add(scan_at(gone, pose, rng), np.array(pose, float))
        if not stands():
            break
    assert not stands()


def test_the_window_goes_with_the_robot_and_keeps_what_it_still_covers():
    corridor = walled(np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 2.0], [0.0, 2.0]]))
    local = seen_from(corridor, along_x(1.0, 12.0, 1.0, 0.1), model=made_buildings.COARSE)
    grid = local.grid()
    first, last = made_buildings.bounds(cells(grid, np.ones_like(grid.occupied)))
    assert first[0] < 12.0 - 3.4 and last[0] > 12.0 + 3.4 and last[0] - first[0] < 8.0
    walls = cells(grid, grid.occupied)
    assert np.minimum(np.abs(walls[:, 1]), np.abs(walls[:, 1] - 2.0)).max() < 0.1  # moved by whole cells: no smear
    for y_m in (0.0, 2.0):
        x = pane_cells(local, local.occupied(), y_m, ends_out=False)
        assert covered(x, first[0] + 0.5, 12.0) > 0.95
    far = (40.0, 1.0, 0.0)  # nothing of that is in the window any more
    local.add(Scan(0, np.full(10, np.nan), np.linspace(-1, 1, 10), 0.1, 25.0, made_buildings.LASER), np.array(far))
    assert not local.occupied().any()


def test_nothing_is_left_of_what_was_cleared():
    local = seen_from(walled(ROOM_M), standing((3.0, 2.0, 0.3), 3))
    assert local.occupied().any()
    local.clear()
    grid = local.grid()
    assert not grid.occupied.any() and not grid.free.any()


def test_a_beam_that_does_not_come_back_proves_free_space_so_far_and_one_that_failed_none():
    angles_rad = np.linspace(-0.2, 0.2, 21)
    for value, reach_m in ((np.inf, SMALL.unanswered_m), (np.nan, 0.0), (-np.inf, 0.0)):
        local = LocalMap(LocalMapParams(window_m=10.0))
        local.add(Scan(0, np.full(21, value), angles_rad, 0.1, 25.0, np.zeros(3)), np.zeros(3))
        free = cells(local.walls(), local.grid().free)
        furthest = max(float(free[:, 0].max()), SMALL.robot_radius_m)
        assert furthest == pytest.approx(max(reach_m, SMALL.robot_radius_m), abs=0.1)


def test_a_scan_of_one_beam_is_a_scan():
    local = LocalMap(SMALL)
    for _ in range(2):
        local.add(Scan(0, np.array([2.0]), np.zeros(1), 0.1, 25.0, np.zeros(3)), np.zeros(3))
    np.testing.assert_allclose(cells(local.walls(), local.occupied()), [[2.025, 0.025]], atol=1e-9)


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"window_m": 0.0}, "~window_m must be > 0 m and finite, got 0.0"),
        ({"robot_radius_m": math.inf}, "~robot_radius_m must be > 0 m and finite, got inf"),
        ({"window_m": 0.4}, "~window_m must be at least ten cells, got 0.4 m of 0.05 m"),
        ({"directions": 3}, "~directions must be 4 to 64, got 3"),
        ({"least_ends": 0}, "~least_ends must be >= 1, got 0"),
        ({"least_share": 0.0}, "~least_share must be in (0, 1], got 0.0"),
        ({"extend_glass_m": -0.1}, "~extend_glass_m must be >= 0 m and finite, got -0.1"),
    ],
)
def test_parameters_that_mean_nothing_are_refused(fields, line):
    with pytest.raises(ValueError) as refused:
        LocalMapParams(**fields)
    assert str(refused.value) == line


@pytest.mark.parametrize(
    "half_m, edge_m",
    [
        pytest.param(1.0, 12.0, id="a room"),
        pytest.param(4.0, 15.2, id="a hall"),
        pytest.param(9.0, 20.0, id="a larger one than the window can show"),
    ],
)
def test_of_a_wide_place_more_is_looked_at_than_of_a_narrow_one(half_m, edge_m):
    walls = half_m * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    local = LocalMap()
    for number in range(4):
        local.add(
            scan_at(Building((Wall(walls, 0.02),)), (0.0, 0.0, 1.5 * number), np.random.default_rng(number)),
            np.array([0.0, 0.0, 1.5 * number]),
        )
    whole, part = local.grid(), local.grid_around(np.zeros(2))
    assert np.array(part.occupancy.shape) * part.resolution_m == pytest.approx([edge_m, edge_m], abs=0.25)
    rows, columns = np.nonzero(part.occupancy + 1)
    places = part.centres(rows, columns)
    np.testing.assert_array_equal(part.occupancy[rows, columns], whole.occupancy[whole.cells(places)])
    assert local.grid_around(np.array([0.1, 0.0])).occupied.any() == part.occupied.any()
