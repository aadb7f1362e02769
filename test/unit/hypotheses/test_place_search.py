"""A scan matched everywhere, a slice at a time: the places are those of one search, carried to where the robot is."""

from __future__ import annotations

import numpy as np
import pytest
from buildings import L_ROOM, loop_drive

from glass_nav.geometry import se2
from glass_nav.hypotheses import place_search
from glass_nav.hypotheses.place_search import PlaceSearch
from glass_nav.hypotheses.pose_tracker import same_place
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.sensing.distance_field import DistanceField


def search_from(true, odom_from_base):
    grid_map = L_ROOM.grid_map()
    field = DistanceField(grid_map)
    points = L_ROOM.scan(true).points_in_base()[::6]
    return PlaceSearch(ScanMatcher(grid_map, field), field, points, odom_from_base)


def complete(search, period_s=None):
    """How many slices it took."""
    slices = 1
    while not search.advance(period_s):
        slices += 1
    return slices


@pytest.mark.parametrize("slice_size", [200_000, 3_000_000])
def test_the_size_of_the_slices_does_not_change_the_places(monkeypatch, slice_size):
    true = loop_drive(3)[-1]
    monkeypatch.setattr(place_search, "_SLICE", 10**12)
    at_once = search_from(true, np.zeros(3))
    assert complete(at_once) == 1
    monkeypatch.setattr(place_search, "_SLICE", slice_size)
    sliced = search_from(true, np.zeros(3))
    assert complete(sliced) > 2
    np.testing.assert_array_equal(sliced.places(np.zeros(3)), at_once.places(np.zeros(3)))


def test_the_slices_are_smaller_where_scans_follow_each_other_quickly(monkeypatch):
    monkeypatch.setattr(place_search, "_SLICE", 2_000_000)
    true = loop_drive(3)[-1]
    slices = [complete(search_from(true, np.zeros(3)), period_s) for period_s in (None, 3.0, 0.1, 0.025, 0.0)]
    assert slices[0] == slices[1] == slices[2] < slices[3] < slices[4]
    assert slices[3] == pytest.approx(4 * slices[2], abs=4)


def test_the_best_place_is_the_one_where_the_robot_is_by_then():
    true, step = loop_drive(3)[-1], np.array([0.4, -0.1, 0.3])
    odom_from_base = np.array([5.0, 2.0, -1.0])
    search = search_from(true, odom_from_base)
    complete(search)
    places = search.places(se2.compose(odom_from_base, step))
    assert same_place(places[:1], se2.compose(true, step))[0]
    assert np.hypot(*(places[0] - se2.compose(true, step))[:2]) < 0.05
