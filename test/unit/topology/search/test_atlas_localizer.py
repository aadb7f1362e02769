"""Whole searches: the worked example of the document, confirmation, ambiguity, LOST."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import made_atlases
import made_scans
import numpy as np
import pytest
from made_scans import MadeScans

from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import NOT_FOLLOWED, Meetpoint, ObservationError, Traversal
from glass_nav.topology.search import wake_up_trials
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.atlas_robot import AtlasRobot, Surroundings, TrialParams
from glass_nav.topology.search.matching import poses_at
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import SearchState

DOCUMENT = SearchParams(vote_mode="seed", confirm_edges=0)


def example() -> Atlas:
    return atlas_file.load(shipped_atlases.find("document_example"))


def nodes(localizer: AtlasLocalizer) -> "list[int]":
    assert localizer.estimate is not None
    return sorted(set(localizer.atlas.darts.node[localizer.estimate.dart].tolist()))


def test_the_worked_example_of_the_document_is_solved_at_depth_2() -> None:
    """global_localization_procedure.txt, "A Simple Illustrative Example"."""
    localizer = AtlasLocalizer(example(), DOCUMENT)
    # Depth 0: "Nodes 0 and 1 are indistinguishable, as are nodes 2 and 3. The robot drives to node 0 ..."
    assert localizer.start(Meetpoint(3, 1.5)).state == SearchState.SEARCHING
    assert nodes(localizer) == [0, 1]
    # "... drives out on edge 0 of node 0." Depth 1: "The robot arrives at edge 0 of node 1." Of the search nodes 2 and
    # 3 go by node matching, one of 0 and one of 1 by edge matching; "the result is to turn right".
    estimate = localizer.update(Traversal(0, 8.0, 8.0), Meetpoint(3, 1.5))
    assert estimate.state == SearchState.SEARCHING and nodes(localizer) == [0, 1] and len(estimate.dart) == 2
    assert estimate.choice is not None and estimate.choice.name == "RIGHT"
    # Depth 2: "Since only one active candidate remains at depth 2, the robot is located at that candidate node (in
    # this case 0). The robot now has the knowledge of the true nodes and edges that it has traversed."
    estimate = localizer.update(Traversal(estimate.choice.rank, 11.2, 8.0), Meetpoint(3, 1.5))
    assert (estimate.state, estimate.depth, nodes(localizer)) == (SearchState.CONFIRMED, 2, [0])
    path = localizer.path(int(estimate.dart[0]))
    assert localizer.atlas.darts.node[path].tolist() == [0, 1, 0]
    assert (path >> 1).tolist()[1:] == [0, 1]


def test_the_way_that_was_found_goes_into_the_statistics() -> None:
    atlas = example()
    localizer = AtlasLocalizer(atlas, DOCUMENT)
    localizer.start(Meetpoint(3, 1.48))
    localizer.update(Traversal(0, 8.1, 8.0), Meetpoint(3, 1.5))
    localizer.update(Traversal(2, 11.2, 8.0), Meetpoint(3, 1.52))
    localizer.count_visits(atlas.visits)
    assert atlas.visits.node_count.tolist() == [2, 1, 0, 0]
    assert atlas.visits.node_r_mean_m[0] == pytest.approx(1.5)
    assert atlas.visits.edge_count.tolist() == [1, 1, 0, 0]
    assert atlas.visits.edge_length_mean_m[0] == pytest.approx(8.1)


def test_what_the_detector_erred_about_does_not_go_into_the_statistics() -> None:
    atlas = made_atlases.corridors(
        [(0, 0), (6, 0), (14, 0), (26, 0), (6, 4)], [0.9, 1.3, 1.7, 0.5, 1.4], [(0, 1), (1, 2), (2, 3), (1, 4)]
    )
    localizer = AtlasLocalizer(atlas, SearchParams(confirm_edges=0))
    localizer.start(Meetpoint(1, 0.5))
    localizer.update(Traversal(0, 12.0, 12.0), Meetpoint(2, 1.7))
    estimate = localizer.update(Traversal(1, 14.0, 14.0), Meetpoint(1, 0.9))  # past 1
    assert estimate.errors.tolist() == [1]
    localizer.count_visits(atlas.visits)
    assert atlas.visits.node_count.tolist() == [1, 0, 1, 1, 0] and atlas.visits.edge_count.tolist() == [0, 0, 1, 0]


def test_one_candidate_is_only_tentative_until_new_edges_confirm_it() -> None:
    atlas = made_atlases.voronoi(60, 4)
    robot = AtlasRobot(Surroundings.of(atlas), TrialParams(noise_limit=0.0), np.random.default_rng(0))
    localizer = AtlasLocalizer(atlas, SearchParams(confirm_edges=3))
    estimate = localizer.start(robot.wake_up(0))
    states, driven = [estimate.state], []
    while estimate.choice is not None:
        traversal, meetpoint = robot.drive(estimate.choice.rank)
        estimate = localizer.update(traversal, meetpoint)
        states.append(estimate.state)
        driven.append(robot.dart >> 1)
    assert states[-1] == SearchState.CONFIRMED and estimate.dart.tolist() == [robot.dart]
    first = states.index(SearchState.TENTATIVE)
    assert len(states) - 1 - first >= 3 and set(states[first:-1]) == {SearchState.TENTATIVE}
    assert len(set(driven[first:]) - set(driven[:first])) >= 3


def test_a_building_driven_all_over_has_nothing_left_to_confirm() -> None:
    atlas = made_atlases.corridors([(0, 0), (6, 0), (10, 0)], [0.9, 1.3, 0.4], [(0, 1), (1, 2)])
    localizer = AtlasLocalizer(atlas, SearchParams(confirm_edges=5))
    assert localizer.start(Meetpoint(1, 0.9)).state == SearchState.TENTATIVE
    assert localizer.update(Traversal(0, 6.0, 6.0), Meetpoint(2, 1.3)).state == SearchState.TENTATIVE
    estimate = localizer.update(Traversal(1, 4.0, 4.0), Meetpoint(1, 0.4))
    assert (estimate.state, estimate.choice) == (SearchState.CONFIRMED, None)


def test_a_claim_waits_where_the_next_meetpoint_is_near() -> None:
    # 1 and 2 are 0.5 m apart and of equal r: who came 8 m along edge 0 may have missed 1 and stand at 2.
    atlas = made_atlases.corridors(
        [(0, 0), (8, 0), (8.5, 0), (16.5, 0), (8, 7), (8.5, -9)],
        [0.9, 1.3, 1.3, 0.5, 1.4, 1.9],
        [(0, 1), (1, 2), (2, 3), (1, 4), (2, 5)],
    )
    localizer = AtlasLocalizer(atlas, SearchParams(confirm_edges=1, use_edge_angles=False))
    assert localizer.start(Meetpoint(1, 0.9)).state == SearchState.TENTATIVE
    estimate = localizer.update(Traversal(0, 8.1, 8.1), Meetpoint(3, 1.3))
    assert (
        estimate.state == SearchState.TENTATIVE
        and "another one matches if a meetpoint was just missed" in estimate.reason
    )
    assert estimate.choice is not None
    estimate = localizer.update(Traversal(1, 7.0, 7.0), Meetpoint(1, 1.4))  # up the side corridor of 1
    assert estimate.state == SearchState.CONFIRMED and nodes(localizer) == [4]


def quarters() -> Atlas:
    """Four equal wings around a hall: a quarter turn changes nothing. Each wing has a side corridor to one side."""
    xy, r, ends = [(0.0, 0.0)], [2.0], []
    for k in range(4):
        cos, sin = [(1, 0), (0, 1), (-1, 0), (0, -1)][k]
        at = len(xy)
        xy += [(8 * cos, 8 * sin), (13 * cos, 13 * sin), (8 * cos - 4 * sin, 8 * sin + 4 * cos)]
        r += [1.2, 0.8, 0.6]
        ends += [(0, at), (at, at + 1), (at, at + 2)]
    return made_atlases.corridors(xy, r, ends)


@pytest.mark.parametrize("seed", range(8))
def test_a_symmetric_floor_is_ambiguous_with_exactly_its_four_places(seed: int) -> None:
    atlas = quarters()
    trial = next(iter(wake_up_trials.trials(atlas, SearchParams(), TrialParams(noise_limit=2.0), 1, seed)))
    assert trial.outcome == SearchState.AMBIGUOUS and trial.truth_lost_at is None
    poses = poses_at(atlas, trial.estimate.dart, Meetpoint(1, 1.0))
    assert len(poses) == 4
    turned = np.sort(np.mod(poses[:, 2] - poses[0, 2], 2 * np.pi))
    np.testing.assert_allclose(turned, np.arange(4) * np.pi / 2, atol=1e-9)  # a quarter turn each
    radius = np.hypot(*poses[:, :2].T)
    np.testing.assert_allclose(radius, radius[0], atol=1e-9)


def test_places_whose_difference_is_far_away_are_told_apart_by_driving_there() -> None:
    count = 6
    xy = [(5.0 * i, y) for y in (0.0, 100.0) for i in range(count)]
    r = [1.0] * count + [1.0] * (count - 1) + [2.0]
    ends = [(row + i, row + i + 1) for row in (0, count) for i in range(count - 1)]
    atlas = made_atlases.corridors(xy, r, ends)
    trials = list(wake_up_trials.trials(atlas, SearchParams(), TrialParams(noise_limit=1.0), 30, 0))
    rows = [set((atlas.darts.node[trial.estimate.dart] >= count).tolist()) for trial in trials]
    # The first row alone is the same after half a turn.
    assert [trial.outcome for trial in trials] == [
        SearchState.CONFIRMED if row == {True} else SearchState.AMBIGUOUS for row in rows
    ]
    assert {True} in rows and {False} in rows
    assert max(trial.edges for trial in trials) <= 14


def test_the_search_over_pairs_says_how_far_the_difference_is() -> None:
    count = 6
    xy = [(5.0 * i, y) for y in (0.0, 100.0) for i in range(count)]
    r = [0.5] + [1.0] * (count - 1) + [0.5] + [1.0] * (count - 2) + [2.0]
    ends = [(row + i, row + i + 1) for row in (0, count) for i in range(count - 1)]
    localizer = AtlasLocalizer(made_atlases.corridors(xy, r, ends), SearchParams())
    localizer.start(Meetpoint(1, 0.5))
    estimate = localizer.update(Traversal(0, 5.0, 5.0), Meetpoint(2, 1.0))
    assert (estimate.state, estimate.reason) == (
        SearchState.SEARCHING,
        "2 candidates, the next difference is 4 edges away",
    )
    assert estimate.choice is not None and estimate.choice.name == "FORWARD"


def test_a_robot_that_fits_nowhere_is_lost_and_not_before_errors_were_considered() -> None:
    localizer = AtlasLocalizer(example(), SearchParams())
    assert localizer.start(Meetpoint(4, 3.0)).state == SearchState.SEARCHING  # it may be none
    estimate = localizer.update(Traversal(2, 30.0, 30.0), Meetpoint(4, 3.0))
    while estimate.state == SearchState.SEARCHING and estimate.choice is not None:
        estimate = localizer.update(Traversal(estimate.choice.rank, 30.0, 30.0), Meetpoint(4, 3.0))
    assert (estimate.state, estimate.choice, len(estimate.dart)) == (SearchState.LOST, None, 0)
    assert estimate.reason == "no node of the atlas matches what was seen, even with 2 detection errors allowed"
    assert AtlasLocalizer(example(), DOCUMENT).start(Meetpoint(4, 3.0)).state == SearchState.LOST


def test_at_what_may_be_no_meetpoint_the_robot_goes_straight_on() -> None:
    localizer = AtlasLocalizer(example(), SearchParams())
    behind_left_on = Meetpoint(3, 3.0, bearings_rad=np.array([np.pi, np.pi / 2, 0.1]))
    estimate = localizer.start(behind_left_on)
    assert estimate.choice is not None and estimate.choice.rank == 2
    estimate = localizer.start(Meetpoint(4, 3.0))
    assert estimate.choice is not None and estimate.choice.rank == 2


def test_a_turn_that_no_dart_has_is_refused_and_the_search_goes_on() -> None:
    localizer = AtlasLocalizer(example(), SearchParams())
    before = localizer.start(Meetpoint(3, 1.5))
    with pytest.raises(ObservationError, match="turn of rank 7: the meetpoint it left has degree 3, allowed 0 to 2"):
        localizer.update(Traversal(7, 8.0, 8.0), Meetpoint(3, 1.5))
    assert localizer.estimate is before
    assert localizer.update(Traversal(0, 8.0, 8.0), Meetpoint(3, 1.5)).depth == 1


def test_after_a_blocked_edge_dead_reckoning_carries_the_candidates_to_the_next_meetpoint() -> None:
    """Two equal rows of five places each, 100 m apart; the robot drives from the second place to the fourth."""
    xy = [(5.0 * i, y) for y in (0.0, 100.0) for i in range(5)]
    atlas = made_atlases.corridors(
        xy, [0.5, 1.0, 1.0, 1.0, 0.5] * 2, [(row + i, row + i + 1) for row in (0, 5) for i in range(4)]
    )
    localizer = AtlasLocalizer(atlas, SearchParams())
    behind_ahead = np.array([np.pi, 0.0])
    localizer.start(Meetpoint(1, 0.5, bearings_rad=np.array([0.0]), odom_from_base=np.zeros(3)))
    first = Meetpoint(2, 1.0, bearings_rad=behind_ahead, odom_from_base=np.array([5.0, 0.0, 0.0]))
    before = localizer.update(Traversal(0, 5.0, 5.0), first)
    assert len(before.dart) == 4  # from either end of either row
    estimate = localizer.update(NOT_FOLLOWED, replace(first, odom_from_base=np.array([15.1, 0.2, 0.0])))
    assert (estimate.state, estimate.depth) == (SearchState.SEARCHING, 1)
    assert sorted(atlas.darts.node[estimate.dart].tolist()) == [1, 3, 6, 8]
    expected = [[5.0, 0.0], [5.0, 100.0], [15.0, 0.0], [15.0, 100.0]]
    assert sorted(localizer.map_from_base(estimate.dart)[:, :2].round().tolist()) == expected
    nowhere = localizer.update(NOT_FOLLOWED, replace(first, odom_from_base=np.array([15.1, 40.0, 0.0])))
    assert len(nowhere.dart) == 12  # dead reckoning leads to no place of the atlas: any will do
    assert localizer.update(NOT_FOLLOWED, replace(first, odom_from_base=None)).dart.size == 12


def test_the_pose_is_where_the_robot_says_it_stands_at_the_meetpoint() -> None:
    atlas = example()
    # Worked by hand: come along dart 1 (node 1 at (8, 0), looking west), so it travels east; 0.2 m short of the
    # meetpoint, which is 0.2 m ahead and 0.1 m to its left, and it looks 0.3 rad to the left of its way.
    at = Meetpoint(3, 1.5, bearings_rad=np.array([np.pi - 0.3, 1.0, -1.0]), centre_m=np.array([0.2, 0.1]))
    (pose,) = poses_at(atlas, np.array([1]), at)
    cos, sin = np.cos(0.3), np.sin(0.3)
    np.testing.assert_allclose(pose, [8.0 - (0.2 * cos - 0.1 * sin), -(0.2 * sin + 0.1 * cos), 0.3], atol=1e-5)
    (bare,) = poses_at(atlas, np.array([1]), Meetpoint(3, 1.5))
    np.testing.assert_allclose(bare, [8.0, 0.0, 0.0], atol=1e-5)


# -- scans


def twins() -> Atlas:
    """Two equal rows of places, 100 m apart in x."""
    xy = [(x + shift, y) for shift in (0.0, 100.0) for x, y in ((0, 0), (6, 0), (14, 0), (6, 5))]
    ends = [(row + a, row + b) for row in (0, 4) for a, b in ((0, 1), (1, 2), (1, 3))]
    return made_atlases.corridors(xy, [0.5, 1.3, 1.1, 1.7] * 2, ends)


ROW = (  # rank, length, r, x at its end, bearings there
    (0, 6.0, 1.3, 6.0, [np.pi, 0.5 * np.pi, 0.0]),
    (2, 8.0, 1.1, 14.0, [np.pi]),
    (0, 8.0, 1.3, 6.0, [np.pi, 0.0, -0.5 * np.pi]),
)


def share_at(begins_at: float, there: float = 0.95, elsewhere: float = 0.5) -> MadeScans:
    """Scans that the map explains in the row of twins() that begins at x; a search proposes both rows."""
    starts = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0]])
    return MadeScans(lambda poses: np.where(np.abs(poses[:, 0] - begins_at) < 20.0, there, elsewhere), starts)


def driven_in_the_first_row(localizer: AtlasLocalizer, scans: "MadeScans | None") -> "list[Any]":
    """From its west end east, back and into the side corridor; a scan comes each metre if there are any."""
    localizer.begin()
    stamp_ns, x, heading, told = 1, 0.0, 0.0, []

    def look() -> "Any | None":
        nonlocal stamp_ns
        for _ in range(3):
            stamp_ns += 1
            final = localizer.look(made_scans.scan(stamp_ns), np.array([x, 0.0, heading]))[1]
            if final is not None:
                return final
        return None

    def meetpoint(r_m: float, bearings_rad: "list[float]") -> Meetpoint:
        odom = None if scans is None else np.array([x, 0.0, heading])
        return Meetpoint(
            len(bearings_rad), r_m, bearings_rad=np.array(bearings_rad), stamp_ns=stamp_ns, odom_from_base=odom
        )

    if scans is not None:
        look()
    told.append(localizer.start(meetpoint(0.5, [0.0])))
    for rank, length_m, r_m, to_x, bearings_rad in ROW:
        heading = 0.0 if to_x > x else np.pi
        while abs(to_x - x) > 1e-9 and not told[-1].done:
            x += float(np.clip(to_x - x, -1.0, 1.0))
            final = look() if scans is not None else None
            told += [] if final is None else [final]
        if told[-1].done:
            break
        told.append(localizer.update(Traversal(rank, length_m, length_m), meetpoint(r_m, bearings_rad)))
    return told


def test_what_nothing_else_can_tell_apart_scans_do_and_before_the_first_edge() -> None:
    plain = driven_in_the_first_row(AtlasLocalizer(twins(), SearchParams(use_edge_angles=False)), None)
    assert [len(each.dart) for each in plain][:2] == [2, 2] and plain[-1].state != SearchState.CONFIRMED
    scans = share_at(0.0)
    localizer = AtlasLocalizer(twins(), SearchParams(use_edge_angles=False), scans)
    judged = driven_in_the_first_row(localizer, scans)
    assert judged[0].state in (SearchState.TENTATIVE, SearchState.SEARCHING)
    assert (judged[-1].state, judged[-1].depth, judged[-1].choice) == (SearchState.CONFIRMED, 0, None)
    assert judged[-1].reason.startswith("the best place has over 99.9 % of the probability; it explains 9")
    assert localizer.belief is not None
    np.testing.assert_allclose(localizer.poses(judged[-1]), localizer.belief.poses[:1])
    assert np.hypot(*localizer.poses(judged[-1])[0, :2]) < 6.0
    localizer.count_visits(localizer.atlas.visits)  # no edge was driven


def test_places_that_look_alike_stay_both_and_are_proved_to() -> None:
    both = MadeScans(lambda poses: np.full(len(poses), 0.95), np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0]]))
    localizer = AtlasLocalizer(twins(), SearchParams(use_edge_angles=False), both)
    told = driven_in_the_first_row(localizer, both)
    assert {each.state for each in told[:-1]} == {SearchState.SEARCHING} and {len(each.dart) for each in told} == {2}
    assert told[-1].state == SearchState.AMBIGUOUS
    assert told[-1].reason == "2 places match, and no turn can tell them apart"
    belief = localizer.belief
    assert belief is not None and belief.elsewhere < 0.001
    np.testing.assert_allclose(belief.share[:2], belief.share[0])
    assert sorted(belief.dart[:2].tolist()) == sorted(told[-1].dart.tolist())
    assert localizer.update(Traversal(1, 5.0, 5.0), Meetpoint(1, 1.7)).state != SearchState.CONFIRMED  # no odometry


def test_a_robot_of_another_building_is_lost() -> None:
    nowhere = share_at(-1000.0, elsewhere=0.2)
    localizer = AtlasLocalizer(twins(), SearchParams(use_edge_angles=False), nowhere)
    told = driven_in_the_first_row(localizer, nowhere)
    assert told[-1].state == SearchState.LOST and told[-1].choice is None and len(told[-1].dart) == 0
    assert told[-1].reason.startswith("no place in the map explains what was seen: the best one ")


def test_where_the_graph_is_wrong_the_belief_stays() -> None:
    """Meetpoints that no atlas has, in a row, and a map that explains the scans a little better than by chance."""
    scans = share_at(0.0, there=0.75, elsewhere=0.3)
    localizer = AtlasLocalizer(twins(), SearchParams(max_detection_errors=0), scans)
    localizer.begin()
    for stamp_ns in (1, 2, 3):
        localizer.look(made_scans.scan(stamp_ns), np.zeros(3))
    unknown = Meetpoint(4, 2.7, stamp_ns=3, odom_from_base=np.zeros(3))
    told = [localizer.start(unknown)]
    for number in (1, 2):
        odom = np.array([3.0 * number, 0.0, 0.0])
        told.append(
            localizer.update(Traversal(2, 3.0, 3.0), replace(unknown, stamp_ns=3 + number, odom_from_base=odom))
        )
    assert {each.state for each in told} == {SearchState.TENTATIVE} and [each.depth for each in told] == [0, 1, 2]
    assert localizer.forest.depth == 0  # it began anew where nothing matched
    belief = localizer.belief
    assert belief is not None and set(belief.dart.tolist()) == {-1}
    assert -1.9 * 1.5 < belief.graph_nats[0] < -1.9  # what one thing that was moved does counts once


def test_without_scans_or_if_they_are_not_to_be_used_nothing_changes() -> None:
    plain = driven_in_the_first_row(AtlasLocalizer(twins(), SearchParams()), None)
    scans = share_at(0.0)
    for params, looks in ((SearchParams(), None), (SearchParams(use_scans=False), scans)):
        localizer = AtlasLocalizer(twins(), params, scans)
        other = driven_in_the_first_row(localizer, looks)
        assert localizer.belief is None
        assert [(each.state, each.reason, each.depth, each.dart.tolist()) for each in other] == [
            (each.state, each.reason, each.depth, each.dart.tolist()) for each in plain
        ]


def test_the_procedure_of_the_document_asks_no_scans() -> None:
    scans = share_at(0.0)
    localizer = AtlasLocalizer(example(), DOCUMENT, scans)
    assert localizer.look(made_scans.scan(1), np.zeros(3)) == (False, None)
    assert localizer.start(Meetpoint(3, 1.5, scan=made_scans.scan(1))).state == SearchState.SEARCHING
    assert nodes(localizer) == [0, 1] and scans.judged == 0
    assert localizer.update(Traversal(0, 30.0, 30.0), Meetpoint(3, 1.5)).state == SearchState.LOST
