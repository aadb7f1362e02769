"""Whole drives in simulated buildings, against the atlas and the truth."""

from __future__ import annotations

import copy
import functools
import math

import numpy as np
import pytest
from made_buildings import CONTROL_S, T_MEETPOINT, T_R_M, Drive, glass_t, t_corridor, turned_to, walled

from glass_nav.driving.edge_tracking import edge_driver
from glass_nav.driving.edge_tracking.edge_driver import EdgeDriver, EdgeDriverParams
from glass_nav.driving.edge_tracking.local_map import LocalMapParams
from glass_nav.geometry import se2
from glass_nav.simulation import building_file, lidar, shipped_buildings
from glass_nav.simulation.building import Building, Pane, Person, Thing, box
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import twin
from glass_nav.topology.observations import ObservationError
from glass_nav.vocabulary import DriverPhase, Outcome

LIMITS = edge_driver.EdgeDriverParams().limits
OFFICE = "opaque_office"
OFFICE_START = (9.2, 5.9, 0.0)  # in the corridor, beside node 15
NARROW_END, BESIDE_NARROW = 20, 21  # nodes
IN_T = (2.5, 0.9, 0.1)


@functools.lru_cache(maxsize=None)
def office():
    return building_file.load(shipped_buildings.find(OFFICE)), atlas_file.load(shipped_atlases.find(OFFICE))


def node_at(atlas, drive, arrival):
    away = np.hypot(*(atlas.nodes.position_m - drive.where(arrival)).T)
    return int(away.argmin()), float(away.min())


def reference_dart(atlas, drive, arrival, node):
    """The dart of the node that leaves in the direction of rank 0."""
    bearing = float(arrival.meetpoint.bearings_rad[0]) + drive.simulation.map_from_base[2]
    ring = atlas.rings[node]
    return int(ring[np.argmin([turned_to(atlas.darts.bearing_rad[dart], bearing) for dart in ring])])


def arrived_in_t(building, start=IN_T, **how):
    drive = Drive(building, start, **how)
    drive.driver.seek()
    arrival = drive.arrival()
    return drive, arrival


@functools.lru_cache(maxsize=None)
def driven_to_the_junction(made):
    drive, arrival = arrived_in_t(made())
    for _ in range(2):
        if arrival.meetpoint.degree == 3:
            return drive, arrival
        drive.driver.leave(0)
        arrival = drive.arrival()
    raise AssertionError("no junction was found")


def at_the_junction(made=t_corridor):
    """A robot at the meetpoint of the T; driven there once, for all tests."""
    drive, arrival = driven_to_the_junction(made)
    return copy.deepcopy(drive), arrival


def rank_towards(arrival, drive, direction_rad):
    """Rank of the edge that leaves most nearly in a direction of the map."""
    leaves = arrival.meetpoint.bearings_rad + drive.simulation.map_from_base[2]
    return int(np.argmin([turned_to(leaves_rad, direction_rad) for leaves_rad in leaves]))


def off_walls_m(building, points_m):
    """(K,) distances of points from the nearest surface of the building."""
    surfaces = building.surfaces
    along = surfaces.to_m - surfaces.from_m
    offset = points_m[:, None] - surfaces.from_m
    share = np.clip((offset * along).sum(-1) / (along**2).sum(-1), 0.0, 1.0)
    return np.linalg.norm(offset - share[..., None] * along, axis=-1).min(axis=1)


def check_commands(drive):
    """No control step asked for more than the base can."""
    commands = np.array([np.zeros(3), *drive.commands])
    assert (np.abs(commands[:, 0]) <= LIMITS.max_speed_m_s + 1e-9).all() and (commands[:, 1] == 0.0).all()
    assert (np.abs(commands[:, 2]) <= LIMITS.max_turn_rad_s + 1e-9).all()
    change = np.diff(commands, axis=0)
    assert change[:, 0].max() <= LIMITS.max_acceleration_m_s2 * CONTROL_S + 1e-9
    assert change[:, 0].min() >= -2.0 * LIMITS.max_acceleration_m_s2 * CONTROL_S - 1e-9
    assert np.abs(change[:, 2]).max() <= LIMITS.max_turn_acceleration_rad_s2 * CONTROL_S + 1e-9


