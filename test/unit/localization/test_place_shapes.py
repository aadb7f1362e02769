"""Places of a global search in rviz: big enough to be seen, each with its share, gone when the search is over."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.localization.place_shapes import MAX_PLACES, PLACES_NAMESPACE, place_shapes, places
from glass_nav.shapes import Text

TWO = np.concatenate([np.tile([3.0, 4.0, 0.0], (30, 1)), np.tile([20.0, 4.2, 1.0], (70, 1))])


def texts(shapes):
    return [each for each in shapes if isinstance(each, Text)]


def test_each_place_has_a_ring_and_its_share():
    ring, *rest = place_shapes("GLOBAL_SEARCH", TWO)
    assert [each.text for each in rest[:3]] == ["70 %", "30 %", ""]
    assert rest[0].at_m[:2] == pytest.approx([20.0, 4.2], abs=2.0) and rest[0].at_m[1] < 4.2 - 0.6
    for place in ([20.0, 4.2], [3.0, 4.0]):
        off = np.hypot(*(ring.points_m - place).T)
        assert np.count_nonzero(np.abs(off - 0.6) < 0.01) >= 40
    assert ring.width_m >= 0.1 and rest[0].letter_m >= 0.5  # seen when all of a floor is


@pytest.mark.parametrize("state", ["LOCALIZED", "LOST", "UNKNOWN"])
def test_what_is_no_search_clears_what_was_drawn(state):
    ring, *rest = place_shapes(state, TWO)
    assert len(ring.points_m) == 0 and {each.text for each in rest} == {""}


def test_the_names_and_numbers_are_always_the_same():
    names = [
        [(each.namespace, each.number) for each in place_shapes(state, TWO)] for state in ("LOST", "GLOBAL_SEARCH")
    ]
    assert names[0] == names[1] and {name for name, _ in names[0]} == {PLACES_NAMESPACE}


def test_of_many_places_the_most_probable_are_drawn():
    rng = np.random.default_rng(0)
    scattered = np.column_stack([rng.uniform(0, 100, (200, 2)), np.zeros(200)])
    poses, shares = places(np.concatenate([TWO, scattered]))
    assert len(poses) == MAX_PLACES and shares[0] == pytest.approx(70 / 300, abs=0.02)
    assert list(shares) == sorted(shares, reverse=True) and shares.sum() <= 1.0


def test_no_particle_is_no_place():
    assert len(texts(place_shapes("GLOBAL_SEARCH", np.zeros((0, 3))))) == MAX_PLACES
    assert len(places(np.zeros((0, 3)))[0]) == 0
