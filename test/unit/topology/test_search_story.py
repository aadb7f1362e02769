"""The lines of a search in a terminal."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.topology import search_story
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.belief import Belief
from glass_nav.topology.search.search_params import SearchParams


def belief(*share: float) -> Belief:
    none = np.zeros(len(share))
    poses = np.zeros((len(share), 3))
    return Belief(
        None, poses, np.array(share), 1.0 - sum(share), none, none, none, none, none.astype(int), driven_m=4.2
    )


def test_each_meetpoint_is_a_line_of_what_was_seen_what_is_known_and_what_is_asked() -> None:
    localizer = AtlasLocalizer(
        atlas_file.load(shipped_atlases.find("document_example")), SearchParams(vote_mode="seed")
    )
    first = localizer.start(Meetpoint(3, 1.5, stamp_ns=5))
    line = search_story.after(first, localizer.forest, 5)
    assert line == f"meetpoint with 3 edges, 1.50 m from the walls: SEARCHING, {first.reason}; next turn RIGHT"
    second = localizer.update(Traversal(0, 8.0, 8.0), Meetpoint(3, 1.5, stamp_ns=9))
    assert search_story.after(second, localizer.forest, 9).startswith(
        "meetpoint 2 with 3 edges, 1.50 m from the walls, 8.0 m after U_TURN: SEARCHING, "
    )
    assert search_story.after(second, localizer.forest, 11).startswith("on the way: ")


@pytest.mark.parametrize(
    "share, words",
    [
        ((), "after 4.2 m: no place of the map fits what was seen so far; driving on to see more"),
        ((0.9,), "after 4.2 m: 1 place of the map fits, the best has 90%; driving on to see more"),
        ((0.6, 0.3, 1e-9), "after 4.2 m: 2 places of the map fit, the best has 60%; driving on to see more"),
    ],
)
def test_between_meetpoints_it_says_how_many_places_are_left(share: "tuple[float, ...]", words: str) -> None:
    assert search_story.on_the_way(belief(*share), risk=0.001) == words