@pytest.mark.long_run
def test_meetpoints_and_edges_of_an_office_are_those_of_its_atlas():
    building, atlas = office()
    drive = Drive(building, OFFICE_START)
    drive.driver.seek()
    arrival = drive.arrival()
    assert arrival.traversal is None and drive.driver.progress.phase == DriverPhase.ARRIVED
    dart = -1
    for turn in (1, 2):
        node, away_m = node_at(atlas, drive, arrival)
        seen = arrival.meetpoint
        assert away_m < 0.1
        assert seen.degree == atlas.degree[node] and seen.r_m == pytest.approx(atlas.nodes.r_m[node], abs=0.1)
        assert seen.scan is not None and seen.stamp_ns == arrival.stamp_ns
        reference = reference_dart(atlas, drive, arrival, node)
        if dart >= 0:
            assert reference == twin(np.array(dart))  # it came along the edge by which it left
        ring = atlas.clockwise(np.full(seen.degree, reference), np.arange(seen.degree))
        np.testing.assert_allclose(
            [
                turned_to(float(leaves) + drive.simulation.map_from_base[2], bearing)
                for leaves, bearing in zip(seen.bearings_rad, atlas.darts.bearing_rad[ring])
            ],
            0.0,
            atol=0.25,
        )
        dart = int(ring[turn])
        drive.driver.leave(turn)
        assert drive.driver.progress.phase == DriverPhase.FOLLOWING and drive.driver.progress.travelled_m == 0.0
        arrival = drive.arrival()
        driven, edge = arrival.traversal, dart >> 1
        assert driven is not None and driven.rank == turn
        assert driven.length_m == pytest.approx(atlas.edges.length_m[edge], abs=0.15)
        assert driven.chord_m == pytest.approx(atlas.edges.chord_m[edge], abs=0.15)
        turned = atlas.darts.bearing_rad[dart ^ 1] + math.pi - atlas.darts.bearing_rad[dart]
        assert turned_to(driven.turn_rad, turned) < 0.25
    assert drive.blocked == 0
    check_commands(drive)


@pytest.mark.long_run
@pytest.mark.parametrize("made", [t_corridor, glass_t], ids=["walls", "glass"])
def test_a_t_is_as_the_closed_form_says_and_the_walls_of_its_foot_are_reported_also_if_of_glass(made):
    building = made()
    drive, arrival = at_the_junction(made)
    assert np.hypot(*(drive.where(arrival) - T_MEETPOINT)) < 0.1
    assert arrival.meetpoint.r_m == pytest.approx(T_R_M, abs=0.08)
    node = drive.driver.node
    assert node is not None and node.degree == 3 and len(node.branches) == 3
    assert node.position_m == pytest.approx(
        se2.transform_points(
            drive.driver.local_from_base(drive.simulation.reading.odom_from_base), arrival.meetpoint.centre_m
        ),
        abs=0.02,
    )
    junction = drive.where(arrival)
    drive.driver.leave(rank_towards(arrival, drive, -math.pi / 2))
    arrival = drive.arrival()
    driven = arrival.traversal
    assert driven is not None and arrival.meetpoint.degree == 1
    assert drive.where(arrival) == pytest.approx([6.0, -4.0], abs=0.12)  # a metre before the end of 2 m width
    assert driven.length_m == pytest.approx(4.75, abs=0.15) and driven.chord_m == pytest.approx(4.75, abs=0.15)
    assert abs(driven.turn_rad) < 0.1 and abs(driven.chord_bearing_rad) < 0.1
    assert drive.blocked == 0
    check_commands(drive)
    start = np.array([*junction, -math.pi / 2])  # the edge leaves southward
    ends = se2.transform_points(start, driven.segments_m.reshape(-1, 2)).reshape(-1, 2, 2)
    lengths = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    off = off_walls_m(building, ends.mean(axis=1))
    assert (off[lengths > 0.5] < 0.15).all() and lengths[lengths > 0.5].sum() > 15.0


