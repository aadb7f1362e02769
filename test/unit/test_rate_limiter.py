"""Now and then, by a clock that may jump."""

from __future__ import annotations

from glass_nav.rate_limiter import RateLimiter, period_s


def test_one_thing_in_a_period_goes_out():
    pace = RateLimiter()
    assert [pace.is_due(now_s, 1.0) for now_s in (10.0, 10.5, 10.9, 11.1, 12.0, 12.2)] == [
        True,
        False,
        False,
        True,
        False,
        True,
    ]


def test_time_that_jumps_back_lets_it_pass():
    pace = RateLimiter()
    assert pace.is_due(100.0, 5.0)
    assert pace.is_due(3.0, 5.0) and not pace.is_due(4.0, 5.0)


def test_a_rate_of_zero_and_less_is_no_limit():
    assert [period_s(rate_hz) for rate_hz in (4.0, 0.0, -1.0)] == [0.25, 0.0, 0.0]
