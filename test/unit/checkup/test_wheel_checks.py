"""The wheel at fault is named: a wrong radius bends a straight path, a wheel that slips counts too much."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.checkup import wheel_checks
from glass_nav.checkup.motion_checks import Moves
from glass_nav.geometry import wheel_steps

BASE_M = wheel_checks.WHEEL_BASE_M


def moves(radii=(1.0, 1.0), slips=(), pairs=30, noise_m=0.004):
    """Pairs half a metre apart, half of them with a turn; radii: true over assumed, slips: pair, wheel, metres."""
    rng = np.random.default_rng(0)
    turn = np.where(np.arange(pairs) % 2, rng.uniform(-0.4, 0.4, pairs), 0.0)
    counted = np.stack([0.5 - 0.5 * BASE_M * turn, 0.5 + 0.5 * BASE_M * turn])
    rolled = counted * np.array(radii)[:, None]
    for pair, wheel, extra_m in slips:
        counted[wheel, pair] += extra_m
    true = wheel_steps.step_of(rolled[0], rolled[1], BASE_M) + noise_m * rng.standard_normal((pairs, 3))
    return Moves(wheel_steps.step_of(counted[0], counted[1], BASE_M), true, False)


def found(given):
    return list(wheel_checks.check(given, "tf odom -> base_link"))


@pytest.mark.parametrize(
    "radii, side, size, turns",
    [
        ((1.0, 1.05), "right", "larger", "left"),
        ((1.05, 1.0), "left", "larger", "right"),
        ((0.95, 1.0), "left", "smaller", "left"),
        ((1.0, 0.95), "right", "smaller", "right"),
    ],
)
def test_a_wheel_of_another_radius_is_named(radii, side, size, turns):
    (finding,) = found(moves(radii))
    assert finding.name == "wheel-radius"
    assert f"the {side} wheel is {size} than the base's driver assumes" in finding.what
    assert f"degrees to the {turns} for each metre" in finding.what
    factor = float(finding.advice.split(" by ")[1].split()[0])
    assert factor == pytest.approx(max(radii, key=lambda radius: abs(radius - 1.0)), abs=0.01)


@pytest.mark.parametrize("wheel, side", [(0, "left"), (1, "right")])
def test_a_wheel_that_slips_is_named(wheel, side):
    (finding,) = found(moves(slips=[(pair, wheel, 0.15) for pair in range(0, 30, 5)]))
    assert finding.name == "wheel-slips"
    assert f"pairs of scans the {side} wheel of tf odom -> base_link counts 0.15 m more" in finding.what
    assert f"wheel_{side}_noise_m" in finding.advice


def test_wheels_that_are_fine_or_seldom_seen_are_not_blamed():
    assert found(moves()) == [] and found(moves((1.01, 1.0))) == []
    assert found(moves((1.0, 1.05), pairs=4)) == []
    assert found(moves(slips=[(3, 0, 0.2), (9, 0, 0.2)])) == []  # two may be a step over a threshold
    assert found(moves(slips=[(pair, pair % 2, 0.15) for pair in range(0, 30, 5)])) == []  # both: not a wheel
