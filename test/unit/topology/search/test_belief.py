from __future__ import annotations

import numpy as np
import pytest

from glass_nav.topology.search import belief
from glass_nav.topology.search.belief import Belief


def test_shares_are_of_places_and_elsewhere_is_one_of_them() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.3, 0.0, 0.1]])
    first, share, elsewhere = belief.places(poses, np.log([4.0, 2.0, 3.0]), np.zeros(3), np.zeros(3))
    assert first.tolist() == [0, 1]  # the third is the place of the first
    np.testing.assert_allclose(share, [0.7, 0.2])
    assert elsewhere == pytest.approx(0.1)


def test_meetpoints_decide_between_places_only_so_far_and_tell_in_full_whether_it_is_one_of_them() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    _, share, elsewhere = belief.places(poses, np.array([2.0, 2.0]), np.array([3.0, -90.0]), np.zeros(2))
    assert share[0] / share[1] == pytest.approx(np.exp(2.0)) and elsewhere == pytest.approx(1.0 / (1.0 + np.exp(5.0)))
    first, share, elsewhere = belief.places(poses, np.array([2.0, 9.0]), np.array([3.0, -90.0]), np.zeros(2))
    assert first.tolist() == [1, 0] and share[0] / share[1] == pytest.approx(np.exp(7.0 - 2.0))
    assert elsewhere == pytest.approx(1.0 / (1.0 + np.exp(5.0)))
    _, share, elsewhere = belief.places(poses, np.array([2.0, 2.0]), np.array([-9.0, -99.0]), np.zeros(2))
    assert elsewhere > 0.999 and share.sum() + elsewhere == pytest.approx(1.0)


def test_what_tells_places_from_each_other_says_nothing_of_elsewhere() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    first, share, elsewhere = belief.places(poses, np.array([2.0, 2.0]), np.zeros(2), np.array([-7.0, -3.0]))
    assert first.tolist() == [1, 0] and share[0] / share[1] == pytest.approx(np.exp(4.0))
    assert elsewhere == pytest.approx(1.0 / (1.0 + 2.0 * np.exp(2.0)))


def test_what_the_map_contradicts_decides_between_places_only_so_far() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])  # much was moved in the room of the first
    first, share, _ = belief.places(poses, np.array([10.0, -3.0]), np.zeros(2), np.array([-30.0, -3.0]))
    assert first.tolist() == [0, 1] and share[0] / share[1] == pytest.approx(np.exp(13.0 - 7.0))
    first, share, _ = belief.places(poses, np.array([4.0, 4.0]), np.zeros(2), np.array([-30.0, -3.0]))
    assert first.tolist() == [1, 0] and share[0] / share[1] == pytest.approx(np.exp(7.0))
    _, share, _ = belief.places(poses, np.array([4.0, 4.0]), np.zeros(2), np.array([-30.0, 2.0]))
    assert share[0] / share[1] == pytest.approx(np.exp(10.0))  # the map is right about the rest
    _, share, _ = belief.places(poses, np.array([4.0, 4.0]), np.zeros(2), np.array([-30.0, -12.0]))
    assert share[0] == pytest.approx(share[1])  # it is wrong everywhere


def test_where_nothing_speaks_for_any_place_the_robot_is_elsewhere() -> None:
    first, share, elsewhere = belief.places(np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros(0))
    assert (len(first), len(share), elsewhere) == (0, 0, 1.0)
    _, share, elsewhere = belief.places(np.zeros((1, 3)), np.array([-800.0]), np.zeros(1), np.zeros(1))
    assert (share[0], elsewhere) == (0.0, 1.0)
    _, share, elsewhere = belief.places(np.zeros((1, 3)), np.array([800.0]), np.zeros(1), np.zeros(1))
    assert (share[0], elsewhere) == (1.0, 0.0)


def test_a_place_is_ruled_out_by_being_less_likely_than_the_first_by_the_risk() -> None:
    nothing = np.zeros(3)
    some = Belief(None, np.zeros((3, 3)), np.array([0.9, 0.05, 0.0005]), 0.05, *[nothing] * 5)
    assert some.left(0.001).tolist() == [0, 1] and len(some) == 3
    none = Belief(None, np.zeros((0, 3)), np.zeros(0), 1.0, *[np.zeros(0)] * 5)
    assert none.left(0.001).tolist() == []
