"""Why search nodes went: the test and both values, as the document's figures write them."""

from __future__ import annotations

import math
from typing import List

import made_atlases
import numpy as np
import pytest

from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search import mismatches
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.belief import RuledOut
from glass_nav.topology.search.search_params import SearchParams


def gone(localizer: AtlasLocalizer) -> List[RuledOut]:
    return mismatches.of_last_row(localizer.matcher, localizer.forest)


def test_the_worked_example_of_the_document_says_why_each_search_node_went() -> None:
    atlas = atlas_file.load(shipped_atlases.find("document_example"))
    localizer = AtlasLocalizer(atlas, SearchParams(vote_mode="seed", confirm_edges=0))
    assert gone(localizer) == []
    localizer.start(Meetpoint(3, 1.5))
    assert [(int(atlas.darts.node[each.dart]), mismatches.words(each)) for each in gone(localizer)] == [
        (2, "degree 1, seen 3"),
        (3, "degree 1, seen 3"),
    ]
    localizer.update(Traversal(0, 8.0, 8.0), Meetpoint(3, 1.5))
    assert {mismatches.words(each) for each in gone(localizer)} == {
        "length 11.20 m, driven 8.00 m",
        "length 4.62 m, driven 8.00 m",
    }
    localizer.update(Traversal(2, 11.2, 8.0), Meetpoint(3, 1.5))
    assert [mismatches.words(each) for each in gone(localizer)] == ["length 4.62 m, driven 11.20 m"]


T = made_atlases.corridors([(0, 0), (6, 0), (14, 0), (6, 5)], [0.9, 1.3, 1.7, 0.6], [(0, 1), (1, 2), (1, 3)])


@pytest.mark.parametrize(
    "traversal, meetpoint, test, expected, seen",
    [
        (Traversal(0, 6.0, 6.0), Meetpoint(2, 1.3), "degree", 3.0, 2.0),
        (Traversal(0, 6.0, 6.0), Meetpoint(3, 2.0), "r", 1.3, 2.0),
        (Traversal(0, 9.0, 6.0), Meetpoint(3, 1.3), "length", 6.0, 9.0),
        (Traversal(0, 6.0, 4.0), Meetpoint(3, 1.3), "chord", 6.0, 4.0),
        (Traversal(0, 6.0, 6.0, chord_bearing_rad=0.0, turn_rad=1.5), Meetpoint(3, 1.3), "turn", 0.0, 1.5),
        (
            Traversal(0, 6.0, 6.0),
            Meetpoint(3, 1.3, bearings_rad=np.array([np.pi, 2.6, 1.5])),
            "angles",
            math.pi,
            math.pi - 1.5,
        ),
    ],
)
def test_the_first_test_that_failed_is_named_with_both_values(
    traversal: Traversal, meetpoint: Meetpoint, test: str, expected: float, seen: float
) -> None:
    localizer = AtlasLocalizer(T, SearchParams(max_detection_errors=0))
    localizer.start(Meetpoint(1, 0.9))
    localizer.update(traversal, meetpoint)
    (only,) = gone(localizer)
    assert T.darts.node[only.dart] == 1 and only.test == test
    assert (only.expected, only.seen) == (pytest.approx(expected, abs=0.01), pytest.approx(seen, abs=0.01))


@pytest.mark.parametrize(
    "test, expected, seen, unit, words",
    [
        ("degree", 3.0, 4.0, "", "degree 3, seen 4"),
        ("r", 1.52, 0.98, "m", "r 1.52 m, seen 0.98 m"),
        ("turn", 0.0, math.pi / 2, "rad", "turn 0 deg, driven 90 deg"),
        ("segments", 0.0, 0.7, "", "70% of the walls seen stand in free space"),
        ("scan", 1.0, 0.31, "", "explains 31% of the scan"),
        ("scan", 1.0, math.nan, "", "the scan does not fit"),
    ],
)
def test_each_reason_has_words(test: str, expected: float, seen: float, unit: str, words: str) -> None:
    assert mismatches.words(RuledOut(np.zeros(3), 0, test, expected, seen, unit)) == words
