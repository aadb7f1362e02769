"""Scans of a robot that stands, worked by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import List

import numpy as np
import pytest

from glass_nav.driving.edge_tracking import moving_things
from glass_nav.sensing.scan import Scan

ANGLES_RAD = np.linspace(-0.5, 0.5, 101)
PERSON = slice(40, 48)  # beams


def scans(person_m: "np.ndarray | list[float]", wall_m: float = 4.0) -> List[Scan]:
    """One for each distance of somebody in front of a wall."""
    found = []
    for number, away_m in enumerate(person_m):
        ranges_m = np.full(101, wall_m) + np.random.default_rng(number).normal(0.0, 0.01, 101)
        ranges_m[PERSON] = away_m
        found.append(Scan(number, ranges_m, ANGLES_RAD, 0.1, 25.0, np.zeros(3)))
    return found


@pytest.mark.parametrize("step_m", [0.01, -0.01], ids=["away", "here"])
def test_a_person_who_walks_at_a_decimetre_a_second_moves_and_the_wall_does_not(step_m: float) -> None:
    seen = scans(2.0 + step_m * np.arange(12))
    moved = moving_things.moved_m(seen)
    np.testing.assert_allclose(moved, seen[-1].points_in_base()[PERSON])


@pytest.mark.parametrize(
    "person_m",
    [
        pytest.param([2.0] * 12, id="stands"),
        pytest.param([2.0] * 6 + [4.0] * 6, id="a pane that stops answering"),
        pytest.param([2.0] * 6 + [np.inf] * 6, id="with nothing behind"),
        pytest.param([2.0, 4.0] * 6, id="that answers now and then"),
        pytest.param([2.0], id="a single scan"),
        pytest.param([], id="none"),
    ],
)
def test_what_stands_does_not_move(person_m: "list[float]") -> None:
    assert not len(moving_things.moved_m(scans(person_m)))


def test_two_beams_are_too_few_and_scans_of_different_lidars_are_not_compared() -> None:
    seen = scans(2.0 + 0.01 * np.arange(12))
    narrow = [replace(scan, ranges_m=np.where(np.arange(101) > 41, 4.0, scan.ranges_m)) for scan in seen]
    assert not len(moving_things.moved_m(narrow))
    other = replace(seen[-1], ranges_m=np.ones(2), angles_rad=np.zeros(2))
    assert not len(moving_things.moved_m([*seen, other]))
    assert not len(moving_things.moved_m([other] * 6))
