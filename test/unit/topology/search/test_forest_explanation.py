"""The forest in words: the document's worked example, line by line."""

from __future__ import annotations

from typing import List

import made_atlases

from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search import forest_explanation
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.search_params import SearchParams

DOCUMENT = SearchParams(vote_mode="seed", confirm_edges=0)


def lines(localizer: AtlasLocalizer) -> List[str]:
    assert localizer.estimate is not None
    return [line.strip() for line in forest_explanation.row(localizer, localizer.estimate)]


def test_the_rows_of_the_worked_example_are_those_of_the_document() -> None:
    localizer = AtlasLocalizer(atlas_file.load(shipped_atlases.find("document_example")), DOCUMENT)
    localizer.start(Meetpoint(3, 1.5))
    assert [line for line in lines(localizer) if line.startswith("node")] == [
        "node   0  active",
        "node   1  active",
        "node   2  x  node: degree 1",
        "node   3  x  node: degree 1",
    ]
    localizer.update(Traversal(0, 8.0, 8.0), Meetpoint(3, 1.5))
    first = lines(localizer)
    assert sum("active" in line for line in first) == 2
    # "Node matching is used to eliminate Search Nodes for candidates 2 and 3. Edge matching is used to eliminate Search
    # Nodes for candidates 1 and 0."
    assert {line.partition("->")[2].split("  x  ")[0].strip(): line for line in first if "x  node" in line}.keys() == {
        "node   2",
        "node   3",
    }
    assert {line.partition("->")[2].split("  x  ")[0].strip() for line in first if "x  edge" in line} == {
        "node   0",
        "node   1",
    }
    assert first[-2:] == ["votes: 0 left, 2 right", "SEARCHING: 2 candidates; turn RIGHT"]
    localizer.update(Traversal(2, 11.2, 8.0), Meetpoint(3, 1.5))
    second = lines(localizer)
    # "The node and edge matching eliminate candidates 3 and 2. The edge turn direction eliminates candidate 1."
    assert "node   0 - edge   1 -> node   1  x  turn LEFT" in second
    assert [line for line in second if line.endswith("active")] == ["node   1 - edge   1 -> node   0  active"]
    assert second[-1] == "CONFIRMED: the only place that matches, confirmed by 0 edges"


def test_candidates_that_take_errors_of_the_detector_are_told_apart() -> None:
    atlas = made_atlases.corridors(
        [(0, 0), (6, 0), (14, 0), (26, 0), (6, 4)], [0.9, 1.3, 1.7, 0.5, 1.4], [(0, 1), (1, 2), (2, 3), (1, 4)]
    )
    localizer = AtlasLocalizer(atlas, SearchParams())
    localizer.start(Meetpoint(1, 0.9))
    localizer.update(Traversal(0, 14.0, 14.0), Meetpoint(2, 1.7))
    assert "node   2    active with 1 detection error" in lines(localizer)
    localizer.start(Meetpoint(1, 0.7))
    assert [line for line in lines(localizer) if "x  node: r" in line] == ["node   4  x  node: r 1.40 m"]


def test_a_row_of_a_large_atlas_is_shortened() -> None:
    atlas = made_atlases.torus(10, 10)
    localizer = AtlasLocalizer(atlas, DOCUMENT)
    localizer.start(Meetpoint(4, 1.5))
    assert "... and 60 more active, 0 inactive" in lines(localizer)


def test_a_row_without_candidates_is_drawn_too() -> None:
    localizer = AtlasLocalizer(atlas_file.load(shipped_atlases.find("document_example")), DOCUMENT)
    localizer.start(Meetpoint(3, 1.5))
    localizer.update(Traversal(0, 20.0, 20.0), Meetpoint(3, 1.5))
    assert lines(localizer)[-1] == "LOST: no node of the atlas matches what was seen"
