"""Whole searches: the worked example of the document, confirmation, ambiguity, LOST."""

from __future__ import annotations

from typing import Any

import made_atlases
import numpy as np
import pytest

from glass_nav.sensing.scan import Scan
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import Meetpoint, ObservationError, Traversal
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


SCAN = Scan(0, np.ones(3), np.zeros(3), 0.1, 10.0, np.zeros(3))


def west(scan: Scan, map_from_base: np.ndarray) -> np.ndarray:
    """A judge to whom a scan fits at x < 50 only."""
    return np.where(map_from_base[:, 0] < 50.0, 0.9, 0.1)


def nowhere(scan: Scan, map_from_base: np.ndarray) -> np.ndarray:
    return np.full(len(map_from_base), 0.1)


def twins() -> Atlas:
    """Two equal rows of places, 100 m apart in x."""
    xy = [(x + shift, y) for shift in (0.0, 100.0) for x, y in ((0, 0), (6, 0), (14, 0), (6, 5))]
    ends = [(row + a, row + b) for row in (0, 4) for a, b in ((0, 1), (1, 2), (1, 3))]
    return made_atlases.corridors(xy, [0.5, 1.3, 1.1, 1.7] * 2, ends)


def driven_in_the_first_row(localizer: AtlasLocalizer, scan: "Scan | None") -> "list[Any]":
    """From its west end east, back and into the side corridor."""
    told = [localizer.start(Meetpoint(1, 0.5, scan=scan))]
    for rank, length_m, degree, r_m in ((0, 6.0, 3, 1.3), (2, 8.0, 1, 1.1), (0, 8.0, 3, 1.3)):
        if told[-1].done:
            break
        told.append(localizer.update(Traversal(rank, length_m, length_m), Meetpoint(degree, r_m, scan=scan)))
    return told


def test_what_nothing_else_can_tell_apart_scans_do() -> None:
    plain = driven_in_the_first_row(AtlasLocalizer(twins(), SearchParams(use_edge_angles=False)), None)
    assert [len(each.dart) for each in plain][:2] == [2, 2] and plain[-1].state != SearchState.CONFIRMED
    judged = driven_in_the_first_row(AtlasLocalizer(twins(), SearchParams(use_edge_angles=False), west), SCAN)
    assert {len(each.dart) for each in judged} == {1}
    assert judged[0].state == SearchState.TENTATIVE and judged[-1].state == SearchState.CONFIRMED


def test_without_scans_a_judge_changes_nothing() -> None:
    plain = driven_in_the_first_row(AtlasLocalizer(twins(), SearchParams()), None)
    for judge, scan in ((nowhere, None), (None, SCAN)):
        other = driven_in_the_first_row(AtlasLocalizer(twins(), SearchParams(), judge), scan)
        assert [(each.state, each.reason, each.depth, each.dart.tolist()) for each in other] == [
            (each.state, each.reason, each.depth, each.dart.tolist()) for each in plain
        ]


def test_the_procedure_of_the_document_asks_no_scans() -> None:
    localizer = AtlasLocalizer(example(), DOCUMENT, nowhere)
    assert localizer.start(Meetpoint(3, 1.5, scan=SCAN)).state == SearchState.SEARCHING and nodes(localizer) == [0, 1]
    assert localizer.update(Traversal(0, 30.0, 30.0), Meetpoint(3, 1.5, scan=SCAN)).state == SearchState.LOST


def test_where_nothing_fits_any_more_the_search_begins_anew_and_counts_on() -> None:
    localizer = AtlasLocalizer(twins(), SearchParams(max_detection_errors=0, searches=3), west)
    told = [localizer.start(Meetpoint(1, 0.5, scan=SCAN))]
    wrong = Traversal(0, 30.0, 30.0)  # no edge is so long
    told.append(localizer.update(wrong, Meetpoint(3, 1.3, scan=SCAN)))
    assert told[-1].state != SearchState.LOST and told[-1].depth == 1
    assert told[-1].reason.startswith("search 2 of 3, as nothing matched any more: ")
    assert nodes(localizer) == [1] and localizer.forest.depth == 0
    told.append(localizer.update(Traversal(0, 6.0, 6.0), Meetpoint(1, 0.5, scan=SCAN)))  # goes on with what it is
    assert told[-1].depth == 2 and "search" not in told[-1].reason.split(":")[0] and nodes(localizer) == [0]
    told.append(localizer.update(wrong, Meetpoint(3, 1.3, scan=SCAN)))
    assert told[-1].reason.startswith("search 3 of 3, ") and told[-1].depth == 3
    told.append(localizer.update(Traversal(0, 31.0, 31.0), Meetpoint(1, 0.5, scan=SCAN)))
    assert told[-1].state == SearchState.LOST and told[-1].choice is None and told[-1].depth == 4
    assert localizer.start(Meetpoint(1, 0.5, scan=SCAN)).depth == 0  # all is new
    assert localizer.update(wrong, Meetpoint(3, 1.3, scan=SCAN)).reason.startswith("search 2 of 3, ")