@pytest.mark.long_run
def test_stop_brings_it_to_a_stand_within_its_limits_and_resume_goes_on():
    drive, arrival = at_the_junction()
    drive.driver.leave(rank_towards(arrival, drive, 0.0))
    drive.until(lambda: drive.driver.progress.travelled_m > 0.8 and drive.command[0] > 0.4)
    drive.driver.stop()
    assert drive.driver.progress.phase == DriverPhase.IDLE and drive.driver.progress.reason == "stopped"
    before = len(drive.commands)
    for _ in range(15):
        drive.scan()
    stopping = np.array(drive.commands[before:])
    assert (stopping[-1] == 0.0).all() and (np.diff(stopping[:, 0]) <= 1e-12).all()
    check_commands(drive)
    stood = drive.simulation.map_from_base
    assert drive.driver.progress.travelled_m > 0.8
    drive.driver.resume()
    assert drive.driver.progress.phase == DriverPhase.FOLLOWING
    arrival = drive.arrival()
    driven = arrival.traversal
    assert stood[0] < 9.0 and driven is not None
    assert drive.where(arrival) == pytest.approx([11.0, 1.0], abs=0.15)
    assert driven.length_m == pytest.approx(math.hypot(5.0, 0.25), abs=0.15)  # as if it had not been stopped


@pytest.mark.long_run
def test_it_goes_back_to_the_meetpoint_that_it_left():
    drive, arrival = at_the_junction()
    drive.driver.leave(rank_towards(arrival, drive, 0.0))
    drive.until(lambda: drive.driver.progress.travelled_m > 1.2)
    drive.driver.go_back()
    assert drive.driver.progress.reason == "back to the meetpoint that it left"
    drive.until(lambda: drive.driver.progress.phase == DriverPhase.ARRIVED)
    assert np.hypot(*(drive.simulation.map_from_base[:2] - T_MEETPOINT)) < 0.15
    assert drive.driver.take_arrival() is None  # nothing new is to report
    drive.driver.leave(2)  # its edges have the ranks they had
    assert drive.driver.progress.phase == DriverPhase.FOLLOWING and drive.driver.progress.travelled_m == 0.0


@pytest.mark.long_run
def test_a_search_that_was_stopped_goes_on():
    drive = Drive(t_corridor(), IN_T)
    drive.driver.seek()
    assert drive.driver.progress.phase == DriverPhase.SEEKING and drive.driver.progress.reason == "looking around"
    drive.until(lambda: len(drive.driver.way_m) > 0)
    assert abs(sum(command[2] for command in drive.commands) * CONTROL_S) > 6.0  # it turned round first
    drive.driver.stop()
    for _ in range(10):
        drive.scan()
    assert (drive.command == 0.0).all() and drive.driver.progress.phase == DriverPhase.IDLE
    drive.driver.resume()
    assert drive.driver.progress.phase in (DriverPhase.SEEKING, DriverPhase.HOMING)
    assert drive.arrival().traversal is None


@pytest.mark.long_run
def test_what_it_cannot_do_it_says_and_changes_nothing():
    driver = EdgeDriver()
    with pytest.raises(ValueError, match="^the robot is not at a meetpoint that it could leave: the driver is IDLE$"):
        driver.leave(0)
    with pytest.raises(ValueError, match="^the robot has left no meetpoint to which it could return$"):
        driver.go_back()
    with pytest.raises(ValueError, match="^nothing was stopped that could be continued: the driver is IDLE$"):
        driver.resume()
    assert driver.local_grid is None and driver.local_graph is None and driver.node is None
    assert driver.obstacles_m(np.zeros(3)).shape == (0, 2) and driver.way_m.shape == (0, 2)
    assert driver.command(np.zeros(3), CONTROL_S).tolist() == [0.0, 0.0, 0.0]
    drive, arrival = at_the_junction()
    for rank in (-1, 3):
        with pytest.raises(ObservationError, match=f"^turn of rank {rank}: the meetpoint it left has degree 3"):
            drive.driver.leave(rank)
    with pytest.raises(ValueError, match="^nothing was stopped that could be continued: the driver is ARRIVED$"):
        drive.driver.resume()
    assert drive.driver.progress.phase == DriverPhase.ARRIVED
    drive.driver.leave(1)
    with pytest.raises(ValueError, match="the driver is FOLLOWING$"):
        drive.driver.leave(1)


