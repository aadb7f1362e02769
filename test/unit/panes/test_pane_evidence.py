"""What beams say of the pieces of a line: glass, a post, or nothing."""

from __future__ import annotations

from typing import Sequence

import numpy as np
import pytest

from glass_nav.panes.pane_evidence import INCIDENCES, Counts, Kind, Likelihoods

OBLIQUE = np.arange(INCIDENCES) >= 3


def pieces(kinds: str, open_behind: bool = False) -> Counts:
    """What two scans of each incidence see of pieces: g glass, o an opening, p a post, ? seen at oblique angles only."""
    returns = np.array([[kind == "p" or (kind == "g" and not oblique) for oblique in OBLIQUE] for kind in kinds], float)
    passes = 1.0 - returns
    for index, kind in enumerate(kinds):
        if kind == "?":
            returns[index], passes[index] = 0.0, OBLIQUE
    nothing = np.zeros_like(returns)
    order = (lambda seen: [nothing, seen]) if open_behind else (lambda seen: [seen, nothing])
    return Counts(*(2.0 * np.stack(order(seen), axis=1) for seen in (returns, passes)), np.zeros(len(kinds)))


def kinds_of(kinds: str, mapped: Sequence[int] = ()) -> str:
    sure = np.array([kind == "g" for kind in kinds])
    found = Likelihoods(pieces(kinds)).kinds(sure, np.isin(np.arange(len(kinds)), mapped))
    return "".join({Kind.PANE: "g", Kind.NOTHING: "o", Kind.THING: "p"}[Kind(kind)] for kind in found)


@pytest.mark.parametrize(
    ("line", "found"),
    [
        pytest.param("ggggggpgggggg", "ggggggpgggggg", id="a post between two panes"),
        pytest.param("ggggggoooooooogggggg", "ggggggoooooooogggggg", id="an open door between two panes"),
        pytest.param("gggggg????gggggg", "gggggggggggggggg", id="a stretch that nobody saw head-on"),
        pytest.param("oooooooooo", "oooooooooo", id="no piece that was seen head-on"),
    ],
)
def test_pieces_are_told_apart_along_a_line(line: str, found: str) -> None:
    assert kinds_of(line) == found


def test_a_piece_that_belongs_to_the_map_says_nothing() -> None:
    assert kinds_of("ggggpgggg", mapped=[4]) == "ggggggggg"


def test_one_beam_that_passed_head_on_does_not_cut_a_pane() -> None:
    seen = pieces("ggggggggg")
    seen.returns[4, 0, 0], seen.passes[4, 0, 0] = 1.0, 1.0
    kinds = Likelihoods(seen).kinds(np.ones(9, bool), np.zeros(9, bool))
    assert (kinds == Kind.PANE).all()


def test_before_the_open_a_pane_may_return_oblique_beams_too() -> None:
    """The same returns from everywhere: a thing where a wall is mapped behind, perhaps a pane where nothing is."""
    line = np.arange(20)
    some_glass = pieces("g" * 10 + "p" * 10)
    behind = Likelihoods(some_glass).whole(line)
    returns, passes = some_glass.returns.copy(), some_glass.passes.copy()
    for seen in (returns, passes):
        seen[10:] = seen[10:, ::-1]
    before_the_open = Likelihoods(Counts(returns, passes, some_glass.seen_from_m)).whole(line)
    assert behind + 5.0 < before_the_open


def test_a_thing_before_the_open_is_no_pane() -> None:
    assert Likelihoods(pieces("p" * 20, open_behind=True)).whole(np.arange(20)) < 1.0
