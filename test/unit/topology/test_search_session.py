"""A session of searches: what follows from each event, in which order."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import Any, List, Optional, Tuple

import made_scans
import numpy as np
import pytest
from made_scans import MadeScans

from glass_nav.geometry import se2
from glass_nav.log_line import LogLine
from glass_nav.sensing.scan import Scan
from glass_nav.topology import search_session
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas, AtlasError
from glass_nav.topology.atlas_source import ReadAtlas
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.search_decisions import (
    AtlasRequest,
    Decision,
    GoalEnd,
    GoalOutcome,
    InitialPose,
    Progress,
    SearchStatus,
    Turn,
)
from glass_nav.topology.search_session import Goal, SearchSession
from glass_nav.topology.session_params import SessionParams
from glass_nav.vocabulary import SearchState
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

MAPS = Path(__file__).parents[3] / "maps"
DOCUMENT = SearchParams(vote_mode="seed", confirm_edges=0)  # its worked example ends after two edges
S = 1_000_000_000
T_0 = 100 * S
BEARINGS_RAD = np.array([np.pi, 1.0, -1.0])


def example() -> Tuple[str, Atlas]:
    path = shipped_atlases.find("document_example")
    return str(path), atlas_file.load(path)


def glass_office() -> Tuple[str, Atlas]:
    path = shipped_atlases.find("glass_office")
    return str(path), atlas_file.load(path)


def served(name: str) -> GridMap:
    return map_file.load(MAPS / name / "map.yaml")


def made(read_atlas: ReadAtlas = example, **fields: Any) -> SearchSession:
    return SearchSession(read_atlas, SessionParams(**fields), DOCUMENT)


def started(read_atlas: ReadAtlas = example, **fields: Any) -> SearchSession:
    session = made(read_atlas, **fields)
    session.start()
    return session


def meetpoint(stamp_ns: int = T_0, scan: Optional[Scan] = None) -> Meetpoint:
    return Meetpoint(3, 1.5, stamp_ns=stamp_ns, scan=scan)


def drive(session: SearchSession, traversal: Traversal, stamp_ns: int) -> List[Decision]:
    """An edge and the meetpoint at its end."""
    assert session.edge_traversal(traversal, stamp_ns) == []
    return session.meetpoint(meetpoint(stamp_ns))


def drive_until_confirmed(session: SearchSession) -> List[Decision]:
    """The worked example of the document; what follows from its last meetpoint."""
    session.meetpoint(meetpoint())
    drive(session, Traversal(0, 8.0, 8.0), T_0 + S)
    return drive(session, Traversal(2, 11.2, 8.0), T_0 + 2 * S)


def kinds(decisions: List[Decision]) -> List[type]:
    return [type(decision) for decision in decisions]


def only(decisions: List[Decision], kind: type) -> Any:
    (found,) = [decision for decision in decisions if isinstance(decision, kind)]
    return found


def states(decisions: List[Decision]) -> List[SearchState]:
    return [decision.state for decision in decisions if isinstance(decision, SearchStatus)]


def texts(decisions: List[Decision]) -> List[str]:
    return [decision.text for decision in decisions if isinstance(decision, LogLine)]


# -- the start


def test_the_first_meetpoint_begins_a_search() -> None:
    session = made()
    assert session.status.state == SearchState.NO_ATLAS
    line, status, said = session.start()
    assert said.text == "WAITING: the search starts at the next meetpoint: the node has started"
    assert isinstance(line, LogLine) and line.text.endswith("atlas.json: 4 nodes, 4 edges")
    assert (status, session.status.state) == (session.status, SearchState.WAITING)
    assert session.status.reason == "the search starts at the next meetpoint: the node has started"
    decisions = session.meetpoint(meetpoint())
    assert kinds(decisions) == [SearchStatus, LogLine, Turn]
    status = session.status
    assert (status.state, status.stamp_ns, len(status.poses), status.map_from_base) == (
        SearchState.SEARCHING,
        T_0,
        6,
        None,
    )
    assert only(decisions, Turn) == Turn(session.choice, T_0)
    assert texts(decisions) == [
        f"meetpoint with 3 edges, 1.50 m from the walls: SEARCHING, {status.reason}; next turn RIGHT"
    ]


def test_a_session_can_wait_until_it_is_asked() -> None:
    session = made(search_at_start=False)
    assert states(session.start()) == [SearchState.IDLE]
    assert session.status.reason == "no search was requested"
    (line,) = session.meetpoint(meetpoint())
    assert line == LogLine("meetpoint not used: the search is IDLE", often=True)
    assert session.choice is None


def test_an_atlas_that_cannot_be_read_is_said_at_the_start() -> None:
    def broken() -> Tuple[str, Atlas]:
        raise AtlasError("broken.json: no atlas")

    with pytest.raises(AtlasError, match="broken.json: no atlas"):
        made(broken).start()


def test_candidates_are_counted_as_the_reason_counts_them() -> None:
    session = started()
    session.meetpoint(meetpoint())
    estimate = session.status.estimate
    assert estimate is not None and len(estimate.dart) == 6  # the document has a candidate for each node at first
    assert (session.status.reason, estimate.candidates) == ("2 candidates", 2)
    drive(session, Traversal(0, 8.0, 8.0), T_0 + S)
    estimate = session.status.estimate
    assert estimate is not None and session.status.reason == f"{estimate.candidates} candidates"
    assert estimate.candidates == len(estimate.dart)


def test_a_confirmed_meetpoint_gives_the_relation_of_frames() -> None:
    session = started()
    drive_until_confirmed(session)
    assert session.status.map_from_base is not None and session.status.relation is None  # without dead reckoning
    session = started()
    session.meetpoint(meetpoint())
    drive(session, Traversal(0, 8.0, 8.0), T_0 + S)
    assert session.status.relation is None
    odometry = np.array([3.0, -1.0, 2.0])
    session.edge_traversal(Traversal(2, 11.2, 8.0), T_0 + 2 * S)
    session.meetpoint(replace(meetpoint(T_0 + 2 * S), odom_from_base=odometry))
    relation, pose = session.status.relation, session.status.map_from_base
    assert relation is not None and pose is not None and relation.node == 0
    np.testing.assert_allclose(se2.compose(relation.map_from_environment, odometry), pose, atol=1e-9)


# -- pairs of reports


def test_reports_of_an_edge_come_in_either_order() -> None:
    session = started()
    session.meetpoint(meetpoint())
    assert session.meetpoint(meetpoint(T_0 + S)) == []
    decisions = session.edge_traversal(Traversal(0, 8.0, 8.0), T_0 + S)
    assert (session.status.estimate.depth, session.status.stamp_ns) == (1, T_0 + S)
    assert only(decisions, Turn).stamp_ns == T_0 + S
    drive(session, Traversal(2, 11.2, 8.0), T_0 + 2 * S)
    assert session.status.estimate.depth == 2


@pytest.mark.parametrize(
    "meetpoint_s, traversal_s, dropped",
    [pytest.param(60, 0, "traversal", id="old traversal"), pytest.param(1, 61, "meetpoint", id="old meetpoint")],
)
def test_of_two_reports_too_far_apart_the_older_is_dropped(meetpoint_s: int, traversal_s: int, dropped: str) -> None:
    session = started()
    session.meetpoint(meetpoint())
    assert session.meetpoint(meetpoint(T_0 + meetpoint_s * S)) == []
    (line,) = session.edge_traversal(Traversal(0, 8.0, 8.0), T_0 + traversal_s * S)
    assert line == LogLine(
        f"a {dropped} is dropped: the edge_traversal and the meetpoint at its end are stamped 60.000 s apart, allowed "
        "~pairing_tolerance_s 2 s",
        logging.WARNING,
        often=True,
    )
    if dropped == "traversal":
        session.edge_traversal(Traversal(0, 8.0, 8.0), T_0 + meetpoint_s * S)
    else:
        session.meetpoint(meetpoint(T_0 + traversal_s * S))
    assert session.status.estimate.depth == 1  # the other one waited


@pytest.mark.parametrize("meetpoint_ns, traversal_ns", [(0, T_0), (T_0 + S, 0), (0, 0), (T_0 + S, T_0 + 3 * S)])
def test_reports_without_a_stamp_or_within_the_tolerance_belong_together(meetpoint_ns: int, traversal_ns: int) -> None:
    session = started()
    session.meetpoint(meetpoint())
    session.meetpoint(meetpoint(meetpoint_ns))
    session.edge_traversal(Traversal(0, 8.0, 8.0), traversal_ns)
    assert session.status.estimate.depth == 1


def test_a_turn_that_no_dart_has_is_refused_and_its_meetpoint_waits_for_another() -> None:
    session = started()
    session.meetpoint(meetpoint())
    session.meetpoint(meetpoint(T_0 + S))
    (line,) = session.edge_traversal(Traversal(3, 8.0, 8.0), T_0 + S)
    assert line.text == "edge_traversal refused: turn of rank 3: the meetpoint it left has degree 3, allowed 0 to 2"
    assert (line.level, line.often, session.status.estimate.depth) == (logging.WARNING, True, 0)
    session.edge_traversal(Traversal(0, 8.0, 8.0), T_0 + S)
    assert session.status.estimate.depth == 1


def test_an_edge_before_the_first_meetpoint_is_not_used() -> None:
    session = started()
    assert texts(session.edge_traversal(Traversal(0, 8.0, 8.0), T_0)) == [
        "edge_traversal not used: the search is WAITING"
    ]
    session.meetpoint(meetpoint())
    assert session.meetpoint(meetpoint(T_0 + S)) == []  # nor kept for later


# -- how a search ends


def test_a_confirmed_place_is_handed_over_and_counted() -> None:
    session = started()
    decisions = drive_until_confirmed(session)
    assert kinds(decisions) == [SearchStatus, LogLine, InitialPose]
    status, pose = session.status, only(decisions, InitialPose)
    assert (status.state, session.choice) == (SearchState.CONFIRMED, None)
    np.testing.assert_array_equal(pose.map_from_base, status.map_from_base)
    assert pose.stamp_ns == status.stamp_ns == T_0 + 2 * S
    assert session.localizer.atlas.visits.node_count.tolist() == [2, 1, 0, 0]
    assert texts(session.meetpoint(meetpoint())) == ["meetpoint not used: the search is CONFIRMED"]


def test_an_initial_pose_can_be_kept_back() -> None:
    assert kinds(drive_until_confirmed(started(publish_initial_pose=False))) == [SearchStatus, LogLine]


def test_a_meetpoint_that_is_reported_again_is_not_taken_for_the_end_of_the_next_edge() -> None:
    session = started()
    session.meetpoint(meetpoint(T_0))
    depth = session.status.estimate.depth
    assert session.meetpoint(meetpoint(T_0)) == []  # the driver has not heard yet that the search has begun
    decisions = [
        *session.edge_traversal(Traversal(0, 8.0, 8.0), T_0 + 10 * S),
        *session.meetpoint(meetpoint(T_0 + 10 * S)),
    ]
    assert not any(isinstance(each, LogLine) and each.level == logging.WARNING for each in decisions)
    assert session.status.estimate.depth == depth + 1


def test_the_statistics_of_the_atlas_are_saved(tmp_path: Path) -> None:
    path = tmp_path / "visits.json"
    drive_until_confirmed(started(visits_file=str(path)))
    assert atlas_file.load(path).visits.node_count.tolist() == [2, 1, 0, 0]


def test_nodes_passed_on_the_way_to_a_goal_go_into_the_statistics(tmp_path: Path) -> None:
    path = tmp_path / "visits.json"
    session = started(visits_file=str(path))
    assert session.node_visits(np.array([2, 0, 2]), np.array([1.4, np.nan, 1.6])) == []
    visits = atlas_file.load(path).visits
    assert visits.node_count[2] == 2 and visits.node_r_mean_m[2] == pytest.approx(1.5)
    assert visits.node_missed[0] == 1 and visits.node_missed[2] == 0
    assert session.node_visits(np.zeros(0, np.int64), np.zeros(0)) == []
    assert texts(session.node_visits(np.array([99]), np.ones(1))) == [
        "node_visits refused: nodes must be 0 to 3, got [99]"
    ]
    assert made().node_visits(np.array([0]), np.ones(1)) == []  # it has no atlas yet


def test_the_statistics_that_were_saved_are_used_again(tmp_path: Path) -> None:
    path = tmp_path / "visits.json"
    for count in (1, 2, 3):
        session = started(visits_file=str(path))
        drive_until_confirmed(session)
        assert session.localizer.atlas.visits.node_count.tolist() == [2 * count, count, 0, 0]


@pytest.mark.parametrize(
    "content, message",
    [
        ("{", "is not JSON: "),
        ("", "is not JSON: "),
        (
            None,
            "has visits of another atlas: 24 nodes and 30 edges, got an atlas of 4 and 4; delete it, or name another",
        ),
    ],
)
def test_a_bad_file_of_statistics_is_refused_in_one_line(content: Optional[str], message: str, tmp_path: Path) -> None:
    path = tmp_path / "visits.json"
    if content is None:
        atlas_file.save(atlas_file.load(shipped_atlases.find("glass_atrium")), path)
    else:
        path.write_text(content)
    with pytest.raises(AtlasError) as refused:
        started(visits_file=str(path))
    assert str(path) in str(refused.value) and "\n" not in str(refused.value)
    assert message.split(":")[0] in str(refused.value)


def test_a_file_that_cannot_be_written_is_said_and_nothing_else_changes(tmp_path: Path) -> None:
    path = tmp_path / "nowhere" / "visits.json"
    decisions = drive_until_confirmed(started(visits_file=str(path)))
    assert kinds(decisions) == [SearchStatus, LogLine, LogLine, InitialPose]
    line = decisions[2]
    assert isinstance(line, LogLine) and line.level == logging.ERROR
    assert line.text == f"the atlas with its statistics is not saved: {path}: No such file or directory"


def test_no_more_candidates_are_listed_than_allowed() -> None:
    session = started(listed_candidates=2)
    session.meetpoint(meetpoint())
    assert (len(session.status.estimate.dart), len(session.status.poses)) == (6, 2)


# -- goals


def test_a_goal_hears_of_progress_and_succeeds_when_the_place_is_confirmed() -> None:
    session = started(search_at_start=False)
    assert states(session.goal(Goal())) == [SearchState.WAITING]
    assert session.status.reason == "the search starts at the next meetpoint: requested by the action"
    decisions = session.meetpoint(meetpoint())
    assert kinds(decisions) == [SearchStatus, LogLine, Progress, Turn]
    assert only(decisions, Progress).status is session.status
    drive(session, Traversal(0, 8.0, 8.0), T_0 + S)
    decisions = drive(session, Traversal(2, 11.2, 8.0), T_0 + 2 * S)
    assert kinds(decisions) == [SearchStatus, LogLine, InitialPose, GoalEnd]
    assert only(decisions, GoalEnd) == GoalEnd(GoalOutcome.SUCCEEDED, session.status.reason, session.status)
    assert session.preempt() == []  # it is over


def test_a_goal_is_aborted_when_the_robot_is_lost() -> None:
    session = started()
    session.goal(Goal())
    decisions = session.meetpoint(Meetpoint(4, 3.0, stamp_ns=T_0))
    assert kinds(decisions) == [SearchStatus, LogLine, GoalEnd]
    end = only(decisions, GoalEnd)
    assert (end.outcome, end.reason, end.status.state) == (
        GoalOutcome.ABORTED,
        "no node of the atlas matches what was seen",
        SearchState.LOST,
    )
    assert end.status.map_from_base is None


def test_a_goal_gives_up_after_so_many_edges_and_nobody_is_to_drive_on() -> None:
    session = started()
    session.goal(Goal(max_edges=1))
    assert Turn in kinds(session.meetpoint(meetpoint()))
    decisions = drive(session, Traversal(0, 8.0, 8.0), T_0 + S)
    assert kinds(decisions) == [SearchStatus, LogLine, Progress, GoalEnd, SearchStatus]
    assert states(decisions) == [SearchState.SEARCHING, SearchState.IDLE]
    end = only(decisions, GoalEnd)
    assert (end.outcome, end.reason) == (GoalOutcome.ABORTED, f"not found after 1 edges: {end.status.reason}")
    assert end.status.estimate.choice is None
    assert (session.status.reason, session.status.stamp_ns) == ("gave up after 1 edges", T_0 + S)


def test_the_last_edge_that_a_goal_allows_may_confirm_the_place() -> None:
    session = started()
    session.goal(Goal(max_edges=2))
    assert only(drive_until_confirmed(session), GoalEnd).outcome == GoalOutcome.SUCCEEDED


def test_a_goal_may_begin_at_the_last_meetpoint() -> None:
    session = started(search_at_start=False)
    (end,) = session.goal(Goal(here=True))
    assert (end.outcome, end.reason) == (
        GoalOutcome.ABORTED,
        "no meetpoint has been reported yet at which a search could begin",
    )
    session.meetpoint(meetpoint())  # not used, but known
    decisions = session.goal(Goal(here=True))
    assert kinds(decisions) == [SearchStatus, SearchStatus, LogLine, Progress, Turn]
    assert states(decisions) == [SearchState.WAITING, SearchState.SEARCHING]


def test_a_preempted_search_is_over() -> None:
    session = started()
    assert session.preempt() == []  # nobody waits
    session.goal(Goal())
    session.meetpoint(meetpoint())
    status, end = session.preempt()
    assert status == session.status and session.status.state == SearchState.IDLE
    assert end == GoalEnd(GoalOutcome.PREEMPTED, "the search was preempted", session.status)
    assert texts(session.meetpoint(meetpoint())) == ["meetpoint not used: the search is IDLE"]


# -- a new beginning


def test_a_search_that_is_forgotten_begins_anew_with_the_next_meetpoint() -> None:
    session = started()
    for begin, why in (
        (session.restart, "restarted by service"),
        (session.reload_atlas, "the atlas was reloaded"),
        (lambda: session.time_jumped_back("time jumped back by 3.250 s"), "time jumped back by 3.250 s"),
    ):
        session.meetpoint(meetpoint())
        session.meetpoint(meetpoint(T_0 + S))  # waits for its edge, in vain
        assert states(begin()) == [SearchState.WAITING]
        assert session.status.reason == f"the search starts at the next meetpoint: {why}"
        assert session.edge_traversal(Traversal(0, 8.0, 8.0), T_0 + S) != []


def test_an_atlas_that_cannot_be_used_leaves_the_old_one() -> None:
    found = [example]
    session = started(lambda: found[0]())
    before = session.localizer

    def broken() -> Tuple[str, Atlas]:
        raise AtlasError("broken.json: no atlas")

    found[0] = broken
    session.meetpoint(meetpoint())
    with pytest.raises(AtlasError, match="broken.json: no atlas"):
        session.reload_atlas()
    assert session.localizer is before and session.status.state == SearchState.SEARCHING


# -- maps


def test_an_atlas_of_another_map_is_refused_until_its_map_comes() -> None:
    session = started(glass_office, judge_by_scans=False)
    session.goal(Goal())
    decisions = session.map_served(served("glass_atrium"), "that of topic /map")
    assert kinds(decisions) == [LogLine, SearchStatus, GoalEnd]
    (line,) = texts(decisions)
    assert line.startswith("atlas refused: was made from another map than that of topic /map: ")
    assert session.status.state == SearchState.NO_ATLAS and session.localizer is None
    assert session.status.reason.startswith("the atlas was made from another map than that of topic /map: ")
    assert only(decisions, GoalEnd).reason == session.status.reason

    assert session.time_jumped_back("time jumped back by 9.000 s") == []
    assert texts(session.meetpoint(meetpoint())) == ["meetpoint not used: the search is NO_ATLAS"]
    with pytest.raises(ValueError, match="the atlas was made from another map"):
        session.restart()
    with pytest.raises(AtlasError, match=r"glass_office/atlas\.\w+: was made from another map than that of topic"):
        session.reload_atlas()
    assert only(session.goal(Goal()), GoalEnd).outcome == GoalOutcome.ABORTED
    assert states(session.map_served(served("glass_atrium"), "that of topic /map")) == [SearchState.NO_ATLAS]

    decisions = session.map_served(served("glass_office"), "that of topic /map")
    assert kinds(decisions) == [LogLine, SearchStatus]
    assert session.status.reason == "the search starts at the next meetpoint: there is another map"
    assert session.map_served(served("glass_office"), "that of topic /map") == []
    assert states(session.reload_atlas()) == [SearchState.WAITING]


def test_an_atlas_of_a_map_that_differs_in_few_cells_is_used_with_a_warning() -> None:
    session = started(glass_office, judge_by_scans=False)
    grid_map = served("glass_office")
    row, column = np.argwhere(grid_map.free)[0]
    occupancy = grid_map.occupancy.copy()
    occupancy[row, column] = 100
    (line,) = session.map_served(replace(grid_map, occupancy=occupancy), "that of topic /map")
    differs = f"differs from that of topic /map in 1 of {grid_map.free.sum()} free cells"
    warning = f"was made from glass_office, which {differs}"
    assert line == LogLine(f"the atlas {warning}", logging.WARNING)
    assert session.status.state == SearchState.WAITING
    loaded = session.reload_atlas()[0]
    assert loaded.level == logging.WARNING and loaded.text.endswith(f"; it {warning}")


@pytest.mark.parametrize("is_to_end", [False, True])
def test_a_node_that_is_told_to_ends_where_its_atlas_is_refused(is_to_end: bool) -> None:
    session = started(glass_office, end_without_atlas=is_to_end, judge_by_scans=False)
    assert not session.is_to_end
    session.map_served(served("glass_atrium"), "that of topic /map")
    assert session.is_to_end == is_to_end


def test_a_map_need_not_be_that_of_the_atlas_where_nobody_checks() -> None:
    session = started(glass_office, check_map=False, judge_by_scans=False)
    assert session.map_served(served("glass_atrium"), "that of topic /map") == []
    assert session.status.state == SearchState.WAITING and not session.uses_scans


class _Map(MadeScans):
    """A served map that explains all scans of a robot that began at (50, 0), half of those of others."""

    has_map = False

    def __init__(self) -> None:
        super().__init__(
            lambda poses: np.where(np.abs(poses[:, 0] - 50.0) < 20.0, 0.95, 0.5), np.array([[50.0, 0.0, 0.0]])
        )

    def take(self, grid_map: GridMap) -> None:
        self.has_map = True


def looking(monkeypatch: pytest.MonkeyPatch) -> SearchSession:
    """A session whose map was served."""
    monkeypatch.setattr(search_session, "ServedExplanation", _Map)
    session = SearchSession(example, SessionParams(check_map=False), SearchParams())
    session.start()
    session.map_served(served("glass_atrium"), "that of topic /map")
    return session


def seen(session: SearchSession, x: float, stamp_ns: int) -> List[Decision]:
    return session.scan(made_scans.scan(stamp_ns), np.array([x, 0.0, 0.0]))


def test_scans_find_the_place_once_there_is_a_map_and_before_the_first_meetpoint(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    session = looking(monkeypatch)
    assert session.uses_scans and session.is_looking
    told = [each for k in range(3) for each in seen(session, 0.0, T_0 + k)]
    assert states(told) == [SearchState.WAITING] and session.status.belief is not None
    np.testing.assert_allclose(session.status.belief.poses, [[50.0, 0.0, 0.0]])
    end = [each for k in range(3) for each in seen(session, 5.0 + k, T_0 + 10 + k)]
    assert kinds(end) == [SearchStatus, LogLine, InitialPose]
    assert (session.status.state, session.status.stamp_ns) == (SearchState.CONFIRMED, T_0 + 10)
    assert session.status.estimate is not None and session.status.estimate.depth == 0
    np.testing.assert_allclose(only(end, InitialPose).map_from_base, [55.0, 0.0, 0.0])
    assert not session.is_looking and seen(session, 9.0, T_0 + 20) == []
    session.restart()
    assert session.status.belief is None and session.is_looking


def test_a_robot_of_another_building_may_be_lost_before_the_first_meetpoint(monkeypatch: pytest.MonkeyPatch) -> None:
    session = looking(monkeypatch)
    session._explanation.share = lambda poses: np.full(len(poses), 0.2)  # type: ignore[attr-defined]
    told = [each for k in range(40) for each in seen(session, 0.5 * k, T_0 + k)]
    assert states(told)[-1] == SearchState.LOST and session.choice is None and len(session.status.poses) == 0
    session.restart()
    assert session.is_looking


def test_a_goal_may_succeed_on_the_way_to_a_meetpoint(monkeypatch: pytest.MonkeyPatch) -> None:
    session = looking(monkeypatch)
    session.goal(Goal())
    told = [each for k in range(6) for each in seen(session, max(0.0, 2.0 * (k - 2)), T_0 + k)]
    assert only(told, GoalEnd).outcome == GoalOutcome.SUCCEEDED


def test_without_a_map_or_if_they_are_not_asked_for_scans_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not started(check_map=False).is_looking  # the procedure of the document
    monkeypatch.setattr(search_session, "ServedExplanation", _Map)
    for session in (
        SearchSession(example, SessionParams(check_map=False, judge_by_scans=False), SearchParams()),
        SearchSession(example, SessionParams(check_map=False), SearchParams(use_scans=False)),
        SearchSession(example, SessionParams(check_map=False, search_at_start=False), SearchParams()),
    ):
        session.start()
        session.map_served(served("glass_atrium"), "that of topic /map")
        assert not session.is_looking and seen(session, 0.0, T_0) == []


# -- no atlas


def without_atlas(**fields: Any) -> SearchSession:
    return SearchSession(None, SessionParams(**fields), SearchParams())


def test_without_an_atlas_one_is_made_of_the_map_and_the_search_begins() -> None:
    session = without_atlas(end_without_atlas=True)
    assert states(session.start()) == [SearchState.NO_ATLAS] and not session.is_to_end
    with pytest.raises(AtlasError, match="no atlas has been built yet"):
        session.reload_atlas()
    office, atlas = served("glass_office"), glass_office()[1]
    decisions = session.map_served(office, "that of topic /map")
    assert only(decisions, AtlasRequest).grid_map is office
    assert session.status.reason == "an atlas of that of topic /map is being made"
    assert session.atlas_made(served("glass_atrium"), atlas) == []  # of a map before
    decisions = session.atlas_made(office, atlas)
    assert states(decisions) == [SearchState.WAITING] and session.localizer is not None
    assert texts(decisions)[0].startswith("the atlas built from that of topic /map: ")
    assert session.map_served(office, "that of topic /map") == []  # it is served again
    assert states(session.reload_atlas()) == [SearchState.WAITING]
    decisions = session.map_served(served("glass_atrium"), "that of topic /map")
    assert len(decisions) == 3 and session.status.state == SearchState.NO_ATLAS


def test_a_map_that_no_atlas_can_be_made_of_is_said_and_a_search_may_wait_to_be_asked_for() -> None:
    session, office = without_atlas(search_at_start=False), served("glass_office")
    session.map_served(office, "that of topic /map")
    decisions = session.atlas_made(office, AtlasError("no path of 1 m in this map"))
    assert texts(decisions) == ["no atlas can be built from that of topic /map: no path of 1 m in this map"]
    assert session.status.state == SearchState.NO_ATLAS
    assert states(session.atlas_made(office, glass_office()[1])) == [SearchState.IDLE]
