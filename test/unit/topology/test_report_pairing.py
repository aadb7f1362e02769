"""The two reports of a driven edge: when they belong together."""

from __future__ import annotations

import pytest

from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.report_pairing import ReportPairing

S = 1_000_000_000
EDGE = Traversal(0, 8.0, 8.0)


def meetpoint(stamp_ns: int) -> Meetpoint:
    return Meetpoint(3, 1.5, stamp_ns=stamp_ns)


def test_a_pair_is_taken_once_both_reports_have_come_and_only_once() -> None:
    pairing = ReportPairing(tolerance_s=2.0)
    here = meetpoint(3 * S)
    pairing.put_meetpoint(here)
    assert pairing.take() is None
    pairing.put_traversal(EDGE, 3 * S)
    assert pairing.take() == (EDGE, here)
    assert pairing.take() is None


@pytest.mark.parametrize(
    "meetpoint_ns, traversal_ns, dropped",
    [
        (3 * S, 5 * S, ""),
        (3 * S, 5 * S + 1, "a meetpoint is dropped: the edge_traversal and the meetpoint at its end are stamped 2.000"),
        (9 * S, 5 * S, "a traversal is dropped: the edge_traversal and the meetpoint at its end are stamped 4.000 s"),
        (0, 50 * S, ""),
        (50 * S, 0, ""),
    ],
)
def test_of_two_reports_too_far_apart_the_older_is_dropped(meetpoint_ns: int, traversal_ns: int, dropped: str) -> None:
    pairing = ReportPairing(tolerance_s=2.0)
    pairing.put_meetpoint(meetpoint(meetpoint_ns))
    pairing.put_traversal(EDGE, traversal_ns)
    line = pairing.drop_older()
    assert ("" if line is None else line.text[: len(dropped)]) == dropped
    assert (line is None) == (not dropped) == (pairing.take() is not None)
    assert pairing.drop_older() is None


def test_a_cleared_pairing_has_neither_report() -> None:
    pairing = ReportPairing(tolerance_s=2.0)
    pairing.put_meetpoint(meetpoint(S))
    pairing.clear()
    pairing.put_traversal(EDGE, S)
    assert pairing.take() is None
