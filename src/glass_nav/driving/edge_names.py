"""Names of edges at a meetpoint, as people write them, and their ranks."""

from __future__ import annotations

import re

from glass_nav.topology.observations import FORWARD, LEFT, RIGHT, U_TURN, ObservationError, refuse_rank

_RANK = re.compile(r"(?:RANK_)?(\d+)$")


def rank_from_words(edge: str, degree: int) -> int:
    """The rank of LEFT, RIGHT, U_TURN, FORWARD, RANK_2 or 2 at a meetpoint of that degree.

    Raises:
        ObservationError: none of these, or no such edge.
    """
    word = edge.strip().upper()
    numbered = _RANK.match(word)
    if numbered:
        rank = int(numbered.group(1))
    elif word == U_TURN:
        rank = 0
    elif word in (LEFT, RIGHT):
        if degree == 1:
            raise ObservationError(f"edge {word}: from a dead end only {U_TURN} leads away")
        rank = 1 if word == LEFT else degree - 1
    elif word == FORWARD:
        if degree != 2:
            raise ObservationError(
                f"edge {FORWARD}: the meetpoint has degree {degree}, {FORWARD} is the only way on of degree 2"
            )
        rank = 1
    else:
        raise ObservationError(
            f"edge must be {LEFT}, {RIGHT}, {U_TURN}, {FORWARD}, or a rank such as RANK_2 or 2, got {edge!r}"
        )
    refuse_rank(rank, degree)
    return rank