@pytest.mark.long_run
def test_reset_forgets_all():
    drive, _ = at_the_junction()
    assert drive.driver.local_grid is not None and drive.driver.local_graph is not None
    assert len(drive.driver.obstacles_m(drive.simulation.reading.odom_from_base)) > 0
    drive.driver.reset()
    assert drive.driver.progress == edge_driver.Progress(DriverPhase.IDLE, "nothing to do", 0.0)
    assert drive.driver.node is None and drive.driver.local_grid is None and drive.driver.local_graph is None
    with pytest.raises(ValueError):
        drive.driver.go_back()
    drive.driver.seek()
    assert drive.driver.progress.phase == DriverPhase.SEEKING


def test_where_it_stands_obstacles_are_those_of_the_building():
    building = t_corridor()
    drive = Drive(building, IN_T)
    for _ in range(5):
        drive.scan()
    seen = se2.transform_points(
        drive.simulation.map_from_base, drive.driver.obstacles_m(drive.simulation.reading.odom_from_base)
    )
    assert len(seen) > 50 and np.percentile(off_walls_m(building, seen), 95) < 0.1
    assert np.abs(seen - drive.simulation.map_from_base[:2]).max() < 2.1


@pytest.mark.long_run
def test_what_bars_the_edge_ends_it_as_blocked_in_front_of_it_and_there_is_a_way_back():
    """A post too thin for a meetpoint, in the middle of a corridor with barely room beside it."""
    faces = np.array([[0.0, 0.0], [7.0, 0.0], [7.0, 1.2], [0.0, 1.2]])
    post = Thing(box(4.5, 0.6, 0.08, 0.08))
    drive = Drive(Building(walled(faces).walls, things=(post,)), (2.0, 0.6, math.pi))
    drive.driver.seek()
    arrival = drive.arrival()
    began = drive.where(arrival)
    assert arrival.meetpoint.degree == 1 and began[0] < 1.0
    drive.driver.leave(0)
    drive.until(lambda: drive.driver.progress.phase == DriverPhase.FAILED)
    told = drive.driver.progress
    assert told.failure == Outcome.BLOCKED
    assert told.reason.startswith("something is in the way, ") and told.reason.endswith(
        " m before the end of what is seen of the edge"
    )
    assert 3.5 < drive.simulation.map_from_base[0] < 4.5 - 0.22 and drive.blocked == 0
    drive.driver.go_back()
    drive.until(lambda: drive.driver.progress.phase == DriverPhase.ARRIVED)
    assert np.hypot(*(drive.simulation.map_from_base[:2] - began)) < 0.15


@pytest.mark.long_run
@pytest.mark.parametrize("way_m", [[[11.0, 0.3], [9.0, 0.3]], [[10.0, 0.2], [14.0, 0.2]]], ids=["here", "away"])
def test_a_person_who_walks_at_a_decimetre_a_second_is_no_meetpoint(way_m):
    faces = np.array([[0.0, -1.25], [16.0, -1.25], [16.0, 1.25], [0.0, 1.25]])
    walker = Person(np.array(way_m), speed_m_s=0.1)
    drive = Drive(Building(walled(faces).walls, people=(walker,)), (8.0, 0.0, 0.0))
    drive.driver.seek()
    drive.until(lambda: drive.driver.progress.reason == "the apparent meetpoint is none", limit_s=15.0)
    assert drive.driver.take_arrival() is None and drive.blocked == 0


@pytest.mark.long_run
def test_in_a_hall_wider_than_its_window_it_drives_to_the_middle():
    """The graph of a rectangle is the line where the long walls are nearest; a robot at a wall is far from it."""
    window = EdgeDriverParams(local_map=LocalMapParams(window_m=9.0, narrow_window_m=6.0))
    hall = walled(np.array([[0.0, 0.0], [16.0, 0.0], [16.0, 10.0], [0.0, 10.0]]))
    drive = Drive(hall, (5.5, 0.8, 1.5), p=window)
    drive.driver.seek()
    arrival = drive.arrival()
    assert arrival.meetpoint.r_m == pytest.approx(5.0, abs=0.2)
    assert drive.where(arrival)[1] == pytest.approx(5.0, abs=0.3)