def test_a_robot_that_fits_nowhere_at_once_is_lost_and_without_scans_there_is_one_search() -> None:
    params = SearchParams(max_detection_errors=0, searches=3)
    assert AtlasLocalizer(twins(), params, nowhere).start(Meetpoint(1, 0.5, scan=SCAN)).state == SearchState.LOST
    localizer = AtlasLocalizer(twins(), params, west)
    localizer.start(Meetpoint(1, 0.5))
    assert localizer.update(Traversal(0, 30.0, 30.0), Meetpoint(3, 1.3)).state == SearchState.LOST
    single = AtlasLocalizer(twins(), SearchParams(max_detection_errors=0, searches=1), west)
    single.start(Meetpoint(1, 0.5, scan=SCAN))
    assert single.update(Traversal(0, 30.0, 30.0), Meetpoint(3, 1.3, scan=SCAN)).state == SearchState.LOST


# -- poses that are followed by scans


class OnePlace:
    """A map from which scans are explained at one pose only: where odometry, begun at (x, y), has the robot."""

    def __init__(self, x: float, y: float, elsewhere: float = 0.65, here: float = 0.9) -> None:
        self._start, self._elsewhere, self._here = np.array([x, y]), elsewhere, here
        self.odom_m = np.zeros(2)  # of the robot

    def places(self, scan: Scan, most: int) -> np.ndarray:
        return np.array([[*(self._start + self.odom_m), 0.0], [*(self._start + self.odom_m + 30.0), 0.0]])

    def fitted(
        self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float
    ) -> "tuple[np.ndarray, np.ndarray]":
        off = np.hypot(*(map_from_base[:, :2] - self._start - self.odom_m).T)
        return map_from_base, np.where(off < 0.1, self._here, self._elsewhere)


def wander(localizer: AtlasLocalizer, world: OnePlace, edges: int = 8, places: int = 100) -> "list[Any]":
    """Between places in a row, along edges that no atlas of ours has, until the search is over."""

    def meetpoint() -> Meetpoint:
        behind_left_on = np.array([np.pi, np.pi / 2, 0.0])
        return Meetpoint(3, 2.7, bearings_rad=behind_left_on, scan=SCAN, odom_from_base=np.array([*world.odom_m, 0.0]))

    told = [localizer.start(meetpoint())]
    for number in range(1, edges + 1):
        if told[-1].done:
            break
        world.odom_m = np.array([3.1 * (number % places), 0.0])
        told.append(localizer.update(Traversal(2, 3.1, 3.1), meetpoint()))
    return told


def test_where_the_atlas_has_nothing_like_it_the_scans_of_four_places_say_where_the_robot_is() -> None:
    world = OnePlace(3.0, 4.0)
    localizer = AtlasLocalizer(twins(), SearchParams(), west, world)
    told = wander(localizer, world)
    assert [each.state for each in told[:-1]] == [SearchState.SEARCHING] * 3 and told[-1].state == SearchState.CONFIRMED
    assert told[-1].reason == "one pose explains 90% of the scans of 4 places, the next best 65%"
    assert told[-1].choice is None and len(told[-1].dart) == 0
    np.testing.assert_allclose(localizer.poses(told[-1]), [[3.0 + 3 * 3.1, 4.0, 0.0]])
    localizer.count_visits(localizer.atlas.visits)  # it has none of these edges
    assert localizer.atlas.visits.node_count.sum() == 0


