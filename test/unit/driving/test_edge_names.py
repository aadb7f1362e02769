"""What people call the edges of a meetpoint."""

from __future__ import annotations

import pytest

from glass_nav.driving.edge_names import rank_from_words
from glass_nav.topology.observations import ObservationError


@pytest.mark.parametrize(
    "words, degree, rank",
    [
        ("LEFT", 3, 1),
        ("RIGHT", 3, 2),
        ("RIGHT", 5, 4),
        ("U_TURN", 3, 0),
        ("U_TURN", 1, 0),
        ("FORWARD", 2, 1),
        ("LEFT", 2, 1),
        ("RIGHT", 2, 1),
        ("RANK_2", 4, 2),
        ("3", 4, 3),
        (" left ", 3, 1),
        ("0", 1, 0),
    ],
)
def test_an_edge_is_called_by_its_name_or_rank(words, degree, rank):
    assert rank_from_words(words, degree) == rank


@pytest.mark.parametrize(
    "words, degree, text",
    [
        ("AHEAD", 3, "edge must be LEFT, RIGHT, U_TURN, FORWARD, or a rank such as RANK_2 or 2, got 'AHEAD'"),
        ("FORWARD", 3, "edge FORWARD: the meetpoint has degree 3, FORWARD is the only way on of degree 2"),
        ("LEFT", 1, "edge LEFT: from a dead end only U_TURN leads away"),
        ("-1", 3, "edge must be LEFT, RIGHT, U_TURN, FORWARD, or a rank such as RANK_2 or 2, got '-1'"),
        ("RANK_3", 3, "turn of rank 3: the meetpoint it left has degree 3, allowed 0 to 2"),
    ],
)
def test_what_names_no_edge_is_refused(words, degree, text):
    with pytest.raises(ObservationError, match=f"^{text}$"):
        rank_from_words(words, degree)
