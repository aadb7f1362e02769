from __future__ import annotations

import math

import pytest

from glass_nav.driving.base_limits import BaseLimits


@pytest.mark.parametrize("name", sorted(vars(BaseLimits())))
@pytest.mark.parametrize("value", [-0.1, math.inf, math.nan])
def test_a_limit_that_is_none_is_refused(name, value):
    with pytest.raises(ValueError) as refused:
        BaseLimits(**{name: value})
    assert str(refused.value) == f"~{name} must be > 0 and finite, got {value}"


def test_only_the_margin_may_be_nothing():
    assert BaseLimits(margin_m=0.0).margin_m == 0.0
    with pytest.raises(ValueError, match="^~robot_radius_m must be > 0 and finite, got 0.0$"):
        BaseLimits(robot_radius_m=0.0)
