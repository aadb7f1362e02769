"""One scan fits at many places: which of them is the right one, and when may that be said?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from buildings import L_ROOM, SECOND_NS, Building, loop_drive, odometry, off

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import global_search
from glass_nav.hypotheses.global_search import GlobalSearch, SearchParams
from glass_nav.hypotheses.pose_tracker import same_place
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.sensing import bearings
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea
from glass_nav.world import landmark_map
from glass_nav.world.grid_map import UNKNOWN

# A corridor with a niche at one end only: in the middle its two directions look alike.
CORRIDOR = Building([(0, 0), (12, 0), (12, 2), (10, 2), (10, 4), (8, 4), (8, 2), (0, 2)])


def search_in(building, **values):
    grid_map = building.grid_map()
    field = DistanceField(grid_map)
    return GlobalSearch(ScanMatcher(grid_map, field), field, SearchParams(**values))


def along(x_m, heading_rad=0.0):
    """Poses down the middle of the corridor."""
    return np.array([[x, 1.0, heading_rad] for x in x_m])


def drive(search, building, poses, odom=None):
    rng = np.random.default_rng(0)
    odom = odometry(poses, rng) if odom is None else odom
    return [
        search.update(building.scan(pose, index * SECOND_NS, rng), moved)
        for index, (pose, moved) in enumerate(zip(poses, odom))
    ]


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(3))
def test_the_right_place_is_found_and_no_other(seed):
    rng = np.random.default_rng(seed)
    poses = loop_drive(40)[int(rng.integers(20)) :]
    told = drive(search_in(L_ROOM), L_ROOM, poses)
    assert told[-1].found
    for candidates, pose in zip(told, poses):
        assert not candidates.found or off(candidates.poses[0], pose)[0] < 0.1


@pytest.mark.long_run
def test_places_that_scans_cannot_tell_apart_stay_until_one_sees_a_difference():
    """To a lidar that sees 3 m the plain part of the corridor looks the same in both directions; the niche does not."""
    poses = along(np.arange(3.6, 11.0, 0.2))
    rng = np.random.default_rng(0)
    search = search_in(CORRIDOR, search_margin=2.0)
    told = [
        search.update(CORRIDOR.scan(pose, index * SECOND_NS, rng).limited(-1.0, 3.0), moved)
        for index, (pose, moved) in enumerate(zip(poses, odometry(poses, rng)))
    ]
    plain = [candidates for candidates, pose in zip(told, poses) if pose[0] < 4.8]  # the niche is 3 m ahead
    assert not any(candidates.found for candidates in plain)
    searched = [candidates for candidates in plain if len(candidates.poses)]  # the first search takes a scan or two
    assert len(searched) >= len(plain) - 2 and all(len(candidates.poses) > 10 for candidates in searched)
    assert told[-1].found and same_place(told[-1].poses[:1], poses[-1])[0]


@pytest.mark.long_run
def test_a_square_room_is_never_solved():
    room = Building([(0, 0), (6, 0), (6, 6), (0, 6)])
    told = drive(search_in(room), room, loop_drive(40, (3.0, 3.0)))
    assert not any(candidates.found for candidates in told)
    truth = loop_drive(40, (3.0, 3.0))[-1]
    for quarter in range(4):
        turned = se2.compose(np.array([3.0, 3.0, quarter * np.pi / 2]), np.array([*(truth[:2] - 3.0), truth[2]]))
        assert same_place(told[-1].poses, turned).any(), quarter


def test_a_robot_that_stands_gathers_no_evidence_by_looking_again():
    scan, odom = L_ROOM.scan(loop_drive(1)[0]), np.zeros(3)
    search = search_in(L_ROOM, search_margin=1000.0)
    first = search.update(scan, odom)
    for index in range(1, 20):
        last = search.update(replace(scan, stamp_ns=index), odom)
    assert last.lead == pytest.approx(first.lead, abs=0.5)


def test_a_lidar_that_sees_all_round_sees_nothing_new_when_it_turns():
    true = loop_drive(1)[0]
    turns = np.stack([true + [0.0, 0.0, angle] for angle in np.linspace(0.0, 3.0, 8)])
    search = search_in(L_ROOM, search_margin=1000.0)
    told = drive(search, L_ROOM, turns, odom=turns)
    assert told[-1].lead == pytest.approx(told[0].lead, abs=1.5)


@pytest.mark.long_run
def test_a_place_that_the_first_scan_hid_is_found_later():
    """People all round at the start: none of the first candidates is right."""
    poses = loop_drive(40)
    rng = np.random.default_rng(4)
    search = search_in(L_ROOM)
    odom = odometry(poses, rng)
    crowd = L_ROOM.scan(poses[0], 0, rng)
    told = [search.update(replace(crowd, ranges_m=rng.uniform(0.4, 0.9, len(crowd))), odom[0])]
    told += [
        search.update(L_ROOM.scan(pose, (index + 1) * SECOND_NS, rng), moved)
        for index, (pose, moved) in enumerate(zip(poses[1:], odom[1:]))
    ]
    assert off(told[-1].poses[0], poses[-1])[0] < 0.1
    for candidates, pose in zip(told, poses):
        assert not candidates.found or off(candidates.poses[0], pose)[0] < 0.1


@pytest.mark.long_run
def test_a_slip_of_the_wheels_loses_nobody_for_long():
    poses = loop_drive(40)
    odom = odometry(poses, np.random.default_rng(1))
    odom[20:] = se2.compose(np.array([1.0, -0.5, 1.2]), odom[20:])
    told = drive(search_in(L_ROOM), L_ROOM, poses, odom=odom)
    assert off(told[-1].poses[0], poses[-1])[0] < 0.1


def test_a_candidate_that_is_told_has_its_head_start():
    """Of two places that a scan cannot tell apart the one where the robot was believed to be leads."""
    room = Building([(0, 0), (6, 0), (6, 6), (0, 6)])
    believed = np.array([4.0, 3.5, 0.3 + np.pi])  # the true one, turned by half about the middle
    search = search_in(room)
    search.add(believed, 4.0)
    told = search.update(room.scan(np.array([2.0, 2.5, 0.3])), np.zeros(3))
    assert same_place(told.poses[:1], believed)[0]
    assert told.lead == pytest.approx(4.0, abs=0.5) and not told.found


def test_a_candidate_goes_along_with_the_filter_that_follows_its_place():
    search = search_in(SQUARE)
    search.add(np.array([2.0, 1.5, 0.3]), 5.0)
    search.correct(np.array([2.3, 1.6, 0.4]))
    search.correct(np.array([5.0, 5.0, 0.4]))  # another place
    blind = replace(SQUARE.scan(IN_SQUARE), ranges_m=np.full(len(SQUARE.scan(IN_SQUARE).ranges_m), np.inf))
    assert search.update(blind, np.zeros(3)).poses == pytest.approx(np.array([[2.3, 1.6, 0.4]]))


def test_a_place_from_which_the_lidar_would_see_what_the_map_does_not_know_is_none():
    grid_map = SQUARE.grid_map()
    field = DistanceField(grid_map)
    nothing = KnownArea(replace(grid_map, occupancy=np.full_like(grid_map.occupancy, np.int8(UNKNOWN))))
    for area, places in ((KnownArea(grid_map), True), (nothing, False)):
        search = GlobalSearch(ScanMatcher(grid_map, field), field, SearchParams(), area)
        assert bool(len(drive(search, SQUARE, [IN_SQUARE] * 2, [IN_SQUARE] * 2)[-1].poses)) == places


def test_what_the_map_does_not_know_supports_no_place_outside_of_it():
    grid_map = SQUARE.grid_map()
    points = global_search.evidence_points(SQUARE.scan(IN_SQUARE))
    poses = np.array([IN_SQUARE, IN_SQUARE + [100.0, 0.0, 0.0]])
    inside, outside = global_search.fit(DistanceField(grid_map), points, poses, KnownArea(grid_map))
    assert inside > 0.9 and outside == 0.0


def test_the_compiled_fit_agrees_with_numpy():
    building, rng = Building([(0, 0), (6, 0), (6, 4), (0, 4)]), np.random.default_rng(0)
    grid_map = building.grid_map()
    grid_map.occupancy[:, :40] = UNKNOWN
    field, area = DistanceField(grid_map), KnownArea(grid_map)
    points, poses = rng.uniform(-4.0, 4.0, (150, 2)), rng.uniform([0, 0, -4], [6, 4, 4], (20, 3))
    ends = se2.transform_points(poses[:, None], points)
    fits = 0.04 / (0.04 + field.distance(ends[..., 0], ends[..., 1]) ** 2)
    unknown = np.where(area.is_unmapped(poses[:, :2]), 0.0, 0.4)
    expected = np.mean(np.where(area.contains(ends), fits, unknown[:, None]), axis=1)
    assert len(np.unique(unknown)) == 2
    np.testing.assert_allclose(global_search.fit(field, points, poses, area), expected, rtol=1e-12)


def test_the_covariance_is_of_all_places():
    room = Building([(0, 0), (6, 0), (6, 6), (0, 6)])
    told = search_in(room).update(room.scan(np.array([1.0, 3.0, 0.0])), np.zeros(3))
    assert told.covariance.shape == (3, 3) and np.linalg.eigvalsh(told.covariance)[0] >= 0.0
    assert told.covariance[0, 0] > 1.0 and told.covariance[2, 2] > 0.5
    assert told.weights.sum() == pytest.approx(1.0) and np.all(np.diff(told.weights) <= 1e-15)


def test_with_too_few_answers_candidates_only_move():
    search = search_in(L_ROOM)
    scan = L_ROOM.scan(loop_drive(1)[0])
    blind = replace(scan, ranges_m=np.full(len(scan), np.inf))
    assert len(search.update(blind, np.zeros(3)).poses) == 0
    before = search.update(scan, np.zeros(3))
    after = search.update(blind, np.array([0.5, 0.0, 0.0]))
    np.testing.assert_allclose(after.poses, se2.compose(before.poses, np.array([0.5, 0.0, 0.0])), atol=1e-12)
    assert after.lead == before.lead


def test_a_person_beside_the_robot_is_little_of_the_evidence():
    """Half of the beams end at one thing 0.4 m away."""
    scan = L_ROOM.scan(np.array([2.0, 1.5, 0.3]))
    hidden = scan.angles_rad > 0.0
    points = global_search.evidence_points(replace(scan, ranges_m=np.where(hidden, 0.4, scan.ranges_m)))
    assert np.mean(hidden) > 0.45 and len(points) <= 60
    assert np.mean(np.hypot(*points.T) < 0.41) < 0.3


@pytest.mark.long_run
def test_a_place_where_scans_do_not_fit_is_not_found():
    lenient, strict = (search_in(L_ROOM, search_least_fit=fit) for fit in (0.5, 1.0))
    poses = loop_drive(40)
    assert drive(lenient, L_ROOM, poses)[-1].found and not drive(strict, L_ROOM, poses)[-1].found


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(search_margin=0.0), "~search_margin must be finite and > 0, got 0.0"),
        (dict(search_margin=np.inf), "~search_margin must be finite and > 0, got inf"),
        (dict(search_least_fit=1.2), "~search_least_fit must be in [0, 1], got 1.2"),
    ],
)
def test_wrong_limits_are_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        SearchParams(**values)
    assert str(err.value) == text


# -- bearings to landmarks, where there are some

SQUARE = Building([(0, 0), (6, 0), (6, 6), (0, 6)])  # four places look alike to a lidar
TAGS = landmark_map.seen_from_all_sides("abcd", np.array([[0.0, 2.0], [6.0, 1.0], [3.0, 6.0], [1.5, 0.0]]), 15.0)
IN_SQUARE = np.array([2.0, 1.5, 0.4])


def tags_seen(pose, ids="abcd"):
    way = TAGS.positions_m[TAGS.numbers(tuple(ids))] - pose[:2]
    return bearings.standing(tuple(ids), angles.wrap(np.arctan2(way[:, 1], way[:, 0]) - pose[2]), 0.005)


def square_seen(search, *turns):
    """What the search says to a standing robot after each turn of its sensor of bearings."""
    rng = np.random.default_rng(0)
    return [
        search.update(SQUARE.scan(IN_SQUARE, index * SECOND_NS, rng), np.zeros(3), [(seen, TAGS)] if seen else ())
        for index, seen in enumerate(turns)
    ]


def test_bearings_tell_places_apart_that_look_alike_to_the_lidar():
    without, told = square_seen(search_in(SQUARE), None, tags_seen(IN_SQUARE))
    assert not without.found and told.found
    assert off(told.poses[0], IN_SQUARE)[0] < 0.1


def test_one_bearing_finds_no_place_however_often_it_is_repeated_to_a_robot_that_stands():
    told = square_seen(search_in(SQUARE), *[tags_seen(IN_SQUARE, "a")] * 20)
    assert not any(candidates.found for candidates in told)
    assert same_place(told[-1].poses[:1], IN_SQUARE)[0]  # it is ahead all the same
    assert 3.0 < told[-1].lead < 6.0


def test_a_landmark_counts_again_after_a_way():
    search = search_in(SQUARE, search_margin=1000.0)
    told, rng = [], np.random.default_rng(0)
    for index, x_m in enumerate([1.0, 2.0, 3.1, 4.2]):
        pose = np.array([x_m, 1.5, 0.0])
        told.append(search.update(SQUARE.scan(pose, index * SECOND_NS, rng), pose, [(tags_seen(pose, "c"), TAGS)]))
    leads = [candidates.lead for candidates in told]
    assert leads[1] < leads[0] + 2.0 and leads[2] > leads[0] + 3.0


def test_bearings_without_any_place_say_nothing():
    blind = replace(SQUARE.scan(IN_SQUARE), ranges_m=np.full(len(SQUARE.scan(IN_SQUARE).ranges_m), np.inf))
    assert not len(search_in(SQUARE).update(blind, np.zeros(3), [(tags_seen(IN_SQUARE), TAGS)]).poses)
