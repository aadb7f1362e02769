"""Walls seen along an edge against those of a candidate: corridors worked by hand, glass, and edges of a real atlas."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import made_atlases
import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.topology.atlas import atlas_file
from glass_nav.topology.atlas.atlas import Ragged
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search import edge_segments
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.edge_segments import Reach, SegmentTest, contradiction
from glass_nav.topology.search.matching import Matcher, Tolerances
from glass_nav.topology.search.search_params import SearchParams

ATLASES = Path(__file__).resolve().parents[4] / "atlas"
REACH = Reach(shift_m=0.5, turn_rad=0.4, sigmas=4.3, drift_share=0.02)
WAY = np.column_stack([np.linspace(0.0, 6.0, 13), np.zeros(13)])
CORRIDOR = np.array([[0, -1, 6, -1], [6, 1, 0, 1]], float)  # 2 m wide, free space to the left of each wall
PLUGGED = np.vstack([CORRIDOR, [[3, -0.4, 3, 1], [3, -0.4, 5, -0.4]]])  # a cabinet stands in it


def test_walls_that_are_where_they_should_be_contradict_nothing():
    assert contradiction(CORRIDOR, CORRIDOR, WAY, REACH) == (0.0, 0.0)
    assert contradiction(CORRIDOR[:1], CORRIDOR, WAY, REACH) == (0.0, 0.0)  # one side was not seen


@pytest.mark.parametrize("pose", [(0.3, 0.2, 0.1), (-0.3, 0.1, -0.2), (0.0, -0.4, 0.3)])
def test_a_beginning_that_is_not_known_exactly_is_no_contradiction(pose):
    room = np.vstack([CORRIDOR, [[6, -1, 6, 1]]])
    seen = se2.transform_points(np.array(pose), room.reshape(-1, 2)).reshape(-1, 4)
    share, metres = contradiction(seen, room, WAY, REACH)
    assert share < 0.1 and metres < 1.0


def test_walls_in_free_space_contradict_by_their_share():
    """1.4 m and 2 m stand in the corridor, 12 m are where they should be; half a metre of doubt."""
    share, metres = contradiction(PLUGGED, CORRIDOR, WAY, Reach(1e-6, 1e-6, 4.3, 0.02))
    near = 4.3 * 0.06  # the end of the cabinet that touches the wall is on it
    assert metres == pytest.approx(3.4, abs=0.3)
    assert share == pytest.approx(metres / (12.5 + metres), abs=0.01)
    assert 0.0 < near < 0.3


def test_what_is_seen_behind_the_walls_of_the_atlas_is_no_contradiction():
    """Through a pane: it is not seen, the room behind it is."""
    through = np.array([[0, -1, 6, -1], [6, 4, 0, 4], [0, 1.5, 0, 4], [6, 4, 6, 1.5]], float)
    assert contradiction(through, CORRIDOR, WAY, REACH)[1] == 0.0
    # A robot in the wide room would contradict the corridor's candidate the other way round.
    share, metres = contradiction(CORRIDOR, through, WAY, Reach(0.2, 0.2, 4.3, 0.02))
    assert metres > 4.0 and share > 0.3


def test_where_the_atlas_has_no_wall_at_all_nothing_is_contradicted():
    far = np.array([[0, -3.0, 0.5, -3.0]])
    assert contradiction(np.array([[3, 2, 6, 2.0]]), far, WAY, REACH) == (0.0, 0.0)


@pytest.mark.parametrize(
    "seen, atlas",
    [
        (np.zeros((0, 4)), CORRIDOR),
        (CORRIDOR, np.zeros((0, 4))),
        (np.ones((2, 4)), CORRIDOR),
        (CORRIDOR, np.ones((2, 4))),
    ],
    ids=["nothing seen", "nothing known", "points seen", "points known"],
)
def test_without_walls_there_is_no_contradiction(seen, atlas):
    assert contradiction(seen, atlas, WAY, REACH) == (0.0, 0.0)


def test_many_walls_are_compared_in_larger_pieces():
    many = np.repeat(PLUGGED, 40, axis=0)
    share, _ = contradiction(many, CORRIDOR, WAY, Reach(1e-6, 1e-6, 4.3, 0.02))
    once, _ = contradiction(PLUGGED, CORRIDOR, WAY, Reach(1e-6, 1e-6, 4.3, 0.02))
    assert share == pytest.approx(once, abs=0.06)


def test_little_in_the_way_is_furniture_whatever_its_share():
    test = SegmentTest(segments_max_contradiction=0.4)
    assert edge_segments.matches(0.9, 0.9, test) and edge_segments.matches(0.4, 5.0, test)
    assert not edge_segments.matches(0.41, 1.0, test)


@pytest.mark.parametrize("value", [0.0, 1.1, float("nan")])
def test_a_limit_that_means_nothing_is_refused(value):
    with pytest.raises(ValueError) as refused:
        SegmentTest(segments_max_contradiction=value)
    assert str(refused.value) == f"~segments_max_contradiction must be in (0, 1], got {value}"


# -- as a test of candidates


def two_alike():
    """Two corridors of one length that only their walls tell apart: one has niches on both sides."""
    atlas = made_atlases.corridors([(0, 0), (6, 0), (20, 5), (20, 11)], [1.0] * 4, [(0, 1), (2, 3)])
    niches = np.array([[0, -4, 6, -4], [6, 4, 0, 4], [0, -4, 0, -1], [6, -1, 6, -4], [6, 1, 6, 4], [0, 4, 0, 1]], float)
    rows = []
    for dart, walls in zip(range(4), (CORRIDOR, CORRIDOR, niches, niches)):
        if dart % 2:  # seen from the other end
            walls = se2.transform_points(np.array([6.0, 0.0, np.pi]), walls.reshape(-1, 2)).reshape(-1, 4)
        place = atlas.map_from_dart(np.array(dart))
        rows.append(se2.transform_points(place, walls.reshape(-1, 2)).reshape(-1, 4))
    return replace(atlas, darts=replace(atlas.darts, segments_m=Ragged.of(rows, 4)))


def test_walls_rule_out_candidates_that_numbers_do_not():
    atlas, darts = two_alike(), np.arange(4)
    plain, walls = Matcher(atlas, Tolerances(), True), Matcher(atlas, Tolerances(), True, SegmentTest())
    corridor, unseen = Traversal(0, 6.0, 6.0, segments_m=CORRIDOR), Traversal(0, 6.0, 6.0)
    assert plain.edges_along(darts, corridor).tolist() == [0, 1, 2, 3]
    assert walls.edges_along(darts, corridor).tolist() == [0, 1]
    assert walls.edges_along(darts, unseen).tolist() == [0, 1, 2, 3]  # a driver that reports no walls
    assert walls.edges_along(darts, corridor).tolist() == [0, 1]  # asked again
    switched_off = Matcher(atlas, Tolerances(), True, SegmentTest(match_segments=False))
    assert switched_off.edges_along(darts, corridor).tolist() == [0, 1, 2, 3]


def test_of_many_candidates_walls_are_not_asked_and_of_many_reports_few_are_remembered(monkeypatch):
    atlas, corridor = two_alike(), Traversal(0, 6.0, 6.0, segments_m=CORRIDOR)
    matcher = Matcher(atlas, Tolerances(), True, SegmentTest())
    assert len(matcher.edges_along(np.tile(np.arange(4), 26), corridor)) == 104
    monkeypatch.setattr("glass_nav.topology.search.matching._REMEMBERED", 2)
    for _ in range(5):
        again = replace(corridor)
        assert matcher.edges_along(np.arange(4), again).tolist() == [0, 1]
    assert len(matcher._compared) <= 2


@pytest.mark.parametrize(
    "params, left",
    [
        (SearchParams(), {0, 1}),
        (SearchParams(segments=SegmentTest(match_segments=False)), {0, 1, 2, 3}),
        (SearchParams(vote_mode="seed"), {0, 1, 2, 3}),
    ],
    ids=["walls", "switched off", "the document"],
)
def test_a_search_goes_by_walls_too(params, left):
    localizer = AtlasLocalizer(two_alike(), params)
    assert set(localizer.start(Meetpoint(1, 1.0)).dart) == {0, 1, 2, 3}
    estimate = localizer.update(Traversal(0, 6.0, 6.0, segments_m=CORRIDOR), Meetpoint(1, 1.0))
    assert {int(dart) ^ 1 for dart in estimate.dart} == left


@pytest.mark.long_run
@pytest.mark.parametrize("name", ["glass_office", "changed_rooms"])
def test_the_own_walls_of_an_edge_never_rule_it_out(name):
    """All edges of real atlases, both ways, seen from beginnings that are off by what the tolerances allow."""
    atlas = atlas_file.load(ATLASES / name / "atlas.json")
    matcher, rng = Matcher(atlas, Tolerances(), True), np.random.default_rng(0)
    others = 0
    for dart in rng.permutation(len(atlas.darts))[:60].tolist():
        rows = atlas.darts.segments_m[dart]
        off = np.append(rng.normal(0.0, 0.1, 2), rng.normal(0.0, 0.07))
        start = se2.compose(off, se2.inverse(atlas.map_from_dart(np.array(dart))))
        seen = Traversal(0, 5.0, 5.0, segments_m=se2.transform_points(start, rows.reshape(-1, 2)).reshape(-1, 4))
        assert edge_segments.matches(*matcher.contradiction(dart, seen), SegmentTest())
        others += not edge_segments.matches(
            *matcher.contradiction(int(rng.integers(len(atlas.darts))), seen),
            SegmentTest(segments_max_contradiction=0.4),
        )
    assert others > 10