@pytest.mark.long_run
def test_where_there_is_no_way_it_looks_around_again_and_gives_up():
    drive = Drive(walled(np.array([[0.0, 0.0], [1.2, 0.0], [1.2, 1.2], [0.0, 1.2]])), (0.6, 0.6, 0.0))
    drive.driver.seek()
    drive.until(lambda: drive.driver.progress.phase == DriverPhase.FAILED)
    told = drive.driver.progress
    assert told.failure == Outcome.NO_GRAPH
    assert told.reason == "no edge nearby can be reached in a straight line, even after looking around"
    turned_rad = sum(command[2] for command in drive.commands) * CONTROL_S
    assert turned_rad > 3.9 * math.pi and drive.blocked == 0


@pytest.mark.long_run
def test_a_side_corridor_that_turns_out_to_be_behind_a_pane_is_no_meetpoint():
    """From afar the foot of the T is open; whoever stands before it sees the glass."""
    pane = Pane(np.array([[5.0, 0.0], [7.0, 0.0]]))
    drive, arrival = arrived_in_t(t_corridor([pane]), scan_rate_hz=10.0)
    assert arrival.meetpoint.degree == 1 and drive.where(arrival) == pytest.approx([1.0, 1.0], abs=0.15)
    drive.driver.leave(0)
    reasons = set()

    def done():
        reasons.add(drive.driver.progress.reason)
        return drive.driver.progress.phase == DriverPhase.ARRIVED

    drive.until(done)
    assert "the apparent meetpoint is none" in reasons
    arrival = drive.driver.take_arrival()
    assert arrival is not None and arrival.traversal is not None and arrival.meetpoint.degree == 1
    assert drive.where(arrival) == pytest.approx([11.0, 1.0], abs=0.15)
    assert arrival.traversal.length_m == pytest.approx(10.0, abs=0.2) and drive.blocked == 0


@pytest.mark.long_run
def test_a_meetpoint_that_cannot_quite_be_reached_is_reported_from_as_near_as_it_gets():
    """A post stands just before the end of a narrow corridor."""
    faces = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 1.2], [0.0, 1.2]])
    drive = Drive(Building(walled(faces).walls, things=(Thing(box(5.3, 0.6, 0.08, 0.08)),)), (2.0, 0.6, math.pi))
    drive.driver.seek()
    drive.arrival()
    drive.driver.leave(0)
    arrival = drive.arrival()
    away_m = float(np.hypot(*(drive.where(arrival) - drive.simulation.map_from_base[:2])))
    assert arrival.meetpoint.degree == 1 and drive.where(arrival) == pytest.approx([5.4, 0.6], abs=0.15)
    assert 0.1 < away_m < 0.5 and drive.blocked == 0


@pytest.mark.long_run
@pytest.mark.parametrize("seed", [3, 8])
def test_out_of_a_dead_end_that_narrows_it_comes_as_it_went_in(seed):
    """Beside a table, where the base hardly fits at last and the end is the nearer the better it is seen."""
    building, atlas = office()
    start = (*atlas.nodes.position_m[BESIDE_NARROW], 0.3)
    drive, arrival = arrived_in_t(building, start, model=lidar.preset("sensitive"), seed=seed)
    node, _ = node_at(atlas, drive, arrival)
    (inward,) = (dart for dart in atlas.rings[node] if atlas.darts.node[twin(dart)] == NARROW_END)
    drive.driver.leave(rank_towards(arrival, drive, atlas.darts.bearing_rad[inward]))
    end = drive.arrival()
    assert end.meetpoint.degree == 1
    assert np.hypot(*(drive.where(end) - atlas.nodes.position_m[NARROW_END])) < 0.6
    drive.driver.leave(0)
    back = drive.arrival()
    assert node_at(atlas, drive, back)[0] == node and back.meetpoint.degree == 3
    assert drive.blocked == 0
    check_commands(drive)
