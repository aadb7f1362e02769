"""From where a landmark is seen, and maps that cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.world import landmark_map
from glass_nav.world.landmark_map import LandmarkMap, UnknownLandmark


def tags(**fields):
    given = {
        "ids": ("A", "B"),
        "positions_m": np.array([[0.0, 0.0], [10.0, 0.0]]),
        "facing_rad": np.array([0.0, np.nan]),
        "view_rad": np.array([np.pi / 2.0, 2.0 * np.pi]),
        "range_m": np.array([15.0, 3.0]),
    }
    return LandmarkMap(**{**given, **fields})


@pytest.mark.parametrize(
    "point, seen",
    [
        pytest.param((5.0, 0.0), (True, False), id="in front of A, too far from B"),
        pytest.param((5.0, 4.9), (True, False), id="44 degrees off"),
        pytest.param((5.0, 5.1), (False, False), id="46 degrees off"),
        pytest.param((-1.0, 0.0), (False, False), id="behind A"),
        pytest.param((12.0, 1.0), (True, True), id="B is seen from all sides"),
        pytest.param((15.1, 0.0), (False, False), id="out of range"),
    ],
)
def test_a_tag_is_seen_from_within_its_view_and_range(point, seen):
    assert tags().in_view(np.array(point)).tolist() == list(seen)


def test_slack_widens_view_and_range():
    points = np.array([[5.0, 5.1], [15.1, 0.0]])
    assert tags().in_view(points, 1.1, np.radians(2.0))[:, 0].tolist() == [True, True]


def test_a_view_across_the_half_turn_is_one_view():
    west = tags(facing_rad=np.array([np.pi, np.nan]))
    assert west.in_view(np.array([[-3.0, 0.5], [-3.0, -0.5]]))[:, 0].tolist() == [True, True]


def test_ids_are_found_in_any_order_and_unknown_ones_named():
    assert tags().numbers(["B", "A"]).tolist() == [1, 0]
    assert "A" in tags() and "C" not in tags()
    with pytest.raises(UnknownLandmark, match="^landmark 'C' is not on the map, which has A, B$"):
        tags().numbers(["A", "C"])
    empty = landmark_map.seen_from_all_sides([], np.zeros((0, 2)))
    with pytest.raises(UnknownLandmark, match="which has none$"):
        empty.numbers(["A"])


def test_two_maps_make_one():
    both = tags(sigma_m=0.5).joined(landmark_map.seen_from_all_sides("C", np.array([[1.0, 1.0]]), 4.0))
    assert both.ids == ("A", "B", "C") and both.range_m.tolist() == [15.0, 3.0, 4.0] and both.sigma_m == 0.5


@pytest.mark.parametrize(
    "fields, text",
    [
        (
            {"range_m": np.array([1.0])},
            "expected 2 landmarks with positions (N, 2), facing (N,), view (N,) and range (N,), "
            "got (2, 2), (2,), (2,), (1,)",
        ),
        (
            {"positions_m": np.array([[0.0, 0.0], [np.inf, 0.0]])},
            "landmark 'B': position must be finite, got [inf, 0.0]",
        ),
        ({"facing_rad": np.array([np.inf, 0.0])}, "landmark 'A': facing must be finite, got inf"),
        ({"sigma_m": -0.1}, "sigma of the landmarks must be >= 0 m, got -0.1"),
    ],
)
def test_a_map_that_cannot_be_is_refused(fields, text):
    with pytest.raises(ValueError) as caught:
        tags(**fields)
    assert str(caught.value) == text