@pytest.mark.parametrize(
    "params, world",
    [
        (SearchParams(follow_places=0), OnePlace(3.0, 4.0)),
        (SearchParams(follow_lead=0.3), OnePlace(3.0, 4.0)),
        (SearchParams(), OnePlace(3.0, 4.0, elsewhere=0.8)),
        (SearchParams(), OnePlace(3.0, 4.0, elsewhere=0.3, here=0.55)),
    ],
    ids=["not asked for", "not enough ahead", "others explain as much", "none explains enough"],
)
def test_who_is_nowhere_ahead_is_lost_at_last(params: SearchParams, world: OnePlace) -> None:
    told = wander(AtlasLocalizer(twins(), params, west, world), world, edges=60, places=6)
    assert told[-1].state == SearchState.LOST and told[-1].depth < 60


def test_searches_count_from_the_last_new_place_while_a_pose_explains_the_scans() -> None:
    world = OnePlace(3.0, 4.0, elsewhere=0.8)  # the other is as good but for 0.1: too little
    once = wander(AtlasLocalizer(twins(), SearchParams(searches=2), west, world), world, edges=40)
    assert once[-1].state == SearchState.SEARCHING  # each meetpoint is a new place
    nothing = OnePlace(3.0, 4.0, elsewhere=0.3, here=0.5)
    given_up = wander(AtlasLocalizer(twins(), SearchParams(searches=2), west, nothing), nothing, edges=40)
    assert given_up[-1].state == SearchState.LOST and given_up[-1].depth < 10


def test_the_procedure_of_the_document_follows_no_poses() -> None:
    world = OnePlace(3.0, 4.0)
    localizer = AtlasLocalizer(twins(), DOCUMENT, west, world)
    assert wander(localizer, world)[-1].state == SearchState.LOST and localizer.standing is None


def followed_in_the_first_row(x: float) -> "list[Any]":
    """As driven_in_the_first_row(), with odometry; scans say that it began at x."""
    world = OnePlace(x, 0.0)
    localizer = AtlasLocalizer(twins(), SearchParams(use_edge_angles=False, follow_places=2), west, world)
    told = [localizer.start(Meetpoint(1, 0.5, scan=SCAN, odom_from_base=np.zeros(3)))]
    for rank, length_m, degree, r_m, east_m in ((0, 6.0, 3, 1.3, 6.0), (2, 8.0, 1, 1.1, 14.0), (0, 8.0, 3, 1.3, 6.0)):
        if told[-1].done:
            break
        world.odom_m = np.array([east_m, 0.0])
        told.append(
            localizer.update(
                Traversal(rank, length_m, length_m),
                Meetpoint(degree, r_m, scan=SCAN, odom_from_base=np.array([east_m, 0.0, 0.0])),
            )
        )
    return told


def test_where_graph_and_scans_agree_the_place_of_the_atlas_is_told_with_the_pose_of_the_scans() -> None:
    told = followed_in_the_first_row(0.0)
    assert [each.state for each in told] == [SearchState.TENTATIVE, SearchState.CONFIRMED]
    assert told[-1].map_from_base is not None
    np.testing.assert_allclose(told[-1].map_from_base, [6.0, 0.0, 0.0], atol=1e-6)
    assert len(told[-1].dart) == 1


def test_where_graph_and_scans_contradict_each_other_the_robot_is_not_told_a_place() -> None:
    world = OnePlace(20.0, 0.0)
    localizer = AtlasLocalizer(twins(), SearchParams(use_edge_angles=False, follow_places=3, searches=1), west, world)
    told = [localizer.start(Meetpoint(1, 0.5, scan=SCAN, odom_from_base=np.zeros(3)))]
    for rank, length_m, degree, r_m, east_m in ((0, 6.0, 3, 1.3, 6.0), (2, 8.0, 1, 1.1, 14.0)):
        world.odom_m = np.array([east_m, 0.0])
        told.append(
            localizer.update(
                Traversal(rank, length_m, length_m),
                Meetpoint(degree, r_m, scan=SCAN, odom_from_base=np.array([east_m, 0.0, 0.0])),
            )
        )
    assert [each.state for each in told[:2]] == [SearchState.TENTATIVE] * 2
    assert (told[-1].state, told[-1].reason) == (SearchState.LOST, "graph and scans contradict each other")
