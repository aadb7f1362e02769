"""Views of meetpoints that differ, in a map worked by hand (made_scans.py)."""

from __future__ import annotations

import made_atlases
import numpy as np
import pytest
from made_scans import MadeScans
from scipy import special

from glass_nav.topology.search import ambiguity, expected_views, vote
from glass_nav.topology.search.expected_views import ExpectedViews
from glass_nav.topology.search.matching import Matcher, Tolerances


def rows(east_looks_different: bool) -> "tuple[Matcher, ExpectedViews]":
    """Two equal rows of three places, 100 m apart; seen from any place of the first row, that at x = 112 is other."""
    xy = [(x + shift, 0.0) for shift in (0.0, 100.0) for x in (0, 6, 12)]
    atlas = made_atlases.corridors(xy, [0.5, 1.3, 0.5] * 2, [(0, 1), (1, 2), (3, 4), (4, 5)])

    def share(poses: np.ndarray) -> np.ndarray:
        return np.where(east_looks_different & (poses[:, 0] > 110.0), 0.5, 1.0)

    scans = MadeScans(share, np.zeros((0, 3)))
    return Matcher(atlas, Tolerances(), use_angles=False), ExpectedViews(atlas, scans)


AT_THE_MIDDLE = np.array([1, 5])  # of both rows, come from the west


@pytest.mark.parametrize("differ", [True, False])
def test_places_that_only_look_different_are_told_apart_by_going_there(differ: bool) -> None:
    matcher, views = rows(differ)
    ends = views.at(np.array([3, 7]))
    np.testing.assert_allclose(ends, [[12.0, 0.0, 2.0 * np.pi], [112.0, 0.0, 2.0 * np.pi]])
    things, of_all = 40.0 / 2.0, 100.0 / 2.0  # half of 80 pieces, two a thing
    by_chance = special.betaln(1.0 + things, 9.0 + of_all - things) - special.betaln(1.0, 9.0 + of_all)
    np.testing.assert_allclose(views.nats(ends[:1], ends[1:]), [(0.5 * 40.0 - by_chance) * differ])
    assert views.alike(np.array([3, 1]), np.array([7, 5])).tolist() == [not differ, True]
    assert ambiguity.prove(matcher, AT_THE_MIDDLE).indistinguishable  # by the graph alone
    proof = ambiguity.prove(matcher, AT_THE_MIDDLE, views=views)
    assert (proof.indistinguishable, proof.ranks) == (not differ, [1] if differ else None)
    voted = vote.expected(matcher, AT_THE_MIDDLE, np.array([0.6, 0.4]), views)
    assert voted.splits == differ and (not differ or voted.rank == 1)


@pytest.mark.parametrize("differ", [True, False])
def test_the_nearest_difference_is_found_by_where_the_robot_would_stand(differ: bool) -> None:
    matcher, views = rows(differ)
    west = np.array([0, 4])  # at the west ends, come from the middle
    pose, other = views.at(west)
    found = vote.towards_difference(matcher, views, int(west[0]), pose, other[None])
    assert (found is not None) == differ
    if found is not None:
        assert found.ranks == [0, 1]  # back, then straight on
        np.testing.assert_allclose(found.base_from_there[:2], [-12.0, 0.0], atol=1e-9)  # it looks west


def test_a_difference_that_is_not_decisive_is_a_goal_where_there_is_no_better_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    matcher, views = rows(True)
    monkeypatch.setattr(vote, "DECISIVE", 1000.0)
    pose, other = views.at(np.array([0, 4]))
    found = vote.towards_difference(matcher, views, 0, pose, other[None])
    assert found is not None and found.ranks == [0, 1]


def test_what_was_seen_once_is_expected_to_tell_nothing_more_until_another_search() -> None:
    _, views = rows(True)
    first, second = views.at(np.array([3])), views.at(np.array([7]))
    assert views.differ(first, second).all()
    views.arrive(np.array([5.0, 0.0, 0.0]))
    here = views.at(np.array([1])) + [6.0, 0.0, 0.0]  # of the robot there, if it is in the first row
    assert views.nats(first, second, here).tolist() == [0.0] and views.nats(first, second, here + 1.0).tolist() != [0.0]
    assert views.alike(np.array([3]), np.array([7])).tolist() == [
        False
    ]  # that is proved of places, not of what was seen
    views.look_again()
    assert views.has_looked_again and views.nats(first, second, here).tolist() != [0.0]
    views.arrive(np.array([5.0, 0.0, 0.0]))
    views.forget()
    assert not views.has_looked_again
    assert views.nats(first, second, here).tolist() != [0.0]


def test_where_a_robot_wanted_to_look_it_has_looked_at_its_next_arrival_wherever_that_is() -> None:
    _, views = rows(True)
    first, second, here = views.at(np.array([3])), views.at(np.array([7])), np.array([[6.0, 0.0, 0.0]])
    views.arrive(np.zeros(3))
    views.aim(np.array([6.0, 0.0, 0.0]))
    assert views.nats(first, second, here)[0] > 0.0  # it is on its way
    views.arrive(np.array([0.0, 3.0, 0.0]))
    assert views.nats(first, second, here + [0.0, 3.0, 0.0])[0] == 0.0
    views.aim(np.array([6.0, 0.0, 0.0]))
    views.forget()
    views.arrive(np.zeros(3))
    assert views.nats(first, second, here)[0] > 0.0


def test_nothing_is_proved_where_there_was_no_time_to_compare_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(expected_views, "_COMPARED", 1)
    matcher, views = rows(False)
    views.arrive(np.zeros(3))
    assert not ambiguity.prove(matcher, AT_THE_MIDDLE, views=views).indistinguishable and views.is_exhausted
    for _ in range(20):  # the next steps go on
        views.arrive(np.zeros(3))
        proved = ambiguity.prove(matcher, AT_THE_MIDDLE, views=views).indistinguishable
    assert proved and not views.is_exhausted
